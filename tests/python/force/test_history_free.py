"""One answer for a wrench, whatever was solved before: a share of `python -m benches.trust`."""

import numpy as np
import pytest
from benches.trust import history_free

import graspforce as gf


@pytest.mark.parametrize("kind", history_free.KINDS)
def test_forces_are_the_least_squares_on_the_optimal_face_from_any_past(kind):
    row = history_free.row(kind, 12)
    assert row.cases >= 10
    assert (row.missed, row.wrong) == (0, 0), row


def test_a_weight_with_lower_bounds_does_not_fix_the_maximum():
    grasp = gf.Grasp([[-0.8, 0.6], [-0.6, -0.8], [-1, 0]], [[0.8, -0.6], [0.6, 0.8], [1, 0]], friction=0.75)
    wrench = np.array([-2.7, 3.9, -3.0])
    options = {"weight": 1.0, "min_normal": np.array([0, 0.5, 0])}
    past = [wrench + np.array([0.3, -0.2, 0.1]), wrench * 1.5, wrench + np.array([0.0, 1.0, -1.0])]
    case = history_free.Case(grasp, "max", wrench, past, options)
    expected = history_free.least_squares_forces(case)
    assert (expected**2).sum() == pytest.approx(14.868, abs=5e-4)
    for forces in history_free.answers(case):
        np.testing.assert_allclose(forces, expected, atol=1e-7)
