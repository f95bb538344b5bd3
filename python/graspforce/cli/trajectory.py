"""Least forces along a sequence of external wrenches, as the command line reports them."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.to_dict import ReadOnly
from graspforce.errors import InfeasibleWrenchError
from graspforce.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from graspforce._core import ForceDistributor, ForceSolution
    from graspforce.files import WrenchFile

_REPORT_EVERY = 4096


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory(ReadOnly):
    """Forces (T, m, k), their normalised maxima and sums (T,), and the residual (T, d) with its norm (T,).

    NaN in rows without an answer.
    """

    wrenches: NDArray[np.float64]
    times: NDArray[np.float64] | None
    forces: NDArray[np.float64]
    sigma_max: NDArray[np.float64]
    sigma_sum: NDArray[np.float64]
    residual: NDArray[np.float64]
    distance: NDArray[np.float64]
    balanced: NDArray[np.bool_]

    @property
    def infeasible(self) -> NDArray[np.bool_]:
        """(T,) rows that no forces balance."""
        return np.isnan(self.sigma_max)

    @property
    def within_limits(self) -> NDArray[np.bool_]:
        """(T,) rows whose forces stay within the limits, as of `ForceSolution.within_limits`."""
        return self.sigma_max <= 1 + 1e-9

    @classmethod
    def of_one(cls, wrench: NDArray[np.float64], solution: ForceSolution) -> Trajectory:
        """Return the forces against a single wrench."""
        sigma_max, sigma_sum = np.array([solution.sigma_max]), np.array([solution.sigma_sum])
        residual, distance = solution.residual[None], np.array([solution.distance])
        balanced = np.array([solution.balanced])
        forces = solution.forces[None]
        return cls(wrench[None], None, forces, sigma_max, sigma_sum, residual, distance, balanced)

    def arrays(self) -> dict[str, Any]:
        """Everything by name, as the NPZ file holds it."""
        named = {
            "wrenches": self.wrenches,
            "forces": self.forces,
            "sigma_max": self.sigma_max,
            "sigma_sum": self.sigma_sum,
            "residual": self.residual,
        }
        return named if self.times is None else {"times": self.times, **named}

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain lists, None in rows without an answer."""
        return {
            name: [
                None if bad and name not in ("times", "wrenches") else row
                for row, bad in zip(array.tolist(), self.infeasible, strict=True)
            ]
            for name, array in self.arrays().items()
        }


def solve_trajectory(
    distributor: ForceDistributor, given: WrenchFile, done: Callable[[int], None], *, nearest: bool = False
) -> Trajectory:
    """Solve chunk by chunk, saying how many are done; with `nearest` every row has an answer."""
    count, grasp = len(given.wrenches), distributor.grasp
    forces = np.full((count, grasp.num_contacts, grasp.force_dim), np.nan)
    sigma_max, sigma_sum, distance = (np.full(count, np.nan) for _ in range(3))
    residual, balanced = np.full((count, grasp.wrench_dim), np.nan), np.zeros(count, bool)
    for start in range(0, count, _REPORT_EVERY):
        rows = slice(start, start + _REPORT_EVERY)
        wrenches = given.wrenches[rows]
        if nearest:
            batch = distributor.solve_many(wrenches, infeasible="nearest")
        else:
            batch = distributor.solve_many(wrenches)
        forces[rows], sigma_max[rows], sigma_sum[rows] = batch.forces, batch.sigma_max, batch.sigma_sum
        residual[rows], distance[rows], balanced[rows] = batch.residual, batch.distance, batch.balanced
        for row in start + np.flatnonzero(batch.status > Status.INFEASIBLE):
            # Alone it may succeed, or be proven to have no answer; anything else is an error that is named.
            with contextlib.suppress(InfeasibleWrenchError):
                alone = (distributor.nearest if nearest else distributor.solve)(given.wrenches[row])
                forces[row], sigma_max[row], sigma_sum[row] = alone.forces, alone.sigma_max, alone.sigma_sum
                residual[row], distance[row], balanced[row] = alone.residual, alone.distance, alone.balanced
        done(min(count, rows.stop))
    found = (forces, sigma_max, sigma_sum, residual, distance, balanced)
    return Trajectory(given.wrenches, given.times, *found)
