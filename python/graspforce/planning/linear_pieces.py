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

    @property
    def steepest(self) -> float:
        """Length of the longest slopes."""
        return float(np.linalg.norm(self.slopes, axis=1).max())

    def direction(
        self, time: float, at_lower: Flags, at_upper: Flags, walls: tuple[Array, Array] | None = None
    ) -> Array:
        """Return the ``d`` (p,) of the best step ``time * d`` that leaves no bound which is met.

        Neither does it go further against the unit slopes (k, p) of `walls` than their slacks (k,).

        It minimises ``|d|^2 / 2 + gap / time`` over the hull of the pieces and over multipliers of the
        bounds. That is a nonnegative least squares problem once the sum of the weights is a heavy equation.
        The gap is one more coordinate, so far from its target that the square is linear.
        """
        optimize = optional("scipy.optimize", "search")
        identity = np.eye(len(at_lower))
        # At a lower bound a negative slope is no way to go: its multiplier takes it away; upper ones
        # likewise.
        outward = np.concatenate([identity[at_lower], -identity[at_upper]])
        scale = max(self.steepest, 1e-150)
        unit_gap = time * scale**2
        # What all are above the function changes nothing.
        gaps = self.gaps - self.gaps.min()
        # No step of this time closes larger gaps.
        rows = gaps <= 2 * unit_gap
        slopes = self.slopes[rows]
        none = np.zeros(len(outward))
        if walls is not None:
            near = walls[1] <= 2 * time * scale
            outward = np.concatenate([outward, walls[0][near]])
            none = np.concatenate([none, walls[1][near] / (time * scale * _LIFT)])
        lifted = np.concatenate([gaps[rows] / (unit_gap * _LIFT), none])
        sums = np.concatenate([np.full(len(slopes), _HEAVY), 0.0 * none])
        columns = np.vstack([np.concatenate([slopes / scale, outward]).T, lifted, sums])
        target = np.concatenate([np.zeros(len(at_lower)), [-_LIFT, _HEAVY]])
        try:
            weights, _ = optimize.nnls(columns, target)
        except RuntimeError as error:
            raise NotConvergedError(f"the shortest vector in the hull of the gradients: {error}") from error
        shares = weights[: len(slopes)] / weights[: len(slopes)].sum()
        direction = shares @ slopes
        if walls is not None:
            count = int(near.sum())
            multipliers = weights[len(weights) - count :] * (scale / weights[: len(slopes)].sum())
            direction += multipliers @ walls[0][near]
        direction[at_lower] = np.maximum(direction[at_lower], 0.0)
        direction[at_upper] = np.minimum(direction[at_upper], 0.0)
        return np.asarray(direction)
