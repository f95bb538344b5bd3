"""Least squares beside a price of the residual, from 1e-8 to 1e12: every wrench has an answer.

The oracle is the condition of optimality itself: the multiplier is the price of the residual, and each force
is the one of its set that reaches furthest along what the multiplier leaves of it.
"""

from __future__ import annotations

import itertools

import numpy as np
from benches.trust.nearest import grasps, half_beyond
from benches.trust.row import Row

import graspforce as gf

GRASPS, WRENCHES = 2000, 10

OPTIMAL = 1e-8
"""Largest gap relative to its terms, and largest difference of the residuals relative to the wrench."""


def furthest(grasp: gf.Grasp, pulls: np.ndarray) -> np.ndarray:
    """Return how far a force of share one reaches along the pull on each contact, (m,)."""
    if (grasp.num_edges > 0).all():
        ends = np.cumsum(grasp.num_edges)[:-1]
        each = np.split(grasp.extreme_forces.reshape(-1, grasp.force_dim), ends)
        return np.array([(forces @ pull).max() for forces, pull in zip(each, pulls, strict=True)])
    slope = (grasp.friction * np.linalg.norm(pulls[:, 1:3], axis=1)) ** 2
    if grasp.force_dim == 4:
        slope += (grasp.torsion * pulls[:, 3]) ** 2
    return (pulls[:, 0] + np.sqrt(slope)) * grasp.max_normal_force


def optimal(grasp: gf.Grasp, found: gf.ForceSolution, price: float, low: float, *, limits: bool) -> bool:
    """Whether forces and multiplier prove each other."""
    m, k = grasp.num_contacts, grasp.force_dim
    pull = (grasp.grasp_matrix.T @ found.dual).reshape(m, k)
    if k == 4:
        pull[grasp.torsion == 0, 3] = 0.0
    left = pull - found.forces
    reach = furthest(grasp, left)
    # The objective is concave: what is furthest among forces up to twice as strong is so among all.
    near = 2.0 * np.maximum(found.shares, low) + np.maximum(reach, 0.0)
    high = np.minimum(near, 1.0) if limits else near
    gap = np.where(reach > 0, high, low) * reach - (left * found.forces).sum(axis=1)
    terms = np.abs(grasp.grasp_matrix).T @ np.abs(found.dual)
    size = (terms.reshape(m, k) * np.abs(found.forces)).sum() + (found.forces**2).sum()
    apart = np.linalg.norm(found.residual + found.dual / price)
    whole = np.linalg.norm(found.external_wrench) + np.linalg.norm(found.residual)
    pressing = 1e-6 * np.linalg.norm(found.forces)
    kept = (found.shares >= low - 1e-9).all() and (not limits or found.within_limits)
    return bool(kept and abs(gap.sum()) <= OPTIMAL * size and apart <= OPTIMAL * (whole + pressing))


def rows(share: float) -> list[Row]:
    """Return one row."""
    count = max(15, round(share * GRASPS))
    asked = missed = wrong = 0
    for turn, (rng, grasp) in enumerate(itertools.islice(grasps(count, 17), count)):
        price, limits = 10.0 ** rng.uniform(-8, 12), bool(turn % 3)
        low = 0.2 if turn % 4 == 0 else 0.0
        options = {"min_normal": low} if low else {}
        distributor = gf.ForceDistributor(grasp, "squares", slack=price, limits=limits, **options)
        for external in half_beyond(rng, grasp, WRENCHES) * 10.0 ** rng.uniform(-2, 2):
            asked += 1
            try:
                found = distributor.solve(external)
            except gf.GraspForceError:
                missed += 1
                continue
            wrong += not optimal(grasp, found, price, low, limits=limits)
    family = "least squares with a price of 1e-8 to 1e12 of the residual"
    return [Row(family, asked, "conditions of optimality", missed, wrong)]
