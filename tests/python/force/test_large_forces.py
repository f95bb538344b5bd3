"""Wrenches that take forces far greater than themselves: balanced to 1e-9, or infeasible, by every method.

The full run is `python -m benches.trust large_forces`.
"""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust.large_forces import KINDS, case, verdict

import graspforce as gf


@pytest.mark.parametrize("kind", KINDS)
def test_forces_leave_over_at_most_the_tolerance_or_a_witness_separates(kind):
    count = 12 if kind in ("enumerated", "reduced") else 60
    ends = {seed: verdict(case(kind, seed)) for seed in range(count)}
    assert not {seed: end for seed, end in ends.items() if end[0] != "right"}


@pytest.mark.parametrize("criterion", ["max", "sum"])
@pytest.mark.parametrize("distance", [1e3, 1e9, 1e15, 1e20, 1e34, 1e100])
def test_a_contact_without_friction_exerts_the_same_however_far_away(criterion, distance):
    def answer(x):
        grasp = gf.Grasp([[0, 5.3125], [x, 0]], [[5.3125, 0.875], [-1, 0]], friction=[0.5, 0])
        return gf.ForceDistributor(grasp, criterion).solve([0, 0, 3.5625])

    near, far = answer(1.0), answer(distance)
    assert np.allclose(far.forces, near.forces, rtol=0, atol=1e-12)
    assert np.abs(far.residual).max() < 1e-14
