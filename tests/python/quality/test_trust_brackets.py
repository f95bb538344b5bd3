"""A share of the families of benches/trust that concern brackets, closure and gradients."""

from __future__ import annotations

import numpy as np
from benches.trust import metrics, near_closure, smooth

import graspforce as gf


def test_planar_brackets_hold_the_exact_epsilon_in_metrics_of_any_condition() -> None:
    asked, missed, wrong = metrics.compare(metrics.planar_cases(24), metrics.wrong_planar)
    assert asked > 40
    assert (missed, wrong) == (0, 0)


def test_spatial_brackets_hold_the_exact_epsilon_in_metrics_of_any_condition() -> None:
    assert metrics.compare(metrics.spatial_cases(2), metrics.wrong_spatial) == (4, 0, 0)


def test_closure_is_the_same_in_every_metric_and_brackets_hold_the_exact_epsilon() -> None:
    assert near_closure.compare_slippery(8) == (128, 0, 0)


def test_open_grasps_close_to_closure_have_narrow_brackets_that_hold() -> None:
    assert near_closure.compare_open(40) == (120, 0, 0)


def test_gradients_are_called_unique_where_differences_agree() -> None:
    _, missed, wrong = smooth.compare(120)
    assert missed <= 1
    assert wrong == 0


def test_open_brackets_report_their_proven_end() -> None:
    pinch = gf.Grasp(
        [(0.04, 0, 0), (-0.04, 0, 0)], [(-1, 0, 0), (1, 0, 0)], friction=0.5, torsion=0.02, edges=None
    )
    found = pinch.quality("max")
    assert found.epsilon == found.epsilon_lower == -found.upper
    assert found.epsilon_lower <= found.epsilon_upper
    batch = gf.quality_many(
        pinch.positions[None], pinch.normals[None], friction=0.5, torsion=0.02, edges=None
    )
    assert np.array_equal(batch.epsilon, batch.epsilon_lower)
    assert batch.epsilon_upper[0] == found.epsilon_upper
