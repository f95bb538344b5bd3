"""Gradient refinement: the chain rule is right, nothing gets worse, stationary points are recognised."""

import time

import numpy as np
import pytest
import trimesh
from benches.refine import problem
from scipy import optimize

import graspforce as gf
from graspforce.paper import RACKET, tile_side
from graspforce.planning.bundle_ascent import _Ascent
from graspforce.planning.frame_spins import contact_frames
from graspforce.planning.problem import SearchProblem
from graspforce.planning.walls import within
from graspforce.surfaces import MeshSurface, contacts_on, ellipse, mirrored

TILE_OPTIONS = {"friction": 0.68, "max_normal_force": 10.0}


def ascent(surface, bounds, criterion="max", **options):
    lower, upper = np.array(bounds, dtype=float).T
    problem = SearchProblem.of(gf.refine, surface, options, None, 0.0, criterion=criterion)
    return _Ascent(problem, lower, lower, upper, 1e-3, 0)


@pytest.mark.parametrize("edges", [10, None])
@pytest.mark.parametrize("criterion", ["max", "sum"])
def test_slopes_by_the_chain_rule_are_those_of_differences(criterion, edges):
    # Untied and without symmetry, so that the worst direction is the only one.
    untied = contacts_on(*(tile_side(side) for side in ("upper", "upper", "lower", "lower")))
    climb = ascent(untied, [(-0.2, 0.2)] * 8, criterion, **TILE_OPTIONS, edges=edges)
    params = np.array([-0.17, -0.15, 0.16, 0.13, -0.19, -0.05, 0.18, 0.07])
    quality = climb._quality(params)
    assert quality.gradient.unique
    pieces = climb._surroundings(params[None], params, quality.epsilon).pieces
    slopes = pieces.slopes[pieces.gaps.argmin()]
    source, step = climb._source, 1e-6
    for axis in range(8):
        move = step * np.eye(8)[axis]
        rtol = 1e-12 if edges else 1e-10
        ends = [source.grasp(params + sign * move).quality(criterion, rtol=rtol).epsilon for sign in (1, -1)]
        # By a full range of 0.4 m.
        assert slopes[axis] == pytest.approx(0.4 * (ends[0] - ends[1]) / (2 * step), rel=2e-3, abs=2e-3)


@pytest.mark.parametrize("name", ["three fingers", "four fingers"])
@pytest.mark.parametrize("criterion", ["max", "sum"])
def test_refinement_improves_the_racket_towards_its_global_optimum(name, criterion):
    problem = RACKET[name]
    options = {"friction": problem.friction, "max_normal_force": problem.max_normal_force}
    found = gf.plan(
        problem.surface,
        problem.initial,
        problem.step,
        problem.tolerance,
        problem.bounds,
        criterion,
        **options,
    )
    better = gf.refine(problem.surface, found.params, problem.bounds, criterion, **options)
    assert better.gain >= 0
    assert better.quality.epsilon == pytest.approx(found.quality.epsilon + better.gain, rel=1e-12)
    lower, upper = np.array(problem.bounds).T
    assert ((better.params >= lower) & (better.params <= upper)).all()
    assert better.gain > 0 or better.stationary
    bound = gf.plan_global(
        problem.surface, problem.bounds, criterion, gap=0.01, initial=better.params, **options
    )
    assert better.quality.epsilon <= bound.epsilon_upper


@pytest.mark.parametrize("seed", range(6))
def test_refinement_never_worsens_a_grasp_of_a_mesh(seed):
    random = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=3)
    mesh.apply_scale(random.uniform(0.02, 0.06, 3))
    surface = contacts_on(*[MeshSurface(mesh)] * 3)
    bounds = np.tile(surface_bounds(mesh), (3, 1))
    start = random.uniform(*bounds.T)
    options = {"length_scale": 0.04, "edges": 8}
    before = gf.Grasp(*(array[0] for array in surface(start[None])), **options).quality().epsilon
    better = gf.refine(surface, start, bounds, max_iterations=15, **options)
    assert better.quality.epsilon >= before
    assert better.gain == pytest.approx(better.quality.epsilon - before, abs=1e-9)


def surface_bounds(mesh):
    return np.array(mesh.bounds).T


def beside_an_edge(distance):
    """Return a refinement of contacts on a box, and a start with the first one so far from an edge."""
    box = MeshSurface(trimesh.creation.box((0.08, 0.06, 0.04)), normals="face")
    start = np.array([0.04 - distance, 0.01, 0.02, -0.04, 0.0, 0.0])
    climb = ascent(contacts_on(box, box), np.tile(box.bounds, (2, 1)), friction=0.5, length_scale=0.04)
    return climb, start


@pytest.mark.parametrize("distance", [1e-3, 6e-8])
def test_a_difference_that_meets_an_edge_is_taken_on_the_face_of_the_contact(distance):
    climb, start = beside_an_edge(distance)
    found = climb._surroundings(start[None], start, 0.0)
    by_params = found.moves / climb._range[:, None, None]
    np.testing.assert_allclose(by_params[:3, 0], np.diag([1.0, 1.0, 0.0]), atol=1e-6)
    assert found.flat.all()
    # Into the box leads nowhere.
    np.testing.assert_allclose(found.moved(np.eye(6)), np.diag([1.0, 1, 0, 0, 1, 1]), atol=1e-6)


@pytest.mark.parametrize("distance", [1e-3, 6e-8])
def test_steps_stay_on_their_side_of_an_edge(distance):
    climb, start = beside_an_edge(distance)
    found = climb._surroundings(start[None], start, 0.0)
    across = start + np.array([2 * distance, 1e-4, -5e-4, 0, 0, 0])
    climb._look_for_walls(found, across[None], start)
    walls = climb._walls.beside(found.here)
    assert (len(walls), walls.contacts.tolist()) == (1, [0])
    limits = walls.limits(found.here, found.moves, margin=0.0)
    np.testing.assert_allclose(limits[1] * climb._range[0], distance, rtol=1e-6)
    moves = np.random.default_rng(0).normal(size=(50, 6)) * 0.1
    ends = start + found.moved(within(limits, moves) * climb._range)
    assert (ends[:, 0] <= 0.04 + 1e-15).all()
    assert (ends[:, 0] > 0.04 - 1e-9).any()


def test_contacts_slide_along_edges_to_better_grasps():
    # A refinement that stopped at the edge ended at 0.3236.
    _, surface, bounds, _, options = problem(44)
    start = [-0.011796, 0.03568, -0.025414, -0.025438, 0.007964, 0.031876, 0.021588, 0.008357, 0.012995]
    better = gf.refine(surface, start, bounds, **options)
    assert better.quality.epsilon >= 0.3244


def test_two_opposite_fingers_on_a_disc_are_stationary():
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    ended = gf.refine(disc, [0.5, 0.5 + np.pi], [(0, 1), (2, 5)], friction=0.4, length_scale=0.1)
    assert ended.stationary
    assert ended.gain <= 1e-9


def test_a_parameter_at_its_bound_stays_within_it():
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    ended = gf.refine(disc, [0.2, 3.0], [(0.2, 0.2), (2.5, 3.1)], friction=0.4, length_scale=0.1)
    np.testing.assert_allclose(ended.params, [0.2, 3.1], atol=1e-6)
    assert ended.stationary


def test_bad_starts_are_refused():
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    with pytest.raises(gf.InvalidInputError, match=r"params: .* refused by min_distance"):
        gf.refine(disc, [0.0, 0.0], [(0, 1), (0, 1)], min_distance=0.01)
    with pytest.raises(gf.InvalidInputError, match="tolerance"):
        gf.refine(disc, [0.0, 0.0], [(0, 1), (0, 1)], tolerance=0)
    with pytest.raises(gf.InvalidInputError, match=r"params, entry 1: 2\.0 is outside its bounds"):
        gf.refine(disc, [0.0, 2.0], [(0, 1), (0, 1)])
    with pytest.raises(gf.InvalidInputError, match="seed: -1"):
        gf.refine(disc, [0.0, 0.5], [(0, 1), (0, 1)], seed=-1)
    with pytest.raises(gf.InvalidInputError, match="max_iterations: -1"):
        gf.refine(disc, [0.0, 0.5], [(0, 1), (0, 1)], max_iterations=-1)


def test_an_error_on_the_way_keeps_the_best_so_far():
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    calls = [0]

    def failing(params):
        calls[0] += 1
        if calls[0] == 8:
            raise gf.InvalidInputError("the surface ends here")
        return disc(params)

    with pytest.raises(gf.InvalidInputError, match="ends here") as raised:
        gf.refine(failing, [0.0, 2.8], [(0, 1), (1, 4)], friction=0.4, length_scale=0.1)
    found = raised.value.partial
    assert found.gain > 0
    assert found.quality.epsilon == found.grasp.quality().epsilon


def test_the_gradient_alone_is_that_of_the_quality():
    untied = contacts_on(*(tile_side(side) for side in ("upper", "upper", "lower", "lower")))
    params = np.array([[-0.17, -0.15, 0.16, 0.13, -0.19, -0.05, 0.18, 0.07]])
    grasp = gf.Grasp(*(array[0] for array in untied(params)), **TILE_OPTIONS)
    for criterion in ("max", "sum"):
        alone, asked = grasp._gradient(criterion), grasp.quality(criterion).gradient
        for name in ("positions", "normals", "spins"):
            np.testing.assert_array_equal(getattr(alone, name), getattr(asked, name))


@pytest.mark.parametrize("tangents", [None, [(1.0, 0.2, 0.1), (0, 1.0, 0), (0.3, 0.1, 1.0), (1.0, 1.0, 1.0)]])
def test_frames_of_many_grasps_at_once_are_those_of_each(tangents):
    untied = contacts_on(*(tile_side(side) for side in ("upper", "upper", "lower", "lower")))
    climb = ascent(untied, [(-0.2, 0.2)] * 8, **TILE_OPTIONS, tangents=tangents)
    params = np.random.default_rng(0).uniform(-0.2, 0.2, (6, 8))
    contacts = climb._source.contacts(params)
    each = [climb._source.grasp_of(contacts, row).frames for row in range(6)]
    np.testing.assert_array_equal(contact_frames(contacts, tangents), each)


def never_beyond(surface, bounds):
    """Return the surface, which is then asked for nothing beyond its bounds, not even by rounding."""
    lower, upper = np.array(bounds, dtype=float).T

    def bounded(params):
        assert ((params >= lower) & (params <= upper)).all(), params
        return surface(params)

    return bounded


def test_bounds_are_kept_to_the_last_bit():
    # -1 + (0.1 - -1) is more than 0.1.
    bounds = [(-1, 0.1), (3.5, 4)]
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    ended = gf.refine(
        never_beyond(disc, bounds), [-0.2, 3.6], bounds, friction=0.9, length_scale=0.1, max_iterations=30
    )
    assert ended.params.tolist() == [0.1, 3.5]


@pytest.mark.parametrize("width", [1e-12, 2.5e-10, 1e-9])
def test_bounds_closer_than_differences_can_tell_hold_a_parameter_still(width):
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    options = {"friction": 0.4, "length_scale": 0.1}
    ended = gf.refine(disc, [1.0, 3.9], [(1.0, 1.0 + width), (3.5, 5)], **options)
    assert ended.params[1] - 1 == pytest.approx(np.pi, abs=1e-3)
    assert np.isfinite(ended.slope)


def test_least_squares_that_do_not_end_keep_the_best_so_far(monkeypatch):
    disc = contacts_on(ellipse(0.1, 0.1), ellipse(0.1, 0.1))
    solve, calls = optimize.nnls, []

    def giving_up(matrix, right):
        calls.append(right)
        if len(calls) > 40:
            raise RuntimeError("Maximum number of iterations reached.")
        return solve(matrix, right)

    monkeypatch.setattr(optimize, "nnls", giving_up)
    with pytest.raises(gf.NotConvergedError, match="Maximum number") as raised:
        gf.refine(disc, [0.0, 2.8], [(0, 1), (1, 4)], friction=0.4, length_scale=0.1)
    assert raised.value.partial.gain > 0


ROUGH = {"friction": 0.3, "length_scale": 0.05}


def ending_after(seconds=np.inf, calls=np.inf):
    """Return a surface that sleeps so long in each call, and presses Ctrl-C in one of them."""
    egg = contacts_on(*[ellipse(0.05, 0.03)] * 3)
    count = [0]

    def surface(params):
        count[0] += 1
        if count[0] == calls:
            raise KeyboardInterrupt
        if seconds < np.inf:
            time.sleep(seconds)
        return egg(params)

    return surface


@pytest.mark.alone
@pytest.mark.parametrize("limit", [0.0, 0.1, 0.5])
def test_the_time_limit_ends_a_refinement_between_two_evaluations(limit):
    began = time.monotonic()
    surface, start = ending_after(seconds=0.03), [0.1, 2.5, 4.0]
    ended = gf.refine(surface, start, [(-2, 8)] * 3, time_limit=limit, **ROUGH)
    # The quality of the start and one gradient, with its differences, may still follow.
    assert time.monotonic() - began < limit + 0.5
    assert ended.stopped == "time"
    assert ended.gain >= 0


@pytest.mark.parametrize("calls", [4, 7, 20, 41])
def test_an_interrupted_refinement_returns_the_best_so_far(calls):
    bounds, start = [(-2, 8)] * 3, [0.1, 2.5, 4.0]
    whole = gf.refine(ending_after(), start, bounds, **ROUGH)
    ended = gf.refine(ending_after(calls=calls), start, bounds, **ROUGH)
    assert ended.stopped == "interrupted"
    assert 0 <= ended.gain <= whole.gain
    assert whole.stopped in ("tolerance", "iterations")


def test_a_refinement_stops_at_its_target_and_at_its_iterations():
    bounds, start = [(-2, 8)] * 3, [0.1, 2.5, 4.0]
    first = gf.refine(ending_after(), start, bounds, max_iterations=0, **ROUGH)
    assert (first.stopped, first.gain) == ("iterations", 0)
    whole = gf.refine(ending_after(), start, bounds, **ROUGH)
    half = first.quality.epsilon + whole.gain / 2
    ended = gf.refine(ending_after(), start, bounds, target=half, **ROUGH)
    assert ended.stopped == "target"
    assert half <= ended.quality.epsilon
    assert ended.iterations < whole.iterations


@pytest.mark.parametrize("thickness", [0.02, 0.001])
@pytest.mark.parametrize("torsion", [0.0, 0.005])
def test_contacts_that_start_in_the_middle_of_a_mesh_turn_to_either_side(thickness, torsion):
    mesh = MeshSurface(trimesh.creation.box((0.06, 0.04, thickness)), normals="face")
    half = np.array([0.03, 0.02, thickness / 2])
    rng = np.random.default_rng(2)
    for start in (np.zeros(6), np.r_[np.zeros(3), half], rng.uniform(-1, 1, 6) * np.tile(half, 2)):
        bounds = np.tile(np.column_stack([-half, half]), (2, 1))
        options = {"torsion": torsion, "length_scale": 0.03, "max_iterations": 30}
        found = gf.refine(contacts_on(mesh, mesh), start, bounds, friction=0.5, **options)
        assert np.isfinite(found.quality.epsilon)
        assert found.gain >= 0


def test_a_grasp_is_called_stationary_only_where_it_was_measured():
    disc = ellipse(1.0, 0.5)
    four = mirrored(contacts_on(disc, disc, disc, disc), normal=(1, 0))
    options = {"friction": 0.9, "max_normal_force": 1e-3}
    for end in ({"max_iterations": 1}, {"target": 3.15e-3}):
        found = gf.refine(four, [0] * 4, [(0, 3.14)] * 4, seed=216, **end, **options)
        step = 1e-5 * 3.14 * np.array([0.7, 0, 0, 0.7])
        (further,) = gf.quality_many(*four((found.params + step)[None]), **options).epsilon
        assert further > found.quality.epsilon * (1 + 1e-6)
        assert not found.stationary
