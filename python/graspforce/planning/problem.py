"""The problem that every search of the planner solves: candidates, options of quality, and their score."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import chosen, known_options, real_number
from graspforce.errors import InvalidInputError
from graspforce.typing import GraspOptions

from .candidates import CandidateSource
from .placement_noise import PlacementNoise
from .scoring import EpsilonScore, Score

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp, Quality
    from graspforce.typing import Feasible, Surface


@dataclass(frozen=True, slots=True)
class SearchProblem:
    """Candidates, the options of their quality, and the score that compares them."""

    surface: Surface
    source: CandidateSource
    quality_options: dict[str, Any]
    """Arguments of `Grasp.quality`."""
    score: Score

    @classmethod
    def of(
        cls,
        search: Callable[..., object],
        surface: Surface,
        grasp_options: Mapping[str, Any],
        feasible: Feasible | None,
        min_distance: float,
        *,
        max_opening: float = np.inf,
        placement: PlacementNoise | None = None,
        prune: bool = True,
        **quality_options: Any,
    ) -> SearchProblem:
        """Check the arguments of the function `search` before the surface is called."""
        chosen("criterion", quality_options["criterion"], ("max", "sum"))
        # A surface may know the friction and limits of its contacts; what the caller says comes first.
        options = {**getattr(surface, "grasp_options", {}), **grasp_options}
        known_options(options, GraspOptions.__annotations__, search)
        source = CandidateSource(surface, options, feasible, min_distance, max_opening)
        if placement is None:
            return cls(surface, source, quality_options, EpsilonScore(prune=prune, **quality_options))
        if not isinstance(placement, PlacementNoise):
            raise InvalidInputError(f"placement: {placement!r} is not a graspforce.PlacementNoise")
        return cls(surface, source, quality_options, placement.score(quality_options))

    def answer(self, params: NDArray[np.float64]) -> tuple[Grasp, Quality]:
        """Return the grasp at (p,) parameters and its quality."""
        grasp = self.source.grasp(params)
        return grasp, grasp.quality(**self.quality_options)


def deadline_after(seconds: float | None) -> float:
    """Return the `time.monotonic` value at which a search of so many seconds must end."""
    limit = np.inf if seconds is None else real_number("time_limit", seconds, least=0, finite=False)
    return time.monotonic() + limit


def read_only_copy(values: ArrayLike) -> NDArray[np.float64]:
    """Copy an array that a result keeps, so that nothing else changes it or keeps it alive."""
    own = np.array(values, dtype=np.float64)
    own.flags.writeable = False
    return own
