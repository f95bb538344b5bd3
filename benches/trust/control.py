"""Least squares and nearest forces of random hands over true cones, beside Clarabel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import clarabel
import numpy as np
from benches.trust.row import Row
from scipy import sparse

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

AGREE = 1e-6
"""Relative difference of objectives that Clarabel's default tolerance leaves."""


def hands(count: int, seed: int, contacts: int = 4) -> Iterator[tuple[np.random.Generator, gf.Grasp]]:
    """Yield hard fingers with true cones at random points of an ellipsoid."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        outward = rng.normal(size=(contacts, 3))
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        axes = np.array([1, 0.8, 1.3])
        limits = rng.uniform(0.5, 3, contacts)
        yield (
            rng,
            gf.Grasp(outward * axes, -outward / axes, friction=0.6, max_normal_force=limits, edges=None),
        )


def hard_squares(
    grasp: gf.Grasp, external: np.ndarray, *, limits: bool, price: float | None = None, weight: float = 1.0
) -> float | None:
    """Ask Clarabel for the optimal objective of hard fingers with true cones; None where it finds none."""
    m, columns = grasp.num_contacts, grasp.grasp_matrix
    n = 3 * m + (6 if price else 0)
    quadratic = np.r_[np.full(3 * m, weight), np.full(n - 3 * m, price or 0.0)]
    balance = np.hstack([columns, -np.eye(6)[:, : n - 3 * m]])
    rows, right, cones = [balance], [-external], [clarabel.ZeroConeT(6)]
    if limits:
        rows.append(np.eye(n)[: 3 * m : 3])
        right.append(grasp.max_normal_force)
        cones.append(clarabel.NonnegativeConeT(m))
    for i in range(m):
        mu = grasp.friction[i]
        rows.append(-np.diag([mu, 1.0, 1.0]) @ np.eye(n)[3 * i : 3 * i + 3])
        right.append(np.zeros(3))
        cones.append(clarabel.SecondOrderConeT(3))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix(np.diag(quadratic)),
        np.zeros(n),
        sparse.csc_matrix(np.vstack(rows)),
        np.concatenate(right),
        cones,
        settings,
    )
    found = solver.solve()
    return float(found.obj_val) if str(found.status) == "Solved" else None


def squares(count: int) -> Row:
    """Compare objectives, and wrenches that have no answer."""
    asked = missed = wrong = 0
    for rng, grasp in hands(count, 1):
        for limits in (False, True):
            external = rng.normal(size=6) * 0.5
            ours = gf.ForceDistributor(grasp, "squares", limits=limits).solve_many([external])
            theirs = hard_squares(grasp, external, limits=limits)
            asked += 1
            missed += theirs is not None and ours.status[0] != gf.Status.SOLVED
            value = float((ours.forces[0] ** 2).sum() / 2)
            wrong += theirs is not None and abs(value - theirs) > AGREE * theirs
    return Row("least squares over true cones, with and without limits", asked, "Clarabel", missed, wrong)


def nearest(count: int, objective: str) -> Row:
    """Compare distances within the limits."""
    asked = missed = wrong = 0
    for rng, grasp in hands(count, 3):
        external = rng.normal(size=6) * 2
        batch = gf.ForceDistributor(grasp, objective, rtol=1e-6).solve_many([external], infeasible="nearest")
        distance = float(np.linalg.norm(batch.residual[0]))
        theirs = hard_squares(grasp, external, limits=True, price=1.0, weight=1e-7)
        asked += 1
        missed += batch.status[0] != gf.Status.SOLVED
        wrong += theirs is not None and distance > np.sqrt(2 * theirs) + 1e-5
        wrong += bool((batch.forces[0, :, 0] > grasp.max_normal_force * (1 + 2e-6)).any())
    return Row(f"nearest forces of {objective}, wrenches beyond limits", asked, "Clarabel", missed, wrong)


def rows(share: float) -> list[Row]:
    """One row for each question."""
    count = max(8, round(share * 1000))
    return [squares(count), *(nearest(count, objective) for objective in ("max", "sum", "squares"))]
