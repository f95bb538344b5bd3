"""The search for usable poses: seeds, the snap, and refinement, until they end or are ended."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from .candidates import GAP, Candidates, measured
from .kinematics import Poses
from .refinement import refined
from .seeds import contact_seeds, palm_seeds
from .snap import SnapOptions, snap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .distances import Distances
    from .grasp_problem import GraspProblem


_REFINED = 6
_ROUNDS, _MOVES = 6, 8
_AT_ONCE = 120
_NEARLY = 15
_PER_METRE, _PER_COSINE = 1e3, 10.0  # what a pose lacks to be usable; 1 mm counts like 0.1 of a pad's cosine


class Search:
    """One search, with what became of its poses and whether it was ended before its time."""

    def __init__(self, distances: Distances, problem: GraspProblem, seed: int, deadline: float) -> None:
        self._distances, self._problem, self._deadline = distances, problem, deadline
        self._rng = np.random.default_rng(seed)
        self.counts: Counter[str] = Counter()
        self.interrupted = False
        self._nearly: list[tuple[float, NDArray[np.float64]]] = []
        """Driven joints at which poses ended, with what they lack to be usable; the nearest ones."""

    @property
    def expired(self) -> bool:
        """Whether time is over."""
        return time.monotonic() > self._deadline

    @property
    def ended(self) -> bool:
        """Whether nothing more is to be tried."""
        return self.interrupted or self.expired

    def starts(self, seeds: str, samples: int, count: int, spread: float) -> Poses:
        """Return poses to begin with; see `graspforce.plan_hand`.

        Fingers that bent towards a small object, but not onto it, tell the next round how to be preshaped.
        """
        nearly = np.array([joints for _, joints in self._nearly]) if self._nearly else None
        share = -(-count // 2) if seeds == "both" else count
        parts = []
        if seeds != "contacts":
            parts.append(
                palm_seeds(self._distances, self._problem, self._rng, samples, share, spread, nearly)
            )
        if seeds != "palms":
            parts.append(contact_seeds(self._distances, self._problem, self._rng, samples, share))
        return Poses.joined(parts)

    def usable(self, poses: Poses, pad: float | None, steps: int, *, refine: bool) -> Candidates | None:
        """Put poses onto the surface, and return those that are usable, the refined ones first.

        Ctrl-C ends the search as soon as there is something to return.
        """
        parts: list[Candidates] = []
        try:
            for first in range(0, len(poses), _AT_ONCE):
                some = self._snapped(poses[slice(first, first + _AT_ONCE)], pad, steps)
                parts += [some] if len(some) else []
                if self.ended:
                    break
            if not parts:
                return None
            found = Candidates.joined(parts)
            if not refine or self.ended:
                return found
            top = np.argsort(-found.score, kind="stable")[:_REFINED]
            better = refined(
                self._distances, self._problem, found[top], self._rng, rounds=_ROUNDS, moves=_MOVES, pad=pad,
                ended=lambda: self.ended,
            )  # fmt: skip
            return Candidates.joined([better, found])
        except KeyboardInterrupt:
            if not parts:
                raise
            self.interrupted = True
            return Candidates.joined(parts)

    def why(self) -> str:
        """Say why no pose became a plan."""
        counts = self.counts
        lost = [
            (counts["unreached"], "did not bring all tips to the surface"),
            (counts["colliding"], "are in collision"),
            (counts["off their pads"], "touch beside the pads"),
        ]
        # Refined poses are examined, too.
        useless = [
            (counts["open"], "are not force closure"),
            (counts["without preload"], "have no forces that press all fingers within friction"),
            (counts["beyond torques"], "press less than a quarter of the preload within the torque limits"),
        ]
        examined = sum(count for count, _ in useless)
        reasons = [f"of {counts['tried']} poses {_listed(lost)}"]
        reasons += [f"of {examined} with contacts {_listed(useless)}"] if examined else []
        stronger = "stronger joints, " if counts["beyond torques"] else ""
        hint = f"more starts, other fingers, less preload, {stronger}or a larger time limit may help"
        return f"no grasp found: {'; '.join(reasons)}; {'time was over' if self.expired else hint}"

    def _snapped(self, poses: Poses, pad: float | None, steps: int) -> Candidates:
        touching = snap(self._distances, poses, SnapOptions(pad=pad, steps=steps))
        found = measured(self._distances, self._problem, touching, pad)
        free, usable = found.usable(None), found.usable(pad)
        reached = found.gap < GAP
        counts = self.counts
        counts["tried"] += len(found)
        counts["unreached"] += int((~reached).sum())
        counts["colliding"] += int((reached & ~free).sum())
        counts["off their pads"] += int((free & ~usable).sum())
        counts["usable"] += int(usable.sum())
        self._remember(found, pad)
        return found[np.flatnonzero(usable)]

    def _remember(self, found: Candidates, pad: float | None) -> None:
        lacks = _PER_METRE * (found.gap + found.overlap + found.own_overlap)
        if pad is not None:
            lacks += _PER_COSINE * np.maximum(pad - found.facing, 0)
        self._nearly += zip(lacks.tolist(), found.poses.driven, strict=True)
        self._nearly.sort(key=lambda pair: pair[0])
        del self._nearly[_NEARLY:]


def _listed(reasons: list[tuple[int, str]]) -> str:
    return ", ".join(f"{count} {reason}" for count, reason in reasons if count) or "none failed"
