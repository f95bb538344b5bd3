"""Least sums within the limits of contacts that exert general extreme forces, beside HiGHS.

Polytopes of any shape, and those of torque limits; wrenches within the limits, at them and beyond.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from benches.trust.row import Row
from scipy.optimize import linprog

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

PROVEN = 1e-9
"""Largest gap that counts as proven."""

AGREE = 1e-6
"""Relative difference from HiGHS, whose wrench may need the limits up to their tolerance."""


def grasps(count: int, seed: int = 21) -> Iterator[tuple[np.random.Generator, gf.Grasp]]:
    """Yield two to six contacts, scattered or on a ring."""
    rng = np.random.default_rng(seed)
    for turn in range(count):
        contacts = int(rng.integers(2, 7))
        angles = 2 * np.pi * np.arange(contacts) / contacts
        outward = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(contacts)])
        if turn % 2:
            outward = rng.normal(size=(contacts, 3))
            outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        forces = [_limited(rng) if turn % 3 else _any(rng) for _ in range(contacts)]
        yield rng, gf.Grasp(outward, -outward, extreme_forces=forces)


def _limited(rng: np.random.Generator) -> np.ndarray:
    """Make the forces of a finger within its torque limits."""
    jacobian = 0.3 * rng.normal(size=(3, int(rng.integers(2, 5))))
    limits = rng.uniform(0.1, 0.5, jacobian.shape[1])
    return gf.torque_limited_forces(jacobian, limits, float(rng.uniform(0.2, 0.9)), 3.0)


def _any(rng: np.random.Generator) -> np.ndarray:
    """Make forces on a cone, of any lengths."""
    count = int(rng.integers(4, 9))
    angles = 2 * np.pi * np.arange(count) / count
    edges = np.column_stack([np.ones(count), 0.6 * np.cos(angles), 0.6 * np.sin(angles)])
    return edges * rng.uniform(0.2, 3.0, (count, 1))


def least_sum(grasp: gf.Grasp, exerted: np.ndarray) -> float | None:
    """Ask HiGHS for the least sum of coefficients within the limits; None where it finds none."""
    owners = np.repeat(np.arange(grasp.num_contacts), grasp.num_edges)
    limits = (owners == np.arange(grasp.num_contacts)[:, None]).astype(float)
    exact = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    found = linprog(
        np.ones(len(owners)),
        A_ub=limits,
        b_ub=np.full(grasp.num_contacts, 1 + 1e-9),
        A_eq=grasp.primitive_wrenches.T,
        b_eq=exerted,
        options=exact,
    )
    return float(found.fun) if found.status == 0 else None


def rows(share: float) -> list[Row]:
    """Count sums that are not proven as missed."""
    asked = missed = wrong = unanswered = 0
    for rng, grasp in grasps(max(10, round(share * 500))):
        distributor = gf.ForceDistributor(grasp, "sum")
        for size in (0.3, 1.0, 10.0):
            external = size * rng.normal(size=6)
            found = distributor.nearest(external)
            theirs = least_sum(grasp, found.residual - external)
            asked += 1
            missed += not found.gap <= PROVEN
            unanswered += theirs is None
            wrong += not found.sigma_max <= 1 + 2e-9
            wrong += theirs is not None and abs(found.sigma_sum - theirs) > AGREE * max(theirs, 1e-6)
    family = f"least sums of general extreme forces within limits ({unanswered} without HiGHS's answer)"
    return [Row(family, asked, "HiGHS", missed, wrong)]
