"""Supports that are degenerate but for rounding, and contacts at the torque origin.

The full run is `python -m benches.trust`.
"""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust import nearly_degenerate, origin_contacts
from benches.trust.judge import cone_verdict, units, verdict

import graspforce as gf

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")  # contacts are drawn at random

WEIGHT = [0, 0, -9.81, 0, 0, 0]


def feet(height: float, **options) -> gf.Grasp:
    positions = [(0.05, 0.05, 0), (-0.05, 0.05, height), (-0.05, -0.05, 0), (0.05, -0.05, 0)]
    return gf.Grasp(positions, [(0, 0, 1)] * 4, friction=0.5, max_normal_force=20, **options)


@pytest.mark.parametrize("height", [0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 3e-8, 1e-7])
@pytest.mark.parametrize("method", ["implicit", "enumerated", "reduced"])
def test_feet_whose_heights_differ_by_rounding_share_the_weight(height, method):
    answer = gf.ForceDistributor(feet(height, edges=4), "max", method).solve(WEIGHT)
    assert answer.sigma_max == pytest.approx(0.122625, rel=1e-9)
    np.testing.assert_allclose(answer.forces, [[2.4525, 0, 0]] * 4, atol=1e-8)
    assert np.abs(answer.residual).max() <= 1e-8


@pytest.mark.parametrize("height", [0, 1e-11, 1e-9, 1e-7])
def test_true_cones_and_the_sum_find_the_same_weight(height):
    for edges in (8, None):
        assert gf.ForceDistributor(feet(height, edges=edges)).solve(WEIGHT).sigma_max == pytest.approx(
            0.122625
        )
        answer = gf.ForceDistributor(feet(height, edges=edges), "sum").solve(WEIGHT)
        assert answer.sigma_sum == pytest.approx(0.4905, rel=1e-9)


def test_every_call_gives_the_same_answer():
    grasp = feet(1e-9)
    distributor = gf.ForceDistributor(grasp)
    forces = np.empty((4, 3))
    assert distributor.solve_into(np.array(WEIGHT, float), forces) == pytest.approx(0.122625)
    batch = distributor.solve_many([WEIGHT, WEIGHT])
    np.testing.assert_allclose(batch.sigma_max, 0.122625)
    assert batch.residual.shape == (2, 6)
    assert np.abs(batch.residual).max() <= 1e-8
    np.testing.assert_allclose(grasp.resistance([WEIGHT], "max"), 1 / 0.122625)


def test_a_contact_at_the_torque_origin_holds_the_whole_wrench():
    grasp = gf.Grasp([[0, 0], [0, 0.05]], [[-1, 2], [0, -1]])
    answer = gf.ForceDistributor(grasp).solve([0, -1, 0])
    assert answer.sigma_max == pytest.approx(0.894427191, rel=1e-9)
    np.testing.assert_allclose(answer.forces, [[0.894427191, -0.4472135955], [0, 0]], atol=1e-9)


def test_nearly_degenerate_supports_are_solved_as_highs_solves_them():
    ends = [(seed, *verdict(*nearly_degenerate.case(seed))) for seed in range(100)]
    assert [end for end in ends if end[1] != "right"] == []


def test_nearly_degenerate_true_cones_are_solved_as_clarabel_solves_them():
    ends = [(seed, *cone_verdict(*nearly_degenerate.cone_case(seed))) for seed in range(100)]
    assert [end for end in ends if end[1] != "right"] == []


def test_integer_grasps_with_a_contact_at_the_origin_are_solved():
    ends = [(seed, *verdict(*origin_contacts.case(seed))) for seed in range(100)]
    assert [end for end in ends if end[1] != "right"] == []


def test_lower_bounds_above_a_limit_are_refused_by_contact():
    with pytest.raises(gf.InvalidInputError, match=r"min_normal, contact 1: 1\.5 is a share"):
        gf.ForceDistributor(feet(0), min_normal=[0, 1.5, 0, 0])


def test_lower_bounds_that_make_a_wrench_infeasible_are_named():
    with pytest.raises(gf.InfeasibleWrenchError, match="without min_normal, forces balance"):
        gf.ForceDistributor(feet(0), min_normal=0.5).solve(WEIGHT)


def test_lower_bounds_hold_on_nearly_level_feet():
    for height in (1e-11, 1e-9, 1e-8):
        answer = gf.ForceDistributor(feet(height), min_normal=0.1).solve(WEIGHT)
        assert answer.sigma_max == pytest.approx(0.122625, rel=1e-8)
        assert answer.shares.min() >= 0.1 * (1 - 1e-9)


def test_shares_at_the_limit_are_within_limits():
    for scale in np.linspace(0.1, 10, 50):
        grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=scale)
        assert gf.ForceDistributor(grasp).solve([0, -scale, 0]).within_limits


@pytest.mark.parametrize("rtol", [1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("edges", [8, None])
def test_limits_are_limits_whatever_the_tolerance_of_the_gap(rtol, edges):
    corners = [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)]
    grasp = gf.Grasp(corners, -np.array(corners), max_normal_force=20, edges=edges)
    most = gf.ForceDistributor(grasp, rtol=1e-9).solve([0, 0, -1, 0, 0, 0]).sigma_max
    for excess, within in ((1 - 2 * rtol, True), (1 + 2 * rtol, False), (1.3889, False)):
        solution = gf.ForceDistributor(grasp, rtol=rtol).solve([0, 0, -excess / most, 0, 0, 0])
        assert solution.within_limits is within, excess
        assert solution.within_limits == (solution.sigma_max <= 1 + 1e-9)


@pytest.mark.parametrize("rtol", [0, -1e-9, 2e-3, 0.5, np.inf, np.nan])
def test_a_tolerance_that_would_loosen_the_answer_is_refused_by_name(rtol):
    with pytest.raises(gf.InvalidInputError, match=r"^rtol: .* must lie above 0 and be at most 0\.001"):
        gf.ForceDistributor(feet(0), rtol=rtol)


def test_a_limit_that_cannot_be_computed_with_is_named():
    with pytest.raises(gf.InvalidGraspError, match="max_normal_force, contact 1: 1e-300"):
        gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], max_normal_force=[1, 1e-300])


def test_forces_on_feet_in_line_do_not_depend_on_the_past():
    grasp = gf.Grasp(
        [[-0.1, 1e-10, 0], [0, 0, -1e-10], [0.1, -2e-10, -1e-10]],
        [[0, 0, 1.0]] * 3,
        edges=4,
        max_normal_force=20,
    )
    wrench = [0, 0, -9.81, 0, -0.2943, 0]
    used = gf.ForceDistributor(grasp)
    used.solve([0, 0, -9.81, -9.81e-10, -0.981, 0])
    for distributor in (gf.ForceDistributor(grasp), used):
        # Exact balance costs 0.269775: more than 1e9 times the residual of 3.7e-11 N m.
        assert distributor.solve(wrench).sigma_max == pytest.approx(0.2329875, rel=1e-7)


@pytest.mark.parametrize("objective", ["max", "sum"])
def test_a_pinch_whose_line_misses_the_load_is_infeasible(objective):
    grasp = gf.Grasp([[0.05, 1e-8, 0], [-0.05, 0, 0]], [[-1, 0, 0], [1, 0, 0]], edges=8, max_normal_force=20)
    assert verdict(grasp, WEIGHT, objective) == ("right", "infeasible")


def test_the_residual_of_a_pinch_stays_within_the_tolerance():
    positions = [[-0.01832405, 0, -1e-9], [0.018324049, 0, 0], [-0.01832405, 0, 0], [0.018324049, 0, 0]]
    grasp = gf.Grasp(positions, [[1, 0, 0], [-1, 0, 0]] * 2, friction=1.0, edges=12)
    wrench = np.array([-9.81, 0, 0, 0, 2.4525e-9, 0])
    answer = gf.ForceDistributor(grasp, "sum").solve(wrench)
    scale = units(grasp)
    assert np.abs(answer.residual / scale).sum() <= 1e-9 * np.abs(wrench / scale).max()


def test_lower_bounds_on_true_cones_are_to_blame_at_a_corner_foot():
    grasp = gf.Grasp(
        [[-0.01, 0.02, 0], [0, -0.01, 0], [-0.01, -0.02, 0]],
        [[0, 0, 1.0]] * 3,
        edges=None,
        max_normal_force=10,
    )
    distributor = gf.ForceDistributor(grasp, weight=1.0, min_normal=[0.1, 0.3, 0])
    with pytest.raises(gf.InfeasibleWrenchError, match="without min_normal, forces balance"):
        distributor.solve([0, 0, -1, -0.02, -0.01, 0])


def test_a_box_rounded_to_float32_shares_its_weight():
    positions = [
        [0.06366349756717682, 0.05472620204092071, 0.08094443380832672],
        [-0.009710460901260376, -0.03545369207859039, 0.11067403852939606],
        [0.009710460901260376, 0.03545369207859039, -0.11067403852939606],
        [-0.06366349756717682, -0.05472620204092071, -0.08094443380832672],
    ]
    normals = [[-0.7438790798187256, 0.6526587009429932, 0.14380744099617004]] * 4
    grasp = gf.Grasp(positions, normals, edges=4, max_normal_force=20)
    wrench = [7.297453773021698, -6.402581856250763, -1.4107509961724283, 0, 0, 0]
    assert gf.ForceDistributor(grasp).solve(wrench).sigma_max == pytest.approx(0.1226250028, rel=1e-9)


@pytest.mark.parametrize("edges", [3, None])
@pytest.mark.parametrize("objective", ["max", "sum", "squares"])
def test_soft_fingers_whose_normals_meet_in_the_origin_balance_what_they_exert(objective, edges):
    rng = np.random.default_rng(8)
    for _ in range(10):
        count = int(rng.integers(1, 6))
        normals = rng.integers(-1, 2, (count, 3)) + np.array([2, 0, 0])
        grasp = gf.Grasp(np.zeros((count, 3)), normals, friction=0.2, torsion=0.02, edges=edges)
        forces = np.outer(rng.choice([0.5, 1.0], count), [1, 0.1, 0, 0])
        external = -grasp.grasp_matrix @ forces.ravel()
        limits = {"limits": True} if objective == "squares" else {}
        found = gf.ForceDistributor(grasp, objective, **limits).solve(external)
        np.testing.assert_allclose(grasp.grasp_matrix @ found.forces.ravel(), -external, atol=1e-8)


def test_least_squares_reach_limits_up_to_their_tolerance():
    ends = [(-1, 1, 1), (-1, -1, -1)]
    options = {"friction": 0.3, "torsion": 0.02, "edges": 4, "max_normal_force": 1e-6}
    grasp = gf.Grasp(ends, [(0, 0, -1), (0, 0, 1)], **options)
    found = gf.ForceDistributor(grasp, "squares", limits=True).solve([0, 0, 1e-6, 1e-6, 1e-6, 0])
    np.testing.assert_allclose(found.forces, [[1e-6, 0, 0, 0], [0, 0, 0, 0]], atol=1e-14)
