"""Branch and bound: its bound holds everywhere, its gap closes, and it finds what a grid finds."""

import itertools

import numpy as np
import pytest

import graspforce as gf
from graspforce._core import BoxBound
from graspforce.paper import RACKET, TILE
from graspforce.surfaces import contacts_on, ellipse


def box_rows(low, high, *, stencil):
    axes = len(low)
    rows = np.array(list(itertools.product((-1.0, 1.0), repeat=axes)))
    if stencil:
        arms = np.kron(np.eye(axes), [[-1.0], [-0.5], [0.5], [1.0]])
        rows = np.vstack([rows, np.zeros(axes), arms])
    return (low + high) / 2 + rows * (high - low) / 2


@pytest.mark.parametrize("criterion", ["max", "sum"])
@pytest.mark.parametrize("edges", [6, None])
def test_no_grasp_in_a_box_of_the_tile_exceeds_its_bound(criterion, edges):
    random = np.random.default_rng(2)
    options = {"friction": 0.68, "max_normal_force": 10.0, "edges": edges, "tangents": [(1, 0, 0)] * 4}
    bound = BoxBound(3, criterion)
    for half in (0.1, 0.03, 0.01):
        for _ in range(12):
            center = random.uniform(-0.2 + half, 0.2 - half, 4)
            low, high = center - half, center + half
            positions, normals = TILE.surface(box_rows(low, high, stencil=True))
            upper = bound.over([1e300], positions, normals, **options, axes=4, safety=1.5)[0]
            inside = random.uniform(low, high, (100, 4))
            positions, normals = TILE.surface(inside)
            epsilon = gf.quality_many(positions, normals, **options, criterion=criterion, rtol=1e-4).epsilon
            assert epsilon.max() <= upper


@pytest.mark.parametrize("name", ["three fingers", "four fingers"])
@pytest.mark.parametrize("criterion", ["max", "sum"])
def test_the_gap_closes_on_the_racket_and_a_grid_finds_nothing_better(name, criterion):
    problem = RACKET[name]
    options = {"friction": problem.friction, "max_normal_force": problem.max_normal_force}
    found = gf.plan_global(problem.surface, problem.bounds, criterion, gap=0.005, **options)
    assert found.stopped == "tolerance"
    assert found.gap <= 0.005 * found.quality.epsilon + 1e-12
    assert not found.proven
    axes = [np.linspace(*bound, 60 if len(problem.bounds) == 3 else 22) for bound in problem.bounds]
    params = np.array(list(itertools.product(*axes)))
    best = gf.quality_many(*problem.surface(params), **options, criterion=criterion).epsilon.max()
    assert best <= found.upper
    assert found.quality.epsilon >= best / 1.005


def test_given_curvature_makes_the_bound_a_proof():
    # Contacts on a circle of radius 1 with arms about its centre: wrenches turn rigidly, |w''| = |w_force|.
    circle = contacts_on(ellipse(1, 1), ellipse(1, 1))
    curvature = np.eye(2) * np.hypot(1, 0.5)
    found = gf.plan_global(circle, [(0, 1), (2, 5)], friction=0.5, curvature=curvature, gap=0.01)
    assert found.proven
    exact = gf.Grasp([(1, 0), (-1, 0)], [(-1, 0), (1, 0)], friction=0.5).quality().epsilon
    assert found.quality.epsilon <= exact + 1e-9 <= found.upper + 2e-9


def test_work_limits_end_with_the_gap_reached():
    arguments = (TILE.surface, TILE.bounds)
    options = {"friction": 0.68, "max_normal_force": 10.0, "initial": [-0.175, -0.2, -0.2, -0.0484]}
    cut = gf.plan_global(*arguments, max_boxes=200, **options)
    assert cut.stopped == "target"
    assert cut.upper >= cut.quality.epsilon > 2
    assert gf.plan_global(*arguments, time_limit=0.0, **options).stopped == "time"

    def interrupt(boxes, *_):
        if boxes > 300:
            raise KeyboardInterrupt

    assert gf.plan_global(*arguments, progress=interrupt, **options).stopped == "interrupted"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bounds": [(0, 1)] * 5}, "5 parameters"),
        ({"bounds": [(1, 0), (0, 1)]}, "lower 1.0 is above"),
        ({"gap": 0.0}, "gap: 0.0"),
        ({"safety": 0.5}, "safety: 0.5"),
        ({"curvature": [[1.0]]}, "curvature: shape"),
        ({"initial": [9, 9]}, "outside its bounds"),
        ({"feasible": lambda p, _: np.zeros(len(p), dtype=bool), "max_boxes": 50}, "nothing|none of"),
    ],
)
def test_bad_arguments_are_refused(change, message):
    circle = contacts_on(ellipse(1, 1), ellipse(1, 1))
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan_global(**{"surface": circle, "bounds": [(0, 1), (2, 5)], **change})
