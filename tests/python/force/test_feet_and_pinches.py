"""Feet in a line, pinches and duplicated contacts: every wrench has an answer, the same from any past.

The full run is `python -m benches.trust feet_and_pinches`.
"""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust.feet_and_pinches import FAMILIES
from benches.trust.judge import verdict

import graspforce as gf


@pytest.mark.parametrize("family", FAMILIES)
def test_no_case_is_missed_and_none_is_wrong(family):
    ends = {seed: verdict(*FAMILIES[family](seed)) for seed in range(120)}
    assert not {seed: end for seed, end in ends.items() if end[0] != "right"}


@pytest.mark.parametrize("family", [family for family in FAMILIES if "duplicated" not in family])
def test_forces_do_not_depend_on_the_wrenches_before(family):
    for seed in range(80):
        grasp, wrench, objective = FAMILIES[family](seed)
        rng = np.random.default_rng([77, seed])
        wrenches = grasp.primitive_wrenches
        shares = rng.integers(0, 3, (4, len(wrenches))) * (rng.uniform(size=(4, len(wrenches))) < 0.3)
        past = [-0.2 * row @ wrenches for row in shares if row.any()]
        past += [wrench + share * (past[0] - wrench) for share in (0.3, 0.05, 1e-4)]
        found = [forces_after(before, grasp, objective, wrench) for before in ([], past, past[::-1])]
        largest = np.abs(found[0]).max()
        for forces in found[1:]:
            np.testing.assert_allclose(forces, found[0], rtol=0, atol=1e-6 * largest, err_msg=f"seed {seed}")


def forces_after(past, grasp: gf.Grasp, objective: str, wrench) -> np.ndarray:
    """Solve for a wrench after others; no forces where it is infeasible."""
    distributor = gf.ForceDistributor(grasp, objective)
    batch = distributor.solve_many(np.array([*past, wrench]))
    assert set(batch.status) <= {gf.Status.SOLVED, gf.Status.INFEASIBLE}
    return np.nan_to_num(batch.forces[-1])


NOISY_FEET = [
    [-0.09999993, -9.8e-08, -1.57e-07],
    [-2.92e-07, -3.5e-08, 1.25e-07],
    [0.100000003, 5.1e-08, 1.02e-07],
]


def test_feet_in_a_line_share_their_load_by_least_squares():
    grasp = gf.Grasp(NOISY_FEET, [(0, 0, 1)] * 3, friction=0.5, max_normal_force=20, edges=4)
    wrench = [0, 0, -9.81, 5.28759e-07, -0.294301799154, 0]
    answer = gf.ForceDistributor(grasp, "sum").solve(wrench)
    assert answer.sigma_sum == pytest.approx(0.4905, rel=1e-9)
    assert np.square(answer.forces / 20).sum() == pytest.approx(0.0912977, rel=1e-6)


@pytest.mark.parametrize("objective", ["max", "sum"])
def test_lower_bounds_that_do_not_bind_change_no_force_of_feet_in_a_line(objective):
    grasp = gf.Grasp(NOISY_FEET, [(0, 0, 1)] * 3, friction=0.5, max_normal_force=20, edges=4)
    wrench = [0, 0, -9.81, 5.28759e-07, -0.294301799154, 0]
    free = gf.ForceDistributor(grasp, objective).solve(wrench)
    held = gf.ForceDistributor(grasp, objective, min_normal=0.5 * free.shares.min()).solve(wrench)
    np.testing.assert_allclose(held.forces, free.forces, atol=1e-6)
