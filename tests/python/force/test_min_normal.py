"""Lower bounds on normal forces against HiGHS, and forces within joint torque limits."""

import copy
import pickle

import numpy as np
import pytest
from scipy.optimize import linprog
from support.oracles import primitive_wrenches
from support.random_grasps import random_grasp

import graspforce as gf


def oracle(wrenches, external, objective, bounds):
    """Solve over all extreme forces with a row for each bound, by HiGHS; None if infeasible."""
    W = np.vstack(wrenches).T
    m, n = len(wrenches), W.shape[1]
    shares = np.repeat(np.eye(m), [len(w) for w in wrenches], axis=1)
    last = np.ones((m, 1))
    cost = np.append(np.zeros(n), 1.0) if objective == "max" else np.append(np.ones(n), 0.0)
    result = linprog(
        cost,
        A_eq=np.hstack([W, np.zeros((len(W), 1))]),
        b_eq=-external,
        A_ub=np.vstack([np.hstack([shares, -last]), np.hstack([-shares, 0 * last])]),
        b_ub=np.concatenate([np.zeros(m), -bounds]),
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert result.status in (0, 2), result.message
    return result.fun if result.status == 0 else None


@pytest.mark.parametrize("objective", ["max", "sum"])
@pytest.mark.parametrize("seed", range(60))
def test_highs_finds_the_same_least_forces(seed, objective):
    rng = np.random.default_rng(1000 + seed)
    dim = 2 + seed % 2
    arguments = random_grasp(seed, dim, int(rng.integers(2, 7)), int(rng.integers(3, 11)))
    grasp = gf.Grasp(**arguments)
    if dim == 2:
        arguments.pop("edges")
    wrenches = primitive_wrenches(**arguments)
    bounds = rng.uniform(0, 0.4, grasp.num_contacts) * rng.integers(0, 2, grasp.num_contacts)
    distributor = gf.ForceDistributor(grasp, objective, min_normal=bounds)
    for _ in range(5):
        external = -sum(
            w.T @ rng.uniform(0, 0.3, len(w)) + c * w[0] for w, c in zip(wrenches, bounds, strict=True)
        )
        external = external if rng.uniform() < 0.8 else rng.normal(size=external.size)
        expected = oracle(wrenches, external, objective, bounds)
        if expected is None:
            with pytest.raises(gf.InfeasibleWrenchError):
                distributor.solve(external)
            continue
        solution = distributor.solve(external)
        found = solution.sigma_max if objective == "max" else solution.sigma_sum
        assert found == pytest.approx(expected, rel=1e-9)
        normal = solution.forces[:, 0] / arguments["max_normal_force"]
        assert (normal >= bounds - 1e-12 * solution.sigma_sum).all()
        assert solution.contact_wrenches.sum(axis=0) == pytest.approx(
            -external, abs=1e-9 * solution.sigma_sum * 20
        )
        forces = np.empty_like(solution.forces)
        assert distributor.solve_into(external, forces) == pytest.approx(found, rel=1e-12)
        assert forces == pytest.approx(solution.forces, abs=1e-9 * solution.sigma_sum * 20)


def test_one_number_bounds_every_contact():
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    distributor = gf.ForceDistributor(grasp, min_normal=0.5)
    assert distributor.min_normal.tolist() == [0.5, 0.5]
    for same in (distributor, copy.copy(distributor), pickle.loads(pickle.dumps(distributor))):
        assert same.solve([0, 0, 0]).forces == pytest.approx(np.array([[2, 0], [2, 0]]))
    batch = distributor.solve_many([[0, -1, 0], [0, -8, 0]])
    assert batch.sigma_max == pytest.approx([0.5, 2.0])
    assert gf.ForceDistributor(grasp).min_normal is None


@pytest.mark.parametrize("bad", [[0.1], [0.1, -1], [np.nan, 0], "much", [[0.1, 0.1]]])
def test_bounds_that_make_no_sense_are_refused(bad):
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    with pytest.raises(gf.InvalidInputError, match="min_normal"):
        gf.ForceDistributor(grasp, min_normal=bad)


def test_torque_limits_make_extreme_forces():
    rng = np.random.default_rng(5)
    jacobian = rng.normal(size=(3, 3)) * 0.05
    forces = gf.torque_limited_forces(jacobian, [0.2, 0.3, 0.4], max_normal_force=10, edges=6)
    assert (np.abs(forces @ jacobian) <= np.array([0.2, 0.3, 0.4]) * (1 + 1e-9)).all()
    both = np.array([[-0.2, -0.3, -0.4], [0.2, 0.3, 0.4]])
    assert gf.torque_limited_forces(jacobian, both, max_normal_force=10, edges=6) == pytest.approx(forces)
    finger = gf.Grasp([(0, 0, 0)], [(0, 0, 1)], extreme_forces=[forces])
    assert finger.primitive_wrenches.shape == (len(forces), 6)
    with pytest.raises(gf.InvalidInputError, match="jacobian"):
        gf.torque_limited_forces(jacobian[:2], [0.2, 0.3, 0.4])
    with pytest.raises(gf.InvalidInputError, match="torque_limits"):
        gf.torque_limited_forces(jacobian, [0.2])
    with pytest.raises(gf.InvalidInputError, match="torque_limits: joint 2"):
        gf.torque_limited_forces(jacobian, [0.2, 0.3, -0.1])
