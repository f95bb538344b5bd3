"""The tile of Example 2: the reference iterates, and that pruning changes nothing."""

import json
from pathlib import Path

import numpy as np
import pytest

import graspforce as gf
from graspforce.paper import TILE

REFERENCE = json.loads((Path(__file__).parents[2] / "reference" / "tile.json").read_text())["paths"]


def plan_tile(criterion, **options):
    given = {"friction": 0.68, "max_normal_force": TILE.max_normal_force, "edges": TILE.edges, **options}
    return gf.plan(TILE.surface, TILE.initial, TILE.step, TILE.tolerance, TILE.bounds, criterion, **given)


@pytest.fixture(scope="module", params=["max", "sum"])
def plans(request):
    return request.param, plan_tile(request.param), plan_tile(request.param, prune=False)


def test_the_tile_plans_visit_the_reference_iterates(plans):
    criterion, pruned, _ = plans
    expected = REFERENCE[criterion]
    assert len(pruned.history) == len(expected) == (11 if criterion == "max" else 20)
    for row, reference in zip(pruned.history, expected, strict=True):
        np.testing.assert_allclose(row.params, reference["params"], rtol=0, atol=1e-12)
        assert row.rho == pytest.approx(reference["rho"], rel=1e-9, abs=1e-9)


def test_pruning_changes_no_iterate(plans):
    _, pruned, plain = plans
    assert len(pruned.history) == len(plain.history)
    for row, other in zip(pruned.history, plain.history, strict=True):
        np.testing.assert_array_equal(row.params, other.params)
        np.testing.assert_array_equal(row.step, other.step)
        assert row.rho == other.rho


def test_every_candidate_is_rejected_or_measured(plans):
    _, pruned, plain = plans
    iterations = len(pruned.history) - 1
    for plan in (pruned, plain):
        # The centre is known from the iteration before, but for the first.
        assert plan.counts.candidates - (iterations - 1) == plan.counts.rejected + plan.counts.polytopes
    assert plain.counts.rejected == 0
    assert plain.counts.converged == plain.counts.polytopes
    assert pruned.counts.rejected > pruned.counts.candidates / 2


def test_with_the_printed_friction_neither_printed_end_is_force_closure():
    for criterion in ("max", "sum"):
        params = np.array([TILE.published[criterion].params])
        positions, normals = (array[0] for array in TILE.surface(params))
        grasp = gf.Grasp(positions, normals, friction=TILE.friction, max_normal_force=10.0, edges=10)
        assert not grasp.is_force_closure
        assert grasp.quality("sum").rho > 0
