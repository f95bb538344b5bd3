"""Options of quality that hold for every grasp of a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from graspforce._core import Grasp, quality_many
from graspforce._internal.checks import chosen, instance, real_number, whole_number
from graspforce.errors import InvalidGraspError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from graspforce.typing import Criterion

__all__ = ["GradeOptions"]

_CRITERIA: tuple[Criterion, ...] = ("max", "sum")


@dataclass(frozen=True, slots=True)
class GradeOptions:
    """Options that hold for all rows; checked when made.

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

    criteria: tuple[Criterion, ...] = _CRITERIA
    edges: int | None = 8
    rtol: float | None = None
    length_scale: float | None = None

    def __post_init__(self) -> None:
        """Let the core check the options before any grasp is read."""
        if not self.criteria or len(set(self.criteria)) != len(self.criteria):
            raise InvalidInputError(f"criteria: {self.criteria!r}, expected some of {_CRITERIA}, each once")
        nothing = np.empty((0, 1, 3))
        try:
            # The core checks edges contact by contact, so that they need a grasp.
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
        """Take one criterion or several, and numbers of any kind, as plain ones that JSON can hold."""
        instance("criteria", criteria, str, list, tuple)
        given = (criteria,) if isinstance(criteria, str) else tuple(criteria)
        for criterion in given:
            chosen("criteria", criterion, _CRITERIA)
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
