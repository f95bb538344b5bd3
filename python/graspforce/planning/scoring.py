"""How the planner compares candidate grasps: by their certified quality, or by another score."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Protocol

from graspforce._core import CandidateSearch
from graspforce._internal.restored import expect_whole
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Contacts = dict[str, Array]


@dataclass(frozen=True, slots=True)
class SearchCounts(Record):
    """Numbers of candidates and polytopes of a search.

    Attributes
    ----------
    candidates : int
        Candidate grasps, after merging those that coincide.
    infeasible : int
        Candidates refused by ``feasible`` or by ``min_distance``.
    rejected : int
        Candidates rejected by their support function along a critical direction of another grasp.
    polytopes : int
        Expanding polytopes started.
    converged : int
        Polytopes whose bracket became as narrow as asked for. The others ended when their upper bound fell
        below the best epsilon.
    """

    candidates: int = 0
    infeasible: int = 0
    rejected: int = 0
    polytopes: int = 0
    converged: int = 0

    def _check(self) -> None:
        for field in fields(self):
            expect_whole(field.name, getattr(self, field.name))

    def __add__(self, other: SearchCounts) -> SearchCounts:
        """Return the cost of both."""
        return SearchCounts(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    def __sub__(self, other: SearchCounts) -> SearchCounts:
        """Return what came after `other` was read."""
        return SearchCounts(*(getattr(self, f.name) - getattr(other, f.name) for f in fields(self)))


@dataclass(frozen=True, slots=True)
class Choice:
    """The winner among candidates, the centre's quality (infinite where that is infeasible), and the cost."""

    index: int
    rho: float
    center_rho: float
    counts: SearchCounts


class Score(Protocol):
    """A measure of grasps, smaller is better, that picks the best of many."""

    def best(
        self,
        options: Mapping[str, Any],
        contacts: Contacts,
        center: int,
        known: float | None,
    ) -> Choice:
        """Pick the best row; the centre wins ties, else the lowest row."""
        ...


class EpsilonScore:
    """The certified quality itself, by the core's pruned search."""

    def __init__(self, *, prune: bool, **quality_options: Any) -> None:
        self._prune, self._quality_options = prune, quality_options
        self._search: CandidateSearch | None = None

    def best(
        self,
        options: Mapping[str, Any],
        contacts: Contacts,
        center: int,
        known: float | None,
    ) -> Choice:
        """Pick the best row by rho; the pool of critical directions lasts from call to call."""
        if self._search is None:
            dim = contacts["positions"].shape[-1]
            self._search = CandidateSearch(dim, **self._quality_options, prune=self._prune)
        given: dict[str, Any] = {**options, **contacts}
        found = self._search.best(**given, center_index=center, center_rho=known)
        cost = {name: found[name] for name in ("rejected", "polytopes", "converged")}
        return Choice(found["index"], found["rho"], found["center_rho"], SearchCounts(**cost))
