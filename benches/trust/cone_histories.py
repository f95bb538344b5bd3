"""Forces over true cones depend on the wrench alone: least objective, least sum, least norm, from any past.

The oracle is Clarabel: the objective, then the least sum at that objective, then the least norm at both. Each
level is loosened a little, so that the sum and the norm of the oracle are lower bounds. On curved cones they
are low by the square root of that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import clarabel
import numpy as np
from benches.trust.row import Row
from scipy import sparse

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LOOSENED = 1e-9
"""How far above the least a level may be for the next one, relative to it."""

LOWERED = 2e-3
"""Relative distance of the bounds from the sum and the norm: some square roots of `LOOSENED`."""

AGREE = 1e-9
"""Relative difference of forces that are the same."""


def grasps(count: int, seed: int = 0) -> Iterator[tuple[gf.Grasp, bool]]:
    """Yield random grasps, symmetric ones, and feet on a plane; True for feet."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        torsion = float(rng.choice([0.0, 0.1]))
        friction = float(rng.choice([0.4, 0.6, 0.9]))
        kind = k % 3
        if kind == 0:
            outward = rng.normal(size=(int(rng.integers(3, 8)), 3))
            outward /= np.linalg.norm(outward, axis=1)[:, None]
            limits = rng.uniform(0.5, 3.0, len(outward))
        elif kind == 1:
            outward = symmetric(rng)
            limits = np.ones(len(outward))
        else:
            angles = 2 * np.pi * np.arange(int(rng.integers(3, 7))) / 6
            feet = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
            normals = np.tile([0.0, 0.0, 1.0], (len(feet), 1))
            yield gf.Grasp(feet, normals, friction=friction, torsion=torsion, edges=None), True
            continue
        yield (
            gf.Grasp(
                outward * [1.0, 0.8, 1.2] if kind == 0 else outward,
                -outward,
                friction=friction,
                torsion=torsion,
                max_normal_force=limits,
                edges=None,
            ),
            False,
        )


def symmetric(rng: np.random.Generator) -> Array:
    """Return the corners of a square, a tetrahedron, an octahedron or a cube."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    signs = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)]) / np.sqrt(3)
    return [axes[[0, 1, 3, 4]], signs[[0, 3, 5, 6]], axes, signs][rng.integers(4)]


def wrenches(rng: np.random.Generator, feet: bool) -> list[Array]:
    """Return a wrench to be solved and others before it; feet carry a weight within their support."""
    if not feet:
        return [rng.uniform(-1, 1, 6) for _ in range(4)]
    found = []
    for _ in range(4):
        push, arm = rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.3, 0.3, 2)
        found.append(-np.array([push[0], push[1], 1.0, arm[1], -arm[0], 0.0]))
    return found


def answers(
    grasp: gf.Grasp, objective: str, wrench: Array, past: list[Array]
) -> list[gf.ForceSolution | None]:
    """Return the solution after none, after others, and after wrenches on the way; None for an error."""
    near = [wrench + share * (past[0] - wrench) for share in (0.3, 0.05, 1e-3, 1e-5)]
    found: list[gf.ForceSolution | None] = []
    for before in ([], past, near):
        distributor = gf.ForceDistributor(grasp, objective)
        solved: gf.ForceSolution | None = None
        for w in [*before, wrench]:
            try:
                solved = distributor.solve(w)
            except gf.GraspForceError:
                solved = None
        found.append(solved)
    return found


def least_levels(grasp: gf.Grasp, objective: str, wrench: Array) -> tuple[float, float, float] | None:
    """Return the least objective, the least sum at it, and the least squared norm at both, by Clarabel."""
    m, k = grasp.num_contacts, grasp.force_dim
    limits = np.broadcast_to(grasp.max_normal_force, m)
    n = m * k + 1
    last = np.zeros(n)
    last[-1] = 1.0
    total = np.zeros(n)
    total[:-1:k] = 1.0 / limits
    rows = [np.hstack([grasp.grasp_matrix, np.zeros((6, 1))])]
    right = [-wrench]
    ones: list[Array] = []
    for i in range(m):
        row = last.copy()
        row[k * i] = -1.0 / limits[i]
        ones.append(-row)
    blocks = []
    for i in range(m):
        block = np.zeros((k, n))
        scales = [1.0, 1 / grasp.friction[i], 1 / grasp.friction[i], 1 / max(grasp.torsion[i], 1e-300)][:k]
        for j in range(k):
            block[j, k * i + j] = -scales[j]
        blocks.append(block)
    quadratic = np.append(np.repeat(1.0 / limits**2, k), 0.0)
    bounds: list[tuple[Array, float]] = []
    levels = []
    costs = [total] if objective == "sum" else [last, total]
    for step in [*costs, None]:
        matrix = np.vstack([*rows, *ones, *[b[0] for b in bounds], *blocks])
        vector = np.concatenate([*right, np.zeros(m), [b[1] for b in bounds], np.zeros(m * k)])
        cones = [
            clarabel.ZeroConeT(6),
            clarabel.NonnegativeConeT(m + len(bounds)),
            *[clarabel.SecondOrderConeT(k)] * m,
        ]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        weight = sparse.diags(2 * quadratic if step is None else 0 * quadratic).tocsc()
        cost = np.zeros(n) if step is None else step
        solved = clarabel.DefaultSolver(
            weight, cost, sparse.csc_matrix(matrix), vector, cones, settings
        ).solve()
        if "Solved" not in str(solved.status):
            return None
        value = float(solved.obj_val)
        levels.append(value)
        if step is not None:
            bounds.append((step, value * (1 + LOOSENED) + 1e-12))
    return levels[0], levels[-2], levels[-1]


def compare(count: int, objective: str, seed: int = 0) -> tuple[int, int, int]:
    """Count wrenches, those not solved, and those solved otherwise after another past or by the oracle."""
    rng = np.random.default_rng([seed, len(objective)])
    asked = missed = wrong = 0
    for grasp, feet in grasps(count, seed):
        wrench, *past = wrenches(rng, feet)
        levels = least_levels(grasp, objective, wrench)
        if levels is None:
            continue
        asked += 1
        found = answers(grasp, objective, wrench, past)
        if any(answer is None for answer in found):
            missed += 1
            continue
        wrong += any(not agree(answer, found[0], levels, objective, grasp) for answer in found)
    return asked, missed, wrong


def agree(
    answer: gf.ForceSolution,
    first: gf.ForceSolution,
    levels: tuple[float, float, float],
    objective: str,
    grasp: gf.Grasp,
) -> bool:
    """Whether an answer equals the first, and is not above the levels by more than these were loosened."""
    largest = np.abs(first.forces).max()
    same = np.abs(answer.forces - first.forces).max() <= AGREE * largest and answer.unique == first.unique
    value = answer.sigma_sum if objective == "sum" else answer.sigma_max
    limits = np.broadcast_to(grasp.max_normal_force, grasp.num_contacts)
    norm = float(((answer.forces / limits[:, None]) ** 2).sum())
    close = (
        abs(value - levels[0]) <= 1e-7 * levels[0]
        and answer.sigma_sum <= levels[1] * (1 + LOWERED)
        and norm <= levels[2] * (1 + LOWERED)
    )
    return bool(same and close)


def rows(share: float) -> list[Row]:
    """Compare both objectives on `600 * share` grasps each."""
    found = []
    for objective in ("max", "sum"):
        asked, missed, wrong = compare(max(1, round(600 * share)), objective)
        family = f"true cones, {objective}: one answer from 3 pasts, by levels"
        found.append(Row(family, asked, "Clarabel", missed, wrong))
    return found
