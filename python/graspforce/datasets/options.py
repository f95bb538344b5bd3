"""Options of the quality of all grasps of a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from graspforce._core import Grasp, quality_many
from graspforce._internal.checks import chosen, instance, real_number, whole_number
from graspforce.errors import InvalidGraspError, InvalidInputError
from graspforce.typing import CRITERIA

if TYPE_CHECKING:
    from collections.abc import Sequence

    from graspforce.typing import Criterion


@dataclass(frozen=True, slots=True)
class GradeOptions:
    """Options of all rows, checked by the constructor.

    Attributes
    ----------
    criteria : tuple of str
        Some of ``"max"`` and ``"sum"``.
    edges : int or None
        Edges of the linearised friction cones; None for true cones.
    rtol : float or None
        Relative width of the bracket that counts as converged, as for `graspforce.Grasp.quality`.
    length_scale : float or None
        Length scale in m for datasets without a column of this name; None for 1 m.
    """

    criteria: tuple[Criterion, ...] = CRITERIA
    edges: int | None = 8
    rtol: float | None = None
    length_scale: float | None = None

    def __post_init__(self) -> None:
        """Check the options, by the core's checks, before any grasp is read."""
        if not self.criteria or len(set(self.criteria)) != len(self.criteria):
            raise InvalidInputError(f"criteria: {self.criteria!r}, expected some of {CRITERIA}, each once")
        nothing = np.empty((0, 1, 3))
        try:
            # The core checks the edges of contacts, so a grasp is needed.
            Grasp([(1, 0, 0), (-1, 0, 0)], [(-1, 0, 0), (1, 0, 0)], edges=self.edges)
            for criterion in self.criteria:
                quality_many(nothing, nothing, criterion=criterion, **self.arguments())
        except InvalidGraspError as error:
            raise InvalidInputError(str(error)) from None

    @classmethod
    def of(
        cls,
        criteria: Sequence[str] | str,
        *,
        edges: int | None = 8,
        rtol: float | None = None,
        length_scale: float | None = None,
    ) -> GradeOptions:
        """Return options of one criterion or several, with numbers that JSON can hold."""
        instance("criteria", criteria, str, list, tuple)
        given = (criteria,) if isinstance(criteria, str) else tuple(criteria)
        for criterion in given:
            chosen("criteria", criterion, CRITERIA)
        return cls(
            cast("tuple[Criterion, ...]", given),
            None if edges is None else whole_number("edges", edges, least=3),
            None if rtol is None else real_number("rtol", rtol),
            None if length_scale is None else real_number("length_scale", length_scale),
        )

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `graspforce.quality_many` but the criterion."""
        scale = {} if self.length_scale is None else {"length_scale": self.length_scale}
        return {"edges": self.edges, "rtol": self.rtol, **scale}
