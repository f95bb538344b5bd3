"""The problem that every search of the planner solves: candidates, options of quality, and their score."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import chosen, known_options
from graspforce.errors import InvalidInputError
from graspforce.typing import GraspOptions

from .candidates import CandidateSource
from .placement_noise import PlacementNoise
from .scoring import EpsilonScore, Score

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp, Quality
    from graspforce.typing import Feasible, Surface

__all__ = ["SearchProblem", "read_only"]


@dataclass(frozen=True, slots=True)
class SearchProblem:
    """Candidates, the options of their quality, and the score that compares them."""

    source: CandidateSource
    question: dict[str, Any]
    """Arguments of `Grasp.quality`."""
    score: Score

    @classmethod
    def of(
        cls,
        surface: Surface,
        grasp_options: Mapping[str, Any],
        feasible: Feasible | None,
        min_distance: float,
        *,
        placement: PlacementNoise | None = None,
        prune: bool = True,
        **question: Any,
    ) -> SearchProblem:
        """Check the arguments of a search before the surface is called."""
        chosen("criterion", question["criterion"], ("max", "sum"))
        # A surface may know the friction and limits of its contacts; what the caller says comes first.
        options = {**getattr(surface, "grasp_options", {}), **grasp_options}
        known_options(options, GraspOptions.__annotations__)
        source = CandidateSource(surface, options, feasible, min_distance)
        if placement is None:
            return cls(source, question, EpsilonScore(prune=prune, **question))
        if not isinstance(placement, PlacementNoise):
            raise InvalidInputError(f"placement: {placement!r} is not a graspforce.PlacementNoise")
        return cls(source, question, placement.score(question))

    def answer(self, params: NDArray[np.float64]) -> tuple[Grasp, Quality]:
        """Return the grasp at (p,) parameters and its quality."""
        grasp = self.source.grasp(params)
        return grasp, grasp.quality(**self.question)


def read_only(values: ArrayLike) -> NDArray[np.float64]:
    """Copy what a result keeps, so that nothing else keeps it alive or changes it."""
    own = np.array(values, dtype=np.float64)
    own.flags.writeable = False
    return own
