"""The share of friction that is unused, of cones that extreme forces span."""

import numpy as np
import pytest
from scipy.optimize import linprog

import graspforce as gf


def margin_by_linear_program(force, edges):
    """1 - 1 / s for the largest s with (f_n, s f_t) in the cone of the edges."""
    direction = np.r_[0.0, force[1:]]
    columns = np.column_stack([edges.T, -direction])
    normal = np.r_[force[0], np.zeros(len(force) - 1)]
    found = linprog(np.r_[np.zeros(len(edges)), -1.0], A_eq=columns, b_eq=normal)
    unbounded = 3
    return 1.0 if found.status == unbounded else 1.0 - 1.0 / found.x[-1]


def any_cone(rng, components):
    """Extreme forces around the normal, or to one side of it; a part of them is cut."""
    edges = np.ones((int(rng.integers(components, 12)), components))
    edges[:, 1:] = 0.5 * rng.normal(size=edges[:, 1:].shape) + rng.choice([0.0, 0.6]) * rng.normal()
    if components == 4:
        edges[:, 3] *= 0.01
    return edges * rng.uniform(0.2, 3.0, (len(edges), 1))


@pytest.mark.parametrize("components", [3, 4])
def test_the_margin_of_any_cone_is_that_of_a_linear_program(components):
    rng = np.random.default_rng(5)
    asked = 0
    for _ in range(40):
        cones = [any_cone(rng, components) for _ in range(3)]
        positions = rng.normal(size=(3, 3))
        grasp = gf.Grasp(positions, -positions, extreme_forces=cones)
        # Inside, or on a face.
        forces = [rng.uniform(size=len(cone)) * (rng.random(len(cone)) < 0.4) @ cone for cone in cones]
        external = -grasp.grasp_matrix @ np.ravel(forces)
        found = gf.ForceDistributor(grasp, "squares", reference=np.array(forces)).solve(external)
        for force, cone, margin in zip(found.forces, cones, found.slip_margin, strict=True):
            if np.abs(force).max() > 1e-3:
                assert margin == pytest.approx(margin_by_linear_program(force, cone), abs=1e-7)
                asked += 1
    assert asked > 60


def test_the_margin_within_torque_limits_is_that_of_the_friction_cone():
    rng = np.random.default_rng(6)
    directions = rng.normal(size=(4, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    given = {"friction": 0.6, "max_normal_force": 5.0}
    jacobians = 0.3 * rng.normal(size=(4, 3, 3))
    limited = [gf.torque_limited_forces(jacobian, np.full(3, 2.0), 0.6, 5.0) for jacobian in jacobians]
    grasp = gf.Grasp(directions, -directions, **given, extreme_forces=limited)
    external = rng.normal(size=6) * 0.1
    forces = gf.ForceDistributor(grasp, "squares").solve(external)
    mu = np.linalg.norm(forces.forces[:, 1:3], axis=1) / np.maximum(0.6 * forces.forces[:, 0], 1e-12)
    pressing = forces.forces[:, 0] > 1e-6
    np.testing.assert_allclose(forces.slip_margin[pressing], 1 - mu[pressing], atol=0.1)
    assert (forces.slip_margin[pressing] <= 1 - mu[pressing] + 1e-9).all()


def test_no_force_slips_nowhere_and_a_contact_without_friction_everywhere():
    edges = [np.array([[1.0, 0, 0]]), np.array([[1.0, 0.5, 0], [1, -0.5, 0], [1, 0, 0.5], [1, 0, -0.5]])]
    grasp = gf.Grasp([(-1, 0, 0), (1, 0, 0)], [(1, 0, 0), (-1, 0, 0)], extreme_forces=edges)
    nothing = gf.ForceDistributor(grasp).solve(np.zeros(6))
    assert nothing.slip_margin.tolist() == [0.0, 1.0]
    pushed = gf.ForceDistributor(grasp).solve([1.0, 0.25, 0, 0, 0, 0.25])
    assert pushed.slip_margin == pytest.approx([0.0, 0.5])


@pytest.mark.parametrize("seed", range(30))
def test_a_force_that_is_rounding_does_not_slip(seed):
    # Feet in a row of which some bear rounding alone, which has any direction.
    rng = np.random.default_rng(seed + 100)
    positions = np.column_stack([rng.normal(size=5), np.zeros((5, 2))])
    grasp = gf.Grasp(positions, [(0, 0, 1)] * 5, friction=0.5, edges=6)
    external = -grasp.grasp_matrix @ np.outer(rng.uniform(0, 1, 5), [1, 0.1, 0.4]).ravel()
    for objective in ("max", "sum"):
        assert (gf.ForceDistributor(grasp, objective).solve(external).slip_margin >= -1e-6).all()
