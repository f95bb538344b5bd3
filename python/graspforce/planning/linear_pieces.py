"""The step that is best for all linear pieces of a function that is their minimum.

The proximal bundle method (Kiwiel, 1985) maximises ``min_j (gap_j + g_j . h) - |h|^2 / (2 t)`` over the step
``h``, where piece j is ``gap_j`` above the function and has the slopes ``g_j``. The step is ``t d``. Among
pieces without gaps ``d`` is the shortest vector in the hull of their slopes. If it vanishes, the point is
stationary.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce.errors import NotConvergedError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]

_LIFT, _HEAVY = 30.0, 1e4


@dataclass(frozen=True, slots=True)
class LinearPieces:
    """Linear pieces at a point: gaps (n,), which are not negative, and slopes (n, p)."""

    gaps: Array
    slopes: Array

    def near(self, reach: float) -> LinearPieces:
        """Return the pieces that steps of this length can close, without their gaps."""
        rows = self.gaps <= self.gaps.min() + 2 * reach * self.steepest
        return LinearPieces(np.zeros(rows.sum()), self.slopes[rows])

    def rows(self, chosen: Flags) -> LinearPieces:
        """Return some of the pieces."""
        return LinearPieces(self.gaps[chosen], self.slopes[chosen])

    def with_others(self, others: LinearPieces) -> LinearPieces:
        """Return these pieces and others."""
        gaps, slopes = [self.gaps, others.gaps], [self.slopes, others.slopes]
        return LinearPieces(np.concatenate(gaps), np.concatenate(slopes))

    def is_like(self, others: LinearPieces, share: float) -> bool:
        """Return whether the slopes of as many other pieces differ by less than a share of the longest."""
        return bool(np.abs(self.slopes - others.slopes).max() <= share * others.steepest)

    def least(self, moves: Array, free: NDArray[np.int64]) -> Array:
        """Return how much the function rises (n,) by moves (n, p) of some of the parameters."""
        return np.asarray((self.gaps + moves @ self.slopes[:, free].T).min(axis=1))

    @property
    def steepest(self) -> float:
        """Length of the longest slopes."""
        return float(np.sqrt((self.slopes * self.slopes).sum(axis=1).max()))

    def directions(
        self,
        times: Sequence[float],
        at_lower: Flags,
        at_upper: Flags,
        walls: tuple[Array, Array] | None = None,
    ) -> Array:
        """Return the ``d`` (n, p) of the best steps ``time * d`` that leave no bound which is met.

        Neither do they go further against the unit slopes (k, p) of `walls` than their slacks (k,).

        Each minimises ``|d|^2 / 2 + gap / time`` over the hull of the pieces and over multipliers of the
        bounds and walls. That is a nonnegative least squares problem once the sum of the weights is a heavy
        equation. The gap is one more coordinate, so far from its target that the square is linear.
        """
        nnls = optional("scipy.optimize", "search").nnls
        size, identity = len(at_lower), np.eye(len(at_lower))
        # At a lower bound a negative slope is no way to go: its multiplier takes it away; upper ones
        # likewise, and walls.
        outward, slacks = np.concatenate([identity[at_lower], -identity[at_upper]]), np.zeros(0)
        if walls is not None:
            outward, slacks = np.concatenate([outward, walls[0]]), walls[1]
        scale = max(self.steepest, 1e-150)
        # What all are above the function changes nothing.
        gaps, count = (self.gaps - self.gaps.min()) / scale, len(self.gaps)
        met = np.zeros(len(outward) - len(slacks))
        # Of each piece and multiplier: its part of the direction, how far away it is, and of the sum.
        columns = np.zeros((size + 2, count + len(outward)))
        columns[:size] = np.concatenate([self.slopes / scale, outward]).T
        columns[size + 1, :count] = _HEAVY
        with np.errstate(over="ignore"):  # where nothing slopes
            away = np.concatenate([gaps, met, slacks]) / scale
        target = np.zeros(size + 2)
        target[size:] = -_LIFT, _HEAVY
        found = np.zeros((len(times), size))
        for direction, time in zip(found, times, strict=True):
            # No step of this time closes larger gaps, or meets walls further away.
            near = away <= 2 * time
            columns[size] = away / (time * _LIFT)
            try:
                weights, _ = nnls(columns[:, near], target)
            except RuntimeError as error:
                raise NotConvergedError(
                    f"the shortest vector in the hull of the gradients: {error}"
                ) from error
            total = weights[: np.count_nonzero(near[:count])].sum()
            direction[:] = columns[:size, near] @ weights * (scale / total)
        return found

    def direction(self, time: float, at_lower: Flags, at_upper: Flags) -> Array:
        """Return the one of `directions` for this time."""
        return np.asarray(self.directions([time], at_lower, at_upper)[0])
