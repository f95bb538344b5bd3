"""Least forces beside HiGHS and Clarabel, and what decides where they differ.

Forces must balance the wrench within the stated tolerance and lie in their cones. Where the objective
differs from the solver's, the multipliers of the answer are checked in rational arithmetic: they prove the
least objective for the wrench that the forces balance. A wrench that is called infeasible must be separated
by more than the tolerance, in rational arithmetic too.
"""

from __future__ import annotations

from fractions import Fraction

import clarabel
import numpy as np
from scipy import sparse
from scipy.optimize import linprog

import graspforce as gf

TOLERANCE = 1e-9  # FEASIBILITY_TOLERANCE, as docs/forces.md states it
EDGE = 1e-6  # of the tolerance
OBJECTIVE = 1e-7
RTOL = 1e-9  # the default, which gaps keep
LARGEST_OBJECTIVE = 1e5  # forces of a larger objective are lost to rounding, beside a wrench of unit size


def units(grasp) -> np.ndarray:
    """Find the largest force and torque that one contact exerts at its limit, row by row."""
    split = 2 if grasp.wrench_dim == 3 else 3
    mu, limit, torsion = grasp.friction, grasp.max_normal_force, grasp.torsion
    strength = limit * np.hypot(1, mu)
    arms = np.linalg.norm(grasp.positions - grasp.origin, axis=1)
    torque = strength * arms + limit * torsion
    # Where no contact exerts a torque, the unit is one N m.
    return np.array([strength.max()] * split + [torque.max() or 1.0] * (1 if grasp.wrench_dim == 3 else 3))


def wrenches_of(grasp) -> list[np.ndarray]:
    """Split the primitive wrenches of each contact at its limit."""
    return np.split(grasp.primitive_wrenches, np.cumsum(grasp.num_edges)[:-1])


def least_by_highs(contacts: list[np.ndarray], wrench, scale, objective: str) -> float | None:
    """Find the least maximum or sum of shares by HiGHS, in units; None where it finds no forces."""
    columns = np.vstack(contacts).T / scale[:, None]
    b = -np.asarray(wrench) / scale
    size = np.abs(b).max()
    count = columns.shape[1]
    tight = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    for method in ("highs-ds", "highs-ipm"):
        if objective == "sum":
            found = linprog(np.ones(count), A_eq=columns, b_eq=b / size, method=method, options=tight)
        else:
            rows = np.zeros((len(contacts), count + 1))
            start = 0
            for i, each in enumerate(contacts):
                rows[i, start : start + len(each)] = 1
                start += len(each)
            rows[:, -1] = -1
            cost = np.zeros(count + 1)
            cost[-1] = 1
            equations = np.column_stack([columns, np.zeros(len(columns))])
            found = linprog(
                cost,
                A_ub=rows,
                b_ub=np.zeros(len(rows)),
                A_eq=equations,
                b_eq=b / size,
                method=method,
                options=tight,
            )
        if found.status == 0:
            return found.fun * size
        if found.status == 2:
            return None
    return None


def rounding_of(answer, wrench, scale, value: float) -> float:
    """Bound what rounding of wrenches and multipliers leaves open at the edge of balance."""
    size = np.abs(np.asarray(wrench) / scale).max()
    return 4e-16 * np.abs(answer.dual * scale).sum() * max(size, value)


def product(row, z: list[Fraction]) -> Fraction:
    """Multiply exactly."""
    return sum((Fraction(w) * y for w, y in zip(row, z, strict=True)), Fraction(0))


def proven(contacts: list[np.ndarray], dual, balanced, objective: str) -> float:
    """Compute the lower bound of the objective that multipliers prove, in rational arithmetic."""
    z = [Fraction(x) for x in dual]
    reach = [
        max(sum(Fraction(w) * y for w, y in zip(row, z, strict=True)) for row in each) for each in contacts
    ]
    p = max(reach) if objective == "sum" else sum(max(h, Fraction(0)) for h in reach)
    return float(sum(Fraction(b) * y for b, y in zip(balanced, z, strict=True)) / p) if p > 0 else 0.0


def separated(contacts: list[np.ndarray], direction, wrench, scale) -> bool:
    """Whether a direction separates the wrench by more than the tolerance, in rational arithmetic."""
    e = exact(direction)
    weight = max(abs(x) * Fraction(s) for x, s in zip(e, scale, strict=True))
    size = Fraction(float(np.abs(np.asarray(wrench) / scale).max()))
    margin = sum(-Fraction(w) * x for w, x in zip(wrench, e, strict=True)) / weight / size
    # The reach of the maximum, which is at least that of the sum.
    reach = sum(max(Fraction(0), *(product(row, e) for row in each)) for each in contacts) / weight
    # What the direction's own rounding makes of the reach does not count.
    beyond = reach if reach > len(contacts) * 1e-14 else Fraction(0)
    return float(margin - Fraction(LARGEST_OBJECTIVE) * beyond) > TOLERANCE * (1 - EDGE)


def exact(x) -> list[Fraction]:
    """Return the exact values of floats."""
    return [Fraction(float(value)) for value in np.ravel(x)]


def left_over(grasp, wrench, forces, scale) -> list[Fraction]:
    """Compute exactly what forces leave of the wrench, in units."""
    f = exact(forces)
    rows = zip(exact(wrench), grasp.grasp_matrix, exact(scale), strict=True)
    return [
        (w + sum(Fraction(float(g)) * x for g, x in zip(row, f, strict=True) if g and x)) / s
        for w, row, s in rows
    ]


def unbalanced(grasp, wrench, answer, scale) -> str:
    """Say what is wrong with the balance or the residual of an answer; nothing if both are right."""
    size = np.abs(np.asarray(wrench) / scale).max()
    rest = left_over(grasp, wrench, answer.forces, scale)
    left = float(sum(abs(x) for x in rest))
    if left > TOLERANCE * (1 + EDGE) * size:
        return f"unbalanced by {left / size:.2e}"
    off = float(
        sum(abs(r - x / s) for r, x, s in zip(rest, exact(answer.residual), exact(scale), strict=True))
    )
    terms = np.abs(answer.contact_wrenches / scale).sum() + size
    return f"the residual is off by {off / size:.1e}" if off > 1e-15 * terms else ""


def verdict(  # noqa: PLR0911 - one return for each way to fail
    grasp, wrench, objective: str, method: str = "implicit"
) -> tuple[str, str]:
    """How an answer over linearised cones ended: "right", "missed" or "wrong", and why."""
    scale, contacts = units(grasp), wrenches_of(grasp)
    distributor = gf.ForceDistributor(grasp, objective, method)
    try:
        answer = distributor.solve(wrench)
    except gf.InfeasibleWrenchError as error:
        if separated(contacts, error.direction, wrench, scale):
            return "right", "infeasible"
        return "missed", "a witness that does not separate"
    except gf.NotConvergedError as error:
        return "missed", str(error)
    if reason := unbalanced(grasp, wrench, answer, scale):
        return "wrong", reason
    value = answer.sigma_sum if objective == "sum" else answer.sigma_max
    if (answer.slip_margin < -1e-8).any() and not inside(grasp, answer.forces):
        return "wrong", "outside the cones"
    least = least_by_highs(contacts, wrench, scale, objective)
    if least is not None and abs(value - least) <= OBJECTIVE * least:
        return "right", "as HiGHS"
    bound = proven(contacts, answer.dual, answer.residual - np.asarray(wrench), objective)
    allowed = max(OBJECTIVE * value, 1.1 * answer.gap * value, rounding_of(answer, wrench, scale, value))
    if answer.gap <= RTOL and abs(value - bound) <= allowed:
        return "right", f"proven, HiGHS {least} instead of {value}"
    return "wrong", f"{value}, HiGHS {least}, proven {bound}"


def inside(grasp, forces) -> bool:
    """Whether forces are in the true cones; linearised ones are inside them."""
    mu, torsion = grasp.friction, grasp.torsion
    load = np.linalg.norm(forces[:, 1:3], axis=1) / mu
    if forces.shape[1] == 4:
        load = np.hypot(load, forces[:, 3] / torsion)
    return bool((load <= forces[:, 0] + 1e-9 * np.abs(forces).max()).all())


def least_by_clarabel(grasp, wrench, scale, objective: str) -> tuple[str, float]:
    """How Clarabel ended over true cones, and its least objective."""
    count = grasp.num_contacts
    b = -np.asarray(wrench) / scale
    size = np.abs(b).max()
    each = grasp.force_dim
    shares = [np.array([1, mu, mu, gamma][:each]) for mu, gamma in cone_axes(grasp)]
    columns = np.hstack(
        [
            grasp.grasp_matrix[:, each * i : each * (i + 1)] * (share * limit) / scale[:, None]
            for i, (share, limit) in enumerate(zip(shares, grasp.max_normal_force, strict=True))
        ]
    )
    unknowns = columns.shape[1] + 1
    balance = np.column_stack([columns, np.zeros(len(columns))])
    normal = np.zeros((count, unknowns))
    normal[np.arange(count), each * np.arange(count)] = 1
    cost = np.zeros(unknowns)
    cones = [clarabel.ZeroConeT(len(columns)), clarabel.NonnegativeConeT(count)]
    if objective == "sum":
        cost[each * np.arange(count)] = 1
        bounds = -normal
        bounds[0, -1] = 0
    else:
        cost[-1] = 1
        normal[:, -1] = -1
        bounds = normal
    inside_cones = -np.eye(unknowns)[: unknowns - 1]
    blocks = [balance, bounds, inside_cones]
    if objective == "sum":
        pinned = np.zeros((1, unknowns))
        pinned[0, -1] = 1
        blocks.insert(1, pinned)
        cones.insert(1, clarabel.ZeroConeT(1))
    cones += [clarabel.SecondOrderConeT(each)] * count
    matrix = sparse.csc_matrix(np.vstack(blocks))
    right = np.zeros(matrix.shape[0])
    right[: len(b)] = b / size
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    solved = clarabel.DefaultSolver(
        sparse.csc_matrix((unknowns, unknowns)), cost, matrix, right, cones, settings
    ).solve()
    return str(solved.status), solved.obj_val * size


def cone_axes(grasp) -> list[tuple[float, float]]:
    """Friction and torsion of each contact."""
    return list(zip(grasp.friction, grasp.torsion, strict=True))


def reach_of_cones(grasp, z) -> np.ndarray:
    """How far each contact reaches along a wrench direction, at its limit."""
    each = grasp.force_dim
    reach = []
    for i, (mu, gamma) in enumerate(cone_axes(grasp)):
        v = grasp.grasp_matrix[:, each * i : each * (i + 1)].astype(np.longdouble).T @ np.asarray(
            z, np.longdouble
        )
        slope = (mu * v[1:3]) @ (mu * v[1:3]) + (gamma * v[3]) ** 2 if each > 3 else mu**2 * (v[1:3] @ v[1:3])
        reach.append(grasp.max_normal_force[i] * (v[0] + np.sqrt(slope)))
    return np.array(reach)


def cone_verdict(  # noqa: PLR0911 - one return for each way to fail
    grasp, wrench, objective: str
) -> tuple[str, str]:
    """How an answer over true cones ended."""
    scale = units(grasp)
    size = np.abs(np.asarray(wrench) / scale).max()
    try:
        answer = gf.ForceDistributor(grasp, objective).solve(wrench)
    except gf.InfeasibleWrenchError as error:
        weight = np.abs(error.direction * scale).max()
        margin = -error.direction.astype(np.longdouble) @ np.asarray(wrench, np.longdouble) / weight / size
        reach = reach_of_cones(grasp, error.direction).max() / weight
        clear = margin > TOLERANCE * (1 - EDGE) and reach <= 1e-14
        return ("right", "infeasible") if clear else ("missed", f"margin {margin:.1e}, reach {reach:.1e}")
    except gf.NotConvergedError as error:
        return "missed", str(error)
    if reason := unbalanced(grasp, wrench, answer, scale):
        return "wrong", reason
    if not inside(grasp, answer.forces):
        return "wrong", "outside the cones"
    value = answer.sigma_sum if objective == "sum" else answer.sigma_max
    status, least = least_by_clarabel(grasp, wrench, scale, objective)
    if status == "Solved" and abs(value - least) <= OBJECTIVE * least:
        return "right", "as Clarabel"
    reach = reach_of_cones(grasp, answer.dual)
    p = reach.max() if objective == "sum" else reach[reach > 0].sum()
    bound = (answer.residual.astype(np.longdouble) - wrench) @ answer.dual.astype(np.longdouble) / p
    allowed = max(OBJECTIVE * value, 1.1 * answer.gap * value, rounding_of(answer, wrench, scale, value))
    if answer.gap <= RTOL and abs(value - bound) <= allowed:
        return "right", f"proven, Clarabel {status} {least} instead of {value}"
    return "wrong", f"{value}, Clarabel {status} {least}, proven {bound}"
