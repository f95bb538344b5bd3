"""Sizes that a search is measured against: the longest wrench, and how fast parameters move contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.vectors import unit

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp
    from graspforce.typing import Criterion

    from .candidates import CandidateSource

    Array = NDArray[np.float64]

__all__ = ["longest_wrench", "parameter_rates"]


def longest_wrench(grasp: Grasp, metric: ArrayLike | None) -> float:
    """Return the norm of the longest wrench that a normal force at its limit exerts."""
    wrenches = grasp.grasp_matrix[:, :: grasp.force_dim] * grasp.max_normal_force
    if metric is None:
        num_forces = grasp.positions.shape[1]
        wrenches[num_forces:] /= grasp.length_scale
        return float(np.linalg.norm(wrenches, axis=0).max())
    return float(np.sqrt((wrenches * (np.asarray(metric, dtype=np.float64) @ wrenches)).sum(axis=0)).max())


def force_ceiling(grasp: Grasp, metric: ArrayLike | None, criterion: Criterion) -> float:
    """Return what no epsilon of contacts with these limits exceeds: the largest force without a torque."""
    forces = grasp.max_normal_force * np.hypot(1, grasp.friction)
    ceiling = float(forces.max() if criterion == "sum" else forces.sum())
    return ceiling if metric is None and np.isfinite(ceiling) else np.inf


def parameter_rates(source: CandidateSource, lower: Array, upper: Array) -> Array:
    """Return how much contacts move and turn by each parameter (p,): only the order of cuts depends on it."""
    width = upper - lower
    # Uneven, and along three lines: two places would be the same one of a periodic or an even parameter.
    shares = (1 - np.cos(np.linspace(0, np.pi, 10))) / 2
    rates = np.zeros(len(lower))
    for axis in range(len(lower)):
        lines = np.repeat(lower + np.outer([0.21, 0.5, 0.83], width), len(shares), axis=0)
        lines[:, axis] = lower[axis] + np.tile(shares, 3) * width[axis]
        # Rounding must not carry the last of them over the bounds, where the surface may end.
        contacts = source.contacts(np.clip(lines, lower, upper))
        positions = contacts["positions"]
        size = max(float(np.ptp(positions, axis=(0, 1)).max()), np.finfo(float).tiny)
        ends = np.concatenate([positions / size, unit(contacts["normals"])], axis=-1)
        changes = np.diff(ends.reshape(3, len(shares), -1), axis=1)
        way = float(np.linalg.norm(changes, axis=-1).sum())
        rates[axis] = way / max(width[axis], np.finfo(float).tiny)
    rates += 1e-3 * rates.max()
    return rates
