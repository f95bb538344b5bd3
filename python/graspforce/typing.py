"""Types that several modules share, and that a caller's annotations may use."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias, TypedDict, get_args

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from ._core import Grasp, Quality

__all__ = [
    "CRITERIA",
    "GRASP_ARGUMENTS",
    "Criterion",
    "Feasible",
    "GraspOptions",
    "SearchResult",
    "Stopped",
    "Surface",
]

Criterion: TypeAlias = Literal["max", "sum"]
"""Which normalised normal forces are limited to 1: each of them (max), or their sum (sum)."""

CRITERIA: tuple[Criterion, ...] = get_args(Criterion)
"""Both criteria."""

Surface: TypeAlias = Callable[["NDArray[np.float64]"], "tuple[ArrayLike, ...]"]
"""Parameters (B, p) to positions (B, m, dim), normals (B, m, dim) and, optionally, tangents (B, m, dim)."""

Feasible: TypeAlias = Callable[["NDArray[np.float64]", "NDArray[np.float64]"], "ArrayLike"]
"""Positions and normals (B, m, dim) to (B,) bool: which grasps the hand can take."""

Stopped: TypeAlias = Literal["tolerance", "target", "time", "interrupted", "error"]
"""Why a search ended."""


class GraspOptions(TypedDict, total=False):
    """The optional arguments of `graspforce.Grasp`, in its order."""

    friction: ArrayLike
    max_normal_force: ArrayLike
    edges: ArrayLike | None
    torsion: ArrayLike | None
    tangents: ArrayLike | None
    origin: ArrayLike | None
    length_scale: float
    friction_margin: float
    extreme_forces: Sequence[ArrayLike] | None


GRASP_ARGUMENTS = ("positions", "normals", *GraspOptions.__annotations__)
"""All arguments of `graspforce.Grasp`, in its order."""


class SearchResult(Protocol):
    """What a `Plan`, a `Refinement` and a `GlobalOptimum` have in common."""

    @property
    def params(self) -> NDArray[np.float64]:
        """(p,) parameters of the best grasp found."""
        ...

    @property
    def grasp(self) -> Grasp:
        """The grasp there."""
        ...

    @property
    def quality(self) -> Quality:
        """Its quality."""
        ...
