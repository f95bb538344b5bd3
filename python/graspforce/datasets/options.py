"""What is asked of every grasp of a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast

import numpy as np

from graspforce._core import quality_many
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Criterion", "GradeOptions"]

Criterion: TypeAlias = Literal["max", "sum"]

_CRITERIA: tuple[Criterion, ...] = ("max", "sum")


@dataclass(frozen=True, slots=True)
class GradeOptions:
    """The same for all rows; checked when made.

    Attributes
    ----------
    criteria : tuple of str
        Some of ``"max"`` and ``"sum"``.
    edges : int or None
        Of the linearised friction cones; None for true cones.
    rtol : float or None
        Relative width of the bracket that counts as converged, as for `graspforce.Grasp.quality`.
    length_scale : float or None
        For datasets without a column of this name; None for 1 m.
    """

    criteria: tuple[Criterion, ...] = _CRITERIA
    edges: int | None = 8
    rtol: float | None = None
    length_scale: float | None = None

    def __post_init__(self) -> None:
        """Let the core look at the options before there are any grasps."""
        if not self.criteria or len(set(self.criteria)) != len(self.criteria):
            raise InvalidInputError(f"criteria: {self.criteria!r}, expected some of {_CRITERIA}, each once")
        nothing = np.empty((0, 1, 3))
        for criterion in self.criteria:
            quality_many(nothing, nothing, criterion=criterion, **self.arguments())

    @classmethod
    def of(cls, criteria: Sequence[str] | str, **others: Any) -> GradeOptions:
        """Take one criterion or several."""
        given = (criteria,) if isinstance(criteria, str) else tuple(criteria)
        return cls(cast("tuple[Criterion, ...]", given), **others)

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `graspforce.quality_many` but the criterion."""
        scale = {} if self.length_scale is None else {"length_scale": self.length_scale}
        return {"edges": self.edges, "rtol": self.rtol, **scale}
