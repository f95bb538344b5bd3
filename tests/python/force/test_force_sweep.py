"""Twenty wrenches on each of a thousand random grasps, some of which cannot be balanced."""

import pytest
from support.certified_forces import sweep

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")  # contacts are drawn at random


@pytest.fixture(scope="module")
def outcome():
    return sweep(seed=19, grasps=1000, wrenches=20, sample=1)


def test_no_status_is_wrong(outcome):
    counts, worst = outcome
    assert counts["wrong status"] == counts["status of solve_many differs"] == 0
    assert counts["separation: the wrench does not"] == 0
    assert worst["separation: a force gains"] < 1e-12
    assert counts["solved"] + counts["infeasible"] == 20_000
    assert min(counts["solved"], counts["infeasible"]) > 2000
    assert counts["compared with HiGHS"] == 1000


def test_every_answer_is_feasible_and_no_other_is_better(outcome):
    counts, worst = outcome
    assert worst["sum of contact wrenches + external"] < 1e-11
    assert worst["forces outside their cones"] < 1e-9
    assert worst["objective of the forces - sigma"] < 1e-9
    assert worst["p(z) - 1"] < 1e-9
    assert worst["sigma - (-w.z)"] < 1e-9
    assert worst["gap as reported"] < 1e-9
    assert worst["sigma - HiGHS"] < 1e-9
    assert counts["most pivots"] < 200
