"""Refinement of plans from mesh files: interruptions, errors, time limits."""

import time
from itertools import pairwise

import numpy as np
import pytest
from support.plan_files import SURFACES

import graspforce as gf
from graspforce.files import load_problem

trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'")

SEARCH = "mesh: egg.stl\nstarts: 6\nbest: 3\nstep: 0.02\ntolerance: 0.01\nfriction: 0.8\n"


@pytest.fixture
def refining(write, monkeypatch):
    """Return a search whose refinements a test may change, and what it finds unrefined."""
    plain = load_problem(write(SEARCH + "refine: false\n", "plain.yaml")).plan()
    assert len(plain.plans) == 3

    def planned(change, text=SEARCH):
        calls = []

        def changed(*arguments, **options):
            calls.append(arguments)
            return change(len(calls), lambda: gf.refine(*arguments, **options))

        monkeypatch.setattr("graspforce.files.mesh_plan_file.refine", changed)
        found = load_problem(write(text, "plan.yaml")).plan()
        assert all(one.quality.rho <= other.quality.rho for one, other in pairwise(found.plans))
        return found, len(calls)

    return planned, plain


def lengths(found):
    return sorted(len(plan.history) for plan in found.plans)


def test_ctrl_c_while_refining_keeps_every_grasp_that_was_found(refining):
    def interrupted(call, refine):
        if call == 2:
            raise KeyboardInterrupt
        return refine()

    planned, plain = refining
    found, calls = planned(interrupted)
    assert (found.stopped, calls, len(found.plans)) == ("interrupted", 2, 3)
    assert sum(lengths(found)) == sum(lengths(plain)) + 1


def test_a_refinement_that_fails_costs_no_other_grasp(refining):
    def failing(call, refine):
        if call == 1:
            error = gf.NotConvergedError("no end")
            error.partial = refine()
            raise error
        if call == 2:
            raise gf.InvalidInputError("the surface ends here")
        return refine()

    planned, plain = refining
    found, calls = planned(failing)
    assert (found.stopped, calls, len(found.plans)) == ("tolerance", 3, 3)
    assert sum(lengths(found)) == sum(lengths(plain)) + 2
    starts = [plan.history[0].params for plan in plain.plans[:2]]
    rows = [int(np.flatnonzero((found.starts == start).all(axis=1))[0]) for start in starts]
    expected = zip(rows, ("refinement: no end", "refinement: the surface ends here"), strict=True)
    assert found.failures == dict(expected)


def test_refinement_ends_when_the_time_of_the_search_is_over_and_is_part_of_it(refining):
    def slow(_, refine):
        time.sleep(1.5)
        return refine()

    planned, _ = refining
    found, calls = planned(slow, SEARCH + "time_limit: 1.5\n")
    assert (found.stopped, calls) == ("time", 1)
    assert found.seconds >= 1.5
    assert planned(slow, SEARCH + "time_limit: 1.0e-9\n")[1] == 0


def test_grasps_that_refine_into_one_are_one(refining):
    ended = []

    def same(_, refine):
        ended.append(ended[0] if ended else refine())
        return ended[0]

    planned, _ = refining
    found, calls = planned(same)
    assert (calls, len(found.plans)) == (3, 1)


@pytest.mark.parametrize(
    ("searched", "text"), [("files.mesh_plan_file.plan_multistart", SEARCH), ("planning.plan", SURFACES)]
)
def test_an_error_of_a_search_names_the_file_and_keeps_what_was_found(write, monkeypatch, searched, text):
    def failing(*_, **__):
        error = gf.InvalidInputError("the surface ends here")
        error.partial = "what was found"
        raise error

    monkeypatch.setattr(f"graspforce.{searched}", failing)
    with pytest.raises(gf.InvalidFileError, match=r"plan\.yaml: the surface ends here") as raised:
        load_problem(write(text, "plan.yaml")).plan()
    assert raised.value.partial == "what was found"
