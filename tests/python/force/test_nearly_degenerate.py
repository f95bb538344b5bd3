"""Supports that are degenerate but for rounding, and contacts at the torque origin.

The full run is `python -m benches.trust`.
"""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust import nearly_degenerate, origin_contacts
from benches.trust.judge import cone_verdict, verdict

import graspforce as gf

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
    with pytest.raises(gf.InvalidInputError, match=r"min_normal, row 1: 1\.5 is a share"):
        gf.ForceDistributor(feet(0), min_normal=[0, 1.5, 0, 0])


def test_lower_bounds_that_make_a_wrench_infeasible_are_named():
    with pytest.raises(gf.InfeasibleWrenchError, match="min_normal is to blame"):
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


def test_a_limit_that_cannot_be_computed_with_is_named():
    with pytest.raises(gf.InvalidGraspError, match="max_normal_force, contact 1: 1e-300"):
        gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], max_normal_force=[1, 1e-300])
