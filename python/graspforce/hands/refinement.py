"""Better grasps near those found: random moves of palm and fingers, put back onto the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .candidates import Candidates, measured
from .snap import SnapOptions, snap

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from .distances import Distances
    from .grasp_problem import GraspProblem

    Array = NDArray[np.float64]


_PALM = 0.005, 0.08  # m and rad: standard deviations of a move at the first step size
_JOINT = 0.08  # rad
_STEPS = 6


def refined(
    distances: Distances, problem: GraspProblem, found: Candidates, rng: np.random.Generator, *, rounds: int,
    moves: int, pad: float | None, ended: Callable[[], bool],
) -> Candidates:  # fmt: skip
    """Return each candidate, or the best grasp that random moves from it reached.

    In each round `moves` neighbours of every candidate are tried, half of them with one finger moved alone.
    The sizes of the moves grow where one is better and shrink where none is.
    """
    kinematics = distances.kinematics
    count, size = len(found), kinematics.size
    step = np.ones(count)
    fingers = kinematics.moves[kinematics.tip_bodies] @ (kinematics.hand.coupling != 0)
    deviations = np.repeat([*_PALM, _JOINT], [3, 3, size - 6])
    options = SnapOptions(steps=_STEPS, posture=0.0, pad=pad)
    for _ in range(rounds):
        if ended():
            break
        parents = np.repeat(np.arange(count), moves)
        change = rng.normal(size=(len(parents), size)) * deviations * step[parents, None]
        alone = np.flatnonzero(rng.random(len(parents)) < 0.5)
        change[alone, :6] = 0
        change[alone, 6:] *= fingers[rng.integers(len(fingers), size=len(alone))] > 0
        moved = found.poses[parents].moved(change, kinematics.hand.driven_limits)
        tried = measured(distances, problem, snap(distances, moved, options), pad)
        scores = tried.score.reshape(count, moves)
        best = scores.argmax(axis=1)
        better = scores[np.arange(count), best] > found.score
        winners = np.flatnonzero(better) * moves + best[better]
        both = Candidates.joined([found, tried])
        rows = np.arange(count)
        rows[better] = count + winners
        found = both[rows]
        step = np.where(better, np.minimum(step * 1.3, 3.0), np.maximum(step * 0.7, 0.1))
    return found
