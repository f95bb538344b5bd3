"""Branch and bound: its bound holds everywhere, its gap closes, and it finds what a grid finds."""

import heapq
import itertools

import numpy as np
import pytest
from benches.trust import global_bounds

import graspforce as gf
from graspforce._core import BoxBound
from graspforce.paper import RACKET, TILE
from graspforce.planning import box_tree
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
    assert found.gap <= 0.005 + 1e-12
    assert found.proven
    axes = [np.linspace(*bound, 60 if len(problem.bounds) == 3 else 22) for bound in problem.bounds]
    params = np.array(list(itertools.product(*axes)))
    best = gf.quality_many(*problem.surface(params), **options, criterion=criterion).epsilon.max()
    assert best <= found.epsilon_upper
    assert found.quality.epsilon >= best / 1.005


def test_given_curvature_makes_the_bound_a_proof():
    # Contacts on a circle of radius 1 with arms about its centre: wrenches turn rigidly, |w''| = |w_force|.
    circle = contacts_on(ellipse(1, 1), ellipse(1, 1))
    curvature = np.eye(2) * np.hypot(1, 0.5)
    found = gf.plan_global(circle, [(0, 1), (2, 5)], friction=0.5, curvature=curvature, gap=0.01)
    assert found.proven
    assert found.stopped == "tolerance"
    exact = gf.Grasp([(1, 0), (-1, 0)], [(-1, 0), (1, 0)], friction=0.5).quality().epsilon
    assert found.quality.epsilon <= exact + 1e-9 <= found.epsilon_upper + 2e-9


def test_work_limits_end_with_the_gap_reached():
    arguments = (TILE.surface, TILE.bounds)
    contacts = {"friction": 0.68, "max_normal_force": 10.0, "tangents": [(1, 0, 0)] * 4}
    options = {**contacts, "initial": [-0.175, -0.2, -0.2, -0.0484]}
    cut = gf.plan_global(*arguments, max_boxes=200, **options)
    assert cut.stopped == "boxes"
    # The bound is one on grasps it has not seen, and the gap is what it says.
    params = np.random.default_rng(4).uniform(*np.array(TILE.bounds).T, (2000, 4))
    seen = gf.quality_many(*TILE.surface(params), **contacts, rtol=1e-3).epsilon.max()
    longer = gf.plan_global(*arguments, max_boxes=8000, **options)
    assert seen <= longer.epsilon_upper < cut.epsilon_upper
    assert cut.gap == (cut.epsilon_upper - cut.quality.epsilon) / cut.quality.epsilon
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
        ({"initial": [9, 9]}, "initial, entry 0: 9.0 is outside its bounds"),
        ({"initial": [0.5]}, r"initial: shape \(1,\), expected \(2,\)"),
        ({"initial": [[0.5, 3]]}, r"initial: shape \(1, 2\), expected \(2,\)"),
        ({"safety": np.inf}, "safety: inf"),
        ({"max_boxes": -1}, "max_boxes: -1"),
        ({"time_limit": np.nan}, "time_limit: nan"),
        ({"progress": "yes"}, "progress: 'yes'"),
        (
            {"feasible": lambda p, _: np.zeros(len(p), dtype=bool), "max_boxes": 50},
            r"feasible: refused all \d+ grasps",
        ),
    ],
)
def test_bad_arguments_are_refused(change, message):
    circle = contacts_on(ellipse(1, 1), ellipse(1, 1))
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan_global(**{"surface": circle, "bounds": [(0, 1), (2, 5)], **change})


def test_one_number_is_where_all_parameters_start():
    surface, bounds = on_a_disc(lambda _: 0, lambda p: p[0]), [(2.5, 3.5)]
    one, listed = (gf.plan_global(surface, bounds, initial=start, friction=0.3) for start in (3.0, [3.0]))
    assert one.params.tolist() == listed.params.tolist()


def on_a_disc(*angles_of):
    """Contacts on a unit disc whose angles are functions of the parameters."""

    def surface(params):
        angles = np.stack([np.broadcast_to(angle(params.T), len(params)) for angle in angles_of], axis=1)
        outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return outward, -outward

    return surface


@pytest.mark.parametrize(
    ("surface", "bounds"),
    [
        (on_a_disc(lambda _: 0, lambda p: p[0], lambda p: 2.1 + p[1]), [(0, 4 * np.pi), (0, 1)]),
        (on_a_disc(lambda _: 0, lambda p: 2 + p[0] ** 2, lambda p: 4 + p[1]), [(-1, 1), (0, 0.5)]),
    ],
)
def test_boxes_are_cut_along_periodic_and_even_parameters(surface, bounds):
    found = gf.plan_global(surface, bounds, friction=0.3, max_boxes=3000)
    assert found.stopped == "estimate"
    assert found.boxes < 1000


@pytest.mark.parametrize("criterion", ["max", "sum"])
@pytest.mark.parametrize("edges", [8, None])
def test_no_closure_within_the_bounds_is_proven(criterion, edges):
    ball = contacts_on(*[gf.surfaces.ellipsoid(1.0, 1.0, 1.0)] * 3)
    surface = gf.surfaces.tied(ball, np.eye(6)[:, :2], [0, 0, 0.9, 0.1, 0.4, 0.8])
    bounds, options = [(-0.5, 0.5), (-0.5, 0.2)], {"friction": 0.4, "edges": edges, "criterion": criterion}
    tangents = [(0, 0, 1)] * 3
    found = gf.plan_global(surface, bounds, tangents=tangents, max_boxes=2000, **options)
    assert found.stopped in ("tolerance", "open")
    assert found.proven
    assert found.quality.epsilon <= found.epsilon_upper < 0
    params = np.random.default_rng(0).uniform(*np.array(bounds).T, (400, 2))
    epsilon = gf.quality_many(*surface(params), tangents=tangents, **options).epsilon
    assert epsilon.max() <= found.epsilon_upper + 1e-9


def test_a_box_without_width_ends_with_its_own_grasp():
    surface = on_a_disc(lambda _: 0, lambda p: p[0], lambda p: p[1])
    for angles in ((0.5, 0.7), (2.0, 4.0)):
        found = gf.plan_global(surface, [(angle, angle) for angle in angles], friction=0.3, max_boxes=100)
        assert found.stopped == "estimate"
        assert found.boxes == 1
        assert found.epsilon_upper == pytest.approx(found.quality.epsilon, abs=1e-6)


def test_an_interrupt_between_boxes_loses_none(monkeypatch):
    class Interrupting:
        """A heap queue that is interrupted once, right after it gave a box away."""

        def __init__(self):
            self.pops = 0

        def heappop(self, heap):
            self.pops += 1
            entry = heapq.heappop(heap)
            if self.pops == 30:
                raise KeyboardInterrupt
            return entry

        heappush = staticmethod(heapq.heappush)

    monkeypatch.setattr(box_tree, "heapq", Interrupting())
    surface = on_a_disc(lambda _: 0, lambda p: p[0], lambda p: p[1])
    found = gf.plan_global(surface, [(0.5, 3.0), (3.2, 6.0)], friction=0.3)
    assert found.stopped == "interrupted"
    best = gf.Grasp(*(a[0] for a in surface(np.array([[2 * np.pi / 3, 4 * np.pi / 3]]))), friction=0.3)
    assert found.epsilon_upper >= best.quality().epsilon


def test_an_error_on_the_way_keeps_what_was_found():
    calls = [0]
    disc = on_a_disc(lambda _: 0, lambda p: p[0], lambda p: p[1])

    def failing(params):
        calls[0] += 1
        if calls[0] == 12:
            raise gf.InvalidInputError("the surface ends here")
        return disc(params)

    with pytest.raises(gf.InvalidInputError, match="ends here") as raised:
        gf.plan_global(failing, [(0.5, 3.0), (3.2, 6.0)], friction=0.3)
    found = raised.value.partial
    assert found.stopped == "error"
    whole = gf.plan_global(disc, [(0.5, 3.0), (3.2, 6.0)], friction=0.3)
    assert found.quality.epsilon <= whole.epsilon_upper
    assert found.epsilon_upper >= whole.quality.epsilon


def test_nothing_is_asked_beyond_the_bounds_not_even_by_rounding():
    # -1 + (0.1 - -1) is more than 0.1.
    bounds = [(-1, 0.1), (2.8, 3.5)]
    disc = on_a_disc(lambda p: p[0], lambda p: p[1])
    lower, upper = np.array(bounds, dtype=float).T

    def bounded(params):
        assert ((params >= lower) & (params <= upper)).all(), params
        return disc(params)

    assert gf.plan_global(bounded, bounds, friction=0.6, gap=0.05).stopped == "estimate"


def test_bounds_on_narrow_bumps_are_never_exceeded_or_called_estimates():
    for row in global_bounds.rows(0.1):
        assert (row.missed, row.wrong) == (0, 0), row


def test_an_estimate_says_so_in_its_status_and_its_repr():
    disc = on_a_disc(lambda _: 0, lambda p: p[0], lambda p: p[1])
    bounds = [(1.5, 2.5), (3.8, 4.5)]
    found = gf.plan_global(disc, bounds, friction=0.3)
    assert found.stopped == "estimate"
    assert "(estimate)" in repr(found)
    bends = np.array([[0, 0], [1, 0], [0, 1]]) * np.hypot(1, 0.3)
    proof = gf.plan_global(disc, bounds, friction=0.3, curvature=bends)
    assert proof.stopped == "tolerance"
    assert "(proven)" in repr(proof)
    assert proof.gap == (proof.epsilon_upper - proof.quality.epsilon) / proof.quality.epsilon <= 0.01


def test_progress_may_be_a_bar():
    disc = on_a_disc(lambda _: 0, lambda p: p[0], lambda p: p[1])
    assert gf.plan_global(disc, [(1.5, 2.5), (3.8, 4.5)], friction=0.3, progress=True).boxes > 1


@pytest.mark.parametrize(("criterion", "most"), [("max", 3.0), ("sum", 2.0)])
def test_before_boxes_are_small_the_forces_bound_the_best_quality(criterion, most):
    surface = contacts_on(*[ellipse(2.0, 1.0)] * 2)
    options = {"criterion": criterion, "friction": 0.75, "max_normal_force": [0.8, 1.6]}
    found = gf.plan_global(surface, [(0, 6)] * 2, max_boxes=50, **options)
    assert found.stopped == "boxes"
    assert found.proven
    assert found.epsilon_upper <= most + 1e-12
