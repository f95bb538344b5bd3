"""One answer for a wrench, whatever was solved before: the least squares on the optimal face.

Symmetric grasps leave a polytope of optimal forces. The oracle finds it by linear programs of HiGHS and
complementary slackness. Its point of least norm comes from the least-distance program of Lawson and Hanson
(chapter 23) with SciPy's NNLS.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from benches.trust.row import Row
from numpy.typing import NDArray
from scipy.optimize import linprog, nnls

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

Array = NDArray[np.float64]

ZERO = 1e-8
"""Reduced costs and multipliers above this are not zero."""

AGREE = 1e-6
"""Relative difference of forces that agree."""

TIGHT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}

DIRECTIONS = np.array([(3, 4), (4, 3), (5, 0), (0, 5), (7 / 5, 24 / 5)]) / 5.0


@dataclass
class Case:
    """A grasp, what is minimised, and a wrench with wrenches to be solved before it."""

    grasp: gf.Grasp
    objective: str
    wrench: Array
    past: list[Array]
    options: dict[str, Any] = field(default_factory=dict)


def cases(kind: str, count: int, seed: int = 0) -> Iterator[Case]:
    """Yield cases of a kind: "max", "sum" or "weighted", with " and bounds" after it for lower bounds."""
    rng = np.random.default_rng([seed, len(kind), ord(kind[0])])
    objective = kind.split(maxsplit=1)[0]
    for _ in range(count):
        grasp = symmetric_planar(rng) if rng.uniform() < 0.5 else symmetric_spatial(rng)
        options: dict[str, Any] = {}
        bounds = np.zeros(grasp.num_contacts)
        if objective == "weighted":
            options["weight"] = float(rng.choice([0.1, 0.5, 1.0, 2.0, 10.0]))
        if kind.endswith("bounds"):
            bounds = rng.choice([0.0, 0.25, 0.5], grasp.num_contacts)
            bounds[rng.integers(len(bounds))] = 0.5
            options["min_normal"] = bounds
        past = [symmetric_wrench(rng, grasp, bounds) for _ in range(6)]
        yield Case(grasp, "sum" if objective == "sum" else "max", past.pop(), past, options)


def symmetric_planar(rng: np.random.Generator) -> gf.Grasp:
    """Return contacts on a unit circle in rational directions or at the corners of a regular polygon."""
    count = int(rng.integers(3, 7))
    if rng.uniform() < 0.5:
        turns = np.concatenate(
            [DIRECTIONS @ [[c, s], [-s, c]] for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        )
        outward = np.unique(np.round(turns, 12) + 0.0, axis=0)
        outward = outward[rng.choice(len(outward), count, replace=False)]
        # Mirror images of the first contacts about the origin or an axis.
        for k in range(1, count, 2):
            outward[k] = outward[k - 1] * [(-1, -1), (-1, 1), (1, -1)][rng.integers(3)]
        outward = outward[np.sort(np.unique(outward, axis=0, return_index=True)[1])]
    else:
        angles = 2 * np.pi * np.arange(count) / count
        outward = np.column_stack([np.cos(angles), np.sin(angles)])
    friction = rng.choice([0.25, 0.5, 0.75, 1.0])
    limits = np.ones(len(outward)) * rng.choice([1.0, 4.0])
    return gf.Grasp(outward, -outward, friction=friction, max_normal_force=limits)


def symmetric_spatial(rng: np.random.Generator) -> gf.Grasp:
    """Return contacts at the corners of a square, a tetrahedron, an octahedron, a prism or a cube."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    corners = np.array(list(itertools.product([-1.0, 1.0], repeat=3))) / np.sqrt(3)
    angles = 2 * np.pi * np.arange(3) / 3
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    up = np.array([0, 0, 0.75])
    outward = [
        axes[[0, 1, 3, 4]],
        corners[[0, 3, 5, 6]],
        axes,
        np.vstack([ring + up, ring - up]) * 0.8,
        corners,
    ][rng.integers(5)]
    friction = rng.choice([0.5, 0.75, 1.0])
    torsion = float(rng.choice([0.0, 0.0, 0.05]))
    edges = int(rng.choice([3, 4, 6, 8])) if torsion == 0 else int(rng.choice([3, 4]))
    return gf.Grasp(outward, -outward, friction=friction, torsion=torsion, edges=edges)


def symmetric_wrench(rng: np.random.Generator, grasp: gf.Grasp, bounds: Array) -> Array:
    """Return a wrench on a symmetric direction, or the opposite of coarse multiples of extreme forces."""
    dim = grasp.wrench_dim
    if rng.uniform() < 0.5:
        wrench = rng.integers(-2, 3, dim).astype(float)
        wrench[dim // 2 + (dim == 3) :] *= rng.choice([0.0, 0.25])
        if wrench.any():
            return wrench * rng.choice([1.0, 0.5, 3.0])
    shares = rng.integers(0, 4, len(grasp.primitive_wrenches)) * (
        rng.uniform(size=len(grasp.primitive_wrenches)) < 0.3
    )
    wrench = -(0.5 * shares) @ grasp.primitive_wrenches
    for i, bound in enumerate(bounds):
        wrench -= bound * grasp.primitive_wrenches[owners(grasp) == i][0]
    return np.asarray(wrench)


def owners(grasp: gf.Grasp) -> NDArray[np.int64]:
    """Return the contact of each extreme force."""
    return np.repeat(np.arange(grasp.num_contacts), grasp.num_edges)


def least_squares_forces(case: Case) -> Array | None:
    """Return the (m, k) least-squares forces on the optimal face, None if nothing balances.

    An `ArithmeticError` says that the oracle itself did not succeed.
    """
    program = Program.of(case)
    for cost in program.costs:
        if not program.minimise(cost):
            return None
    x = program.least_norm()
    forces = (program.forces @ x[:-1]).reshape(case.grasp.num_contacts, -1)
    return np.asarray(forces * program.limits[:, None])


@dataclass
class Program:
    """Forces as coefficients `x` of extreme forces, then the largest share: `E x = d`, `C x >= c`."""

    equations: Array
    right: Array
    rows: Array
    bounds: Array
    forces: Array
    limits: Array
    costs: list[Array]

    @classmethod
    def of(cls, case: Case) -> Program:
        """Write down the program of a case."""
        grasp = case.grasp
        W, F = grasp.primitive_wrenches, grasp.extreme_forces
        m, n, k = grasp.num_contacts, len(W), grasp.force_dim
        shares = (owners(grasp) == np.arange(m)[:, None]).astype(float)
        limits = grasp.max_normal_force * np.ones(m)
        forces = np.zeros((m * k, n))
        for j, i in enumerate(owners(grasp)):
            forces[k * i : k * (i + 1), j] = F[j] / limits[i]
        last = np.ones((m, 1))
        rows = np.vstack([np.eye(n + 1), np.hstack([-shares, last]), np.hstack([shares, 0 * last])])
        least = np.broadcast_to(case.options.get("min_normal", 0.0), m)
        total, largest = np.append(np.ones(n), 0.0), np.append(np.zeros(n), 1.0)
        weight = case.options.get("weight", 0.0)
        costs = [total] if case.objective == "sum" else [largest + weight * total]
        if case.objective == "max" and weight == 0.0:
            costs.append(total)
        return cls(
            np.hstack([W.T, np.zeros((len(W.T), 1))]),
            -case.wrench,
            rows,
            np.concatenate([np.zeros(n + 1 + m), least]),
            forces,
            limits,
            costs,
        )

    def minimise(self, cost: Array) -> bool:
        """Restrict the program to the optimal face of a cost; False if it is infeasible."""
        result = linprog(
            cost,
            A_eq=self.equations,
            b_eq=self.right,
            A_ub=-self.rows,
            b_ub=-self.bounds,
            bounds=(None, None),
            options=TIGHT,
        )
        if result.status == 2:
            return False
        if result.status != 0:
            raise ArithmeticError(result.message)
        tight = result.ineqlin.marginals < -ZERO
        self.equations = np.vstack([self.equations, self.rows[tight]])
        self.right = np.concatenate([self.right, self.bounds[tight]])
        self.rows, self.bounds = self.rows[~tight], self.bounds[~tight]
        return True

    def least_norm(self) -> Array:
        """Minimise the norm of the forces, and the more weakly of the coefficients, over what is left."""
        u, sizes, vt = np.linalg.svd(self.equations)
        rank = int((sizes > 1e-10 * sizes[0]).sum())
        particular = vt[:rank].T @ ((u[:, :rank].T @ self.right) / sizes[:rank])
        if np.abs(self.equations @ particular - self.right).max() > 1e-7 * (1 + np.abs(particular).max()):
            raise ArithmeticError("the equations of the face contradict each other")
        null = vt[rank:].T
        if not null.shape[1]:
            return np.asarray(particular)
        # Coefficients that make the same forces: any of them will do.
        objective = np.vstack(
            [np.hstack([self.forces, np.zeros((len(self.forces), 1))]), 1e-5 * np.eye(len(particular))]
        )
        q, r = np.linalg.qr(objective @ null)
        spread = null @ np.linalg.inv(r)
        center = particular - spread @ (q.T @ (objective @ particular))
        # A face without interior must not look empty for rounding.
        loosened = self.bounds - 1e-11 * (1 + np.abs(center).max())
        gradients, distances = self.rows @ spread, loosened - self.rows @ center
        lengths = np.linalg.norm(gradients, axis=1)
        moved = lengths > 1e-9 * lengths.max(initial=1.0)
        gradients, distances = gradients[moved] / lengths[moved, None], distances[moved] / lengths[moved]
        size = max(distances.max(initial=0.0), 1e-300)
        if size < 1e-12 * (1 + np.abs(center).max()):
            return np.asarray(center)
        stacked = np.vstack([gradients.T, distances / size])
        target = np.append(np.zeros(gradients.shape[1]), 1.0)
        dual, _ = nnls(stacked, target, maxiter=100 * stacked.shape[1])
        residual = stacked @ dual - target
        if residual[-1] > -1e-13:
            raise ArithmeticError("the face looks empty")
        t = -size * residual[:-1] / residual[-1]
        # Once more on the active constraints alone, free of what the division left.
        active = dual > 1e-10 * dual.max()
        polished = np.linalg.lstsq(gradients[active], distances[active], rcond=1e-11)[0]
        if (gradients @ polished - distances).min() > -1e-9 * (1 + np.abs(polished).max()):
            t = polished
        return np.asarray(center + spread @ t)


def answers(case: Case) -> list[Array | None]:
    """Return the forces after four pasts: none, others, and wrenches on the way; None for an error."""
    near = [case.wrench + share * (case.past[0] - case.wrench) for share in (0.3, 0.05, 1e-4)]
    pasts: list[list[Array]] = [[], case.past, case.past[::-1], near]
    found: list[Array | None] = []
    for past in pasts:
        distributor = gf.ForceDistributor(case.grasp, case.objective, **case.options)
        for wrench in [*past, case.wrench]:
            try:
                forces: Array | None = distributor.solve(wrench).forces
            except gf.GraspForceError:
                forces = None
        found.append(forces)
    return found


def rows(share: float) -> list[Row]:
    """Compare every objective, with lower bounds and without, on `400 * share` cases each."""
    return [row(kind, max(1, round(400 * share))) for kind in KINDS]


KINDS = ("max", "sum", "weighted", "max and bounds", "sum and bounds", "weighted and bounds")


def row(kind: str, count: int) -> Row:
    """Count what differs from the least squares on the optimal face, from any past."""
    missed = wrong = compared = 0
    for case in cases(kind, count):
        expected = least_squares_forces(case)
        if expected is None:
            continue
        compared += 1
        found = answers(case)
        missed += any(forces is None for forces in found)
        largest = max(np.abs(expected).max(), 1e-300)
        wrong += any(
            forces is not None and np.abs(forces - expected).max() > AGREE * largest for forces in found
        )
    family = f"symmetric grasps, {kind}: least squares on the optimal face, from 4 pasts"
    return Row(family, compared, "HiGHS and NNLS", missed, wrong)
