"""Random wrenches on random grasps: every answer certified in NumPy, a sample compared with HiGHS."""

from __future__ import annotations

from collections import Counter

import numpy as np

import graspforce as gf
from support.oracles import least_max, least_sum, outside_cones, primitive_wrenches
from support.random_grasps import random_grasp

FLIP = 1e-6


def sweep(seed, grasps, wrenches, sample):
    """Solve `wrenches` wrenches on each of `grasps` grasps, `sample` of them by HiGHS too.

    Returns counts of outcomes and the largest violation of each law, all relative.
    """
    counts = Counter({"wrong status": 0, "a change of 1e-6 flips the status": 0})
    worst = Counter()
    for k in range(grasps):
        rng = np.random.default_rng([seed, k])
        dim = 2 if k % 5 == 0 else 3
        edges = None if dim == 2 else int(rng.integers(3, 13))
        arguments = random_grasp([seed, k], dim, int(rng.integers(2, 7)), edges)
        grasp, primitives = gf.Grasp(**arguments), primitive_wrenches(**arguments)
        external = random_wrenches(rng, np.vstack(primitives), wrenches)
        for objective in ("max", "sum")[k % 2 :: 2]:
            check_grasp(grasp, primitives, arguments, external, objective, counts, worst)
            check_sample(grasp, primitives, external[:: max(1, wrenches // sample)], objective, counts, worst)
    return counts, worst


def random_wrenches(rng, columns, count):
    """Anywhere; inside the cone of what can be balanced; and on its edges. Magnitudes from 1e-3 to 1e3."""
    anywhere = rng.normal(size=(count, columns.shape[1]))
    inside = -rng.exponential(size=(count, len(columns))) @ columns
    few = rng.exponential(size=(count, len(columns)))
    few[np.argsort(rng.random(few.shape), axis=1) >= 2] = 0
    kind = rng.choice(3, p=[0.6, 0.3, 0.1], size=count)[:, None]
    external = np.choose(kind, [anywhere, inside, -few @ columns])
    return external / np.linalg.norm(external, axis=1)[:, None] * 10 ** rng.uniform(-3, 3, (count, 1))


def check_grasp(grasp, primitives, arguments, external, objective, counts, worst):
    distributor = gf.ForceDistributor(grasp, objective)
    status = distributor.solve_many(external).status
    solved, solutions, refused, directions, unknown = [], [], [], [], []
    for row, w in enumerate(external):
        try:
            solutions.append(distributor.solve(w))
            solved.append(row)
        except gf.InfeasibleWrenchError as error:
            directions.append(error.direction)
            refused.append(row)
        except gf.NotConvergedError:
            unknown.append(row)
    counts["solved"] += len(solved)
    counts["infeasible"] += len(refused)
    counts["not converged"] += len(unknown)
    differs = (status[solved] != 0).sum() + (status[refused] != 1).sum() + (status[unknown] != 3).sum()
    counts["status of solve_many differs"] += int(differs)
    columns = np.vstack(primitives)
    if refused:
        e = np.array(directions)
        e /= np.linalg.norm(e, axis=1)[:, None]
        reach = (columns @ e.T).max(axis=0) / np.linalg.norm(columns, axis=1).max()
        worst["separation: a force gains"] = max(worst["separation: a force gains"], reach.max())
        gain = -(external[refused] * e).sum(axis=1)
        counts["separation: the wrench does not"] += int((gain <= 0).sum())
    if not solved:
        return
    w = external[solved]
    sigma = np.array([s.sigma_sum if objective == "sum" else s.sigma_max for s in solutions])
    forces = np.array([s.forces for s in solutions])
    z = np.array([s.dual for s in solutions])
    shares = forces[:, :, 0] / arguments["max_normal_force"]
    value = shares.sum(axis=1) if objective == "sum" else shares.max(axis=1)
    gains = np.array([(p @ z.T).max(axis=0) for p in primitives])
    support = gains.max(axis=0) if objective == "sum" else np.maximum(gains, 0).sum(axis=0)
    outside = outside_cones(forces, arguments["friction"], arguments["edges"])
    size = np.abs(forces).max(axis=(1, 2))
    effort = np.abs(grasp.grasp_matrix).max() * size + np.abs(w).max(axis=1)
    unbalanced = np.abs(forces.reshape(len(w), -1) @ grasp.grasp_matrix.T + w).max(axis=1)
    found = {
        "gap as reported": np.array([s.gap for s in solutions]),
        "sum of contact wrenches + external": unbalanced / effort,
        "forces outside their cones": outside.max(axis=1) / size,
        "objective of the forces - sigma": np.abs(value - sigma) / sigma,
        "p(z) - 1": support - 1,
        "sigma - (-w.z)": np.abs(sigma + (w * z).sum(axis=1)) / sigma,
    }
    for name, values in found.items():
        assert np.isfinite(values).all(), name
        worst[name] = max(worst[name], float(values.max()))
    for name in ("gap as reported", "forces outside their cones"):
        counts[f"{name}, above 1e-9"] += int((found[name] > 1e-9).sum())
    counts["most pivots"] = max(counts["most pivots"], *(s.pivots for s in solutions))


def check_sample(grasp, primitives, external, objective, counts, worst):
    oracle = least_sum if objective == "sum" else least_max
    distributor = gf.ForceDistributor(grasp, objective)
    centre = np.vstack(primitives).sum(axis=0)
    for w in external:
        counts["compared with HiGHS"] += 1
        unit = w / np.linalg.norm(w)
        expected = oracle(primitives, unit)
        try:
            solution = distributor.solve(w)
        except gf.InfeasibleWrenchError:
            solution = None
        if (solution is None) != (expected is None):
            flipped = flips(oracle, primitives, unit, centre)
            counts["a change of 1e-6 flips the status" if flipped else "wrong status"] += 1
        elif solution is not None:
            sigma = solution.sigma_sum if objective == "sum" else solution.sigma_max
            difference = abs(sigma / np.linalg.norm(w) - expected) / expected
            if difference > 1e-9 and flips(oracle, primitives, unit, centre):
                counts["value beside the boundary"] += 1
            else:
                worst["sigma - HiGHS"] = max(worst["sigma - HiGHS"], difference)


def flips(oracle, primitives, unit, centre):
    """Whether relative changes of 1e-6, inward, outward and in random directions, change HiGHS's status."""
    rng = np.random.default_rng(0)
    changes = np.vstack([centre, -centre, rng.normal(size=(6, len(unit)))])
    changes *= FLIP / np.linalg.norm(changes, axis=1)[:, None]
    return len({oracle(primitives, unit + change) is None for change in changes}) == 2
