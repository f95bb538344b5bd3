"""Searches from many starts, and searches that are cut short."""

import itertools
import time

import numpy as np
import pytest

import graspforce as gf
from graspforce.surfaces import contacts_on, ellipse

EGG = contacts_on(*[ellipse(0.05, 0.03)] * 3)
BOUNDS = [(0, 2 * np.pi)] * 3
OPTIONS = {"step": 0.5, "tolerance": 0.02, "length_scale": 0.05, "friction": 0.4}


def many(**options):
    return gf.plan_multistart(EGG, **{"bounds": BOUNDS, "starts": 12, "best": 4, **OPTIONS, **options})


def test_the_same_seed_gives_the_same_plans():
    one, other, third = many(seed=3), many(seed=3), many(seed=4)
    np.testing.assert_array_equal(one.starts, other.starts)
    np.testing.assert_array_equal(one.epsilon, other.epsilon)
    assert [p.quality.rho for p in one.plans] == [p.quality.rho for p in other.plans]
    assert not np.array_equal(one.starts, third.starts)


def test_plans_are_sorted_distinct_and_those_of_their_starts():
    found = many(distinct=0.01)
    rho = [plan.quality.rho for plan in found.plans]
    assert rho == sorted(rho)
    assert -rho[0] == pytest.approx(found.epsilon.max(), rel=1e-9)
    for i, one in enumerate(found.plans):
        for other in found.plans[:i]:
            apart = np.linalg.norm(one.grasp.positions[:, None] - other.grasp.positions[None], axis=-1)
            assert apart.min(axis=1).max() > 0.01 or apart.min(axis=0).max() > 0.01
    for start, epsilon in zip(found.starts, found.epsilon, strict=True):
        alone = gf.plan(EGG, start, bounds=BOUNDS, **OPTIONS)
        assert alone.quality.epsilon == pytest.approx(epsilon, rel=1e-9)


def test_infeasible_grasps_are_never_returned():
    def above(positions, normals):
        assert positions.shape == normals.shape
        return (positions[..., 1] > -0.02).all(axis=1)

    found = many(feasible=above, min_distance=0.02)
    for plan in found.plans:
        positions = plan.grasp.positions
        assert (positions[:, 1] > -0.02).all()
        apart = np.linalg.norm(positions[:, None] - positions[None], axis=-1)[np.triu_indices(3, 1)]
        assert apart.min() >= 0.02
        assert plan.counts.infeasible > 0


def test_a_search_from_an_infeasible_start_reaches_what_is_feasible():
    plan = gf.plan(EGG, [1, 1, 1], bounds=BOUNDS, min_distance=0.01, **OPTIONS)
    assert plan.history[0].rho == np.inf
    assert plan.quality.closure == "force"


def test_infeasible_everywhere_is_an_error():
    nothing = {"feasible": lambda positions, _: np.zeros(len(positions), dtype=bool)}
    with pytest.raises(
        gf.InvalidInputError, match="starts: all 600 drawn within the bounds were refused by feasible"
    ):
        many(**nothing)
    with pytest.raises(gf.InvalidInputError, match=r"^feasible: refused all \d+ candidates"):
        gf.plan(EGG, [0, 2, 4], bounds=BOUNDS, **OPTIONS, **nothing)


@pytest.mark.parametrize("feasible", [None, lambda positions, _: np.ones(len(positions), dtype=bool)])
def test_what_refuses_every_candidate_is_named(feasible):
    refused = "feasible and min_distance" if feasible else "min_distance"
    options = {"feasible": feasible, "min_distance": 100.0}
    for search, message in (
        (lambda: gf.plan(EGG, [0, 2, 4], bounds=BOUNDS, **OPTIONS, **options), "^{}: refused all"),
        (lambda: many(**options), "^starts: all .* refused by {}$"),
        (lambda: gf.plan_global(EGG, BOUNDS, length_scale=0.05, max_boxes=20, **options), "^{}: refused all"),
        (lambda: gf.refine(EGG, [0, 2, 4], BOUNDS, **options), "^params: .* refused by {};"),
    ):
        with pytest.raises(gf.InvalidInputError, match=message.format(refused)):
            search()


@pytest.mark.parametrize("answer", [lambda *_: True, lambda p, _: np.ones(len(p)), lambda *_: None])
def test_a_predicate_that_does_not_answer_row_by_row_is_refused(answer):
    with pytest.raises(gf.InvalidInputError, match="feasible: returned"):
        gf.plan(EGG, [0, 2, 4], bounds=BOUNDS, feasible=answer, **OPTIONS)


@pytest.mark.alone
def test_a_target_and_a_time_limit_end_the_search():
    assert many(target=0.1).stopped == "target"
    began = time.monotonic()
    cut = many(starts=5000, time_limit=0.2)
    assert cut.stopped == "time"
    assert time.monotonic() - began < 3
    assert len(cut.plans) >= 1


def interrupting_after(calls, error):
    """Return a surface that fails once it has answered some calls."""
    count = [0]

    def surface(params):
        count[0] += 1
        if count[0] > calls:
            count[0] = 0
            raise error
        return EGG(params)

    return surface


def test_an_interrupt_returns_the_best_so_far():
    plan = gf.plan(interrupting_after(5, KeyboardInterrupt()), [0, 2, 4], bounds=BOUNDS, **OPTIONS)
    assert plan.stopped == "interrupted"
    assert len(plan.history) == 6
    found = gf.plan_multistart(interrupting_after(20, KeyboardInterrupt()), BOUNDS, starts=10, **OPTIONS)
    assert found.stopped == "interrupted"
    assert found.plans


def test_an_error_on_the_way_loses_nothing_found_so_far():
    failure = gf.InvalidInputError("the surface ends here")
    with pytest.raises(gf.InvalidInputError, match="ends here") as raised:
        gf.plan(interrupting_after(5, failure), [0, 2, 4], bounds=BOUNDS, **OPTIONS)
    assert raised.value.partial.quality.rho < 0
    found = gf.plan_multistart(interrupting_after(20, failure), BOUNDS, starts=10, **OPTIONS)
    assert found.failures
    assert found.plans
    assert set(found.failures.values()) == {"the surface ends here"}
    # Each search has calls to itself after a failure: all ten are run, whatever became of those before.
    assert np.isfinite(found.epsilon).sum() + len(found.failures) >= 10
    assert found.stopped == "tolerance"


def holed_disc(low, high):
    """Two contacts on a disc whose normals are unknown for the second between two angles."""

    def surface(angles):
        outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        hole = (angles > low) & (angles < high)
        hole[:, 0] = False
        return 0.1 * outward, np.where(hole[..., None], np.nan, -outward)

    return surface


def test_a_search_that_fails_does_not_stop_the_others():
    starts = [[0, angle] for angle in (2.0, 2.2, 2.4, 2.6, 2.8, 3.6)]
    found = gf.plan_multistart(
        holed_disc(3.08, 3.12), [(0, 0), (1, 5)], 0.1, 0.01, starts=starts, friction=0.5, distinct=0.0
    )
    assert len(found.failures) == 6
    assert np.isfinite(found.epsilon).sum() == 6
    assert found.stopped == "tolerance"
    assert {plan.stopped for plan in found.plans} == {"error"}


def test_starts_without_contacts_do_not_stop_the_others():
    def edge(params):
        with np.errstate(invalid="ignore"):
            angles = np.column_stack([np.zeros(len(params)), 2 + np.sqrt(params[:, 0] - 0.2)])
        outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return 0.1 * outward, -outward

    arguments = (edge, [(0, 2)], 0.01, 0.005)
    drawn = gf.plan_multistart(*arguments, starts=16, friction=0.5)
    assert len(drawn.starts) == 16
    assert (drawn.starts > 0.2).all()
    given = gf.plan_multistart(*arguments, starts=[[0.1], [1.0], [0.05], [1.5]], friction=0.5)
    assert sorted(given.starts[list(given.failures), 0]) == [0.05, 0.1]
    assert np.isfinite(given.epsilon).sum() == 2
    with pytest.raises(gf.InvalidInputError, match="no contacts at some: surface, row 0: positions"):
        gf.plan_multistart(edge, [(0, 0.1)], 0.01, 0.005, starts=2, friction=0.5)


@pytest.mark.parametrize(
    "options",
    [
        {"edges": [4, 8, 12]},
        {"tangents": [(0, 0, 1), (0, 1, 1), (1, 0, 1)]},
        {"extreme_forces": [[(1, 0.3, 0), (1, -0.3, 0.3), (1, 0, -k)] for k in (0.3, 0.4, 0.5)]},
    ],
)
def test_contacts_that_differ_are_not_matched_with_each_other(options):
    ball = contacts_on(*[gf.surfaces.ellipsoid(0.05, 0.05, 0.05)] * 3)
    low, up = [0.1, 0.1], [2.1, 0.2]
    starts = [[*low, *up, 4.2, -0.1], [*up, *low, 4.2, -0.1]]
    arguments = (ball, [(-7, 7)] * 6, 1e-3, 1e-3)
    shared = {"starts": starts, "distinct": 0.01, "length_scale": 0.05, "friction": 0.6, "max_candidates": 9}
    assert len(gf.plan_multistart(*arguments, **shared).plans) == 1
    assert len(gf.plan_multistart(*arguments, **shared, **options).plans) == 2


def test_results_share_no_memory_and_are_read_only():
    found = many(starts=3)
    plan = found.best
    arrays = [found.starts, found.epsilon, plan.params, *(row.params for row in plan.history)]
    arrays += [row.step for row in plan.history]
    for i, array in enumerate(arrays):
        assert array.base is None
        assert not array.flags.writeable
        assert not any(np.shares_memory(array, other) for other in arrays[:i])
    with pytest.raises(AttributeError):
        plan.counts.candidates = 0


def test_progress_is_reported_after_every_search():
    told = []
    found = many(progress=lambda *report: told.append(report))
    assert [done for done, _, _ in told] == list(range(1, 13))
    assert told[-1][2] == found.epsilon.max()
    assert many(progress=True).plans


def test_blocks_are_chosen_where_the_pattern_is_too_large():
    pair = contacts_on(*[ellipse(0.05, 0.03)] * 4)
    plan = gf.plan(pair, [0, 1.5, 3, 4.5], bounds=[*BOUNDS, BOUNDS[0]], max_candidates=9, **OPTIONS)
    assert plan.blocks == ((0,), (1,), (2,), (3,))
    whole = gf.plan(pair, [0, 1.5, 3, 4.5], bounds=[*BOUNDS, BOUNDS[0]], **OPTIONS)
    assert whole.blocks == ((0, 1, 2, 3),)
    assert plan.quality.closure == whole.quality.closure == "force"
    rho = [row.rho for row in plan.history]
    assert all(after <= before + 1e-9 * abs(after) for before, after in itertools.pairwise(rho))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"starts": 0}, "starts: 0"),
        ({"starts": [[0, 0]]}, "starts: shape"),
        ({"starts": [[0, 0, 0], [0, 0, 9]]}, "starts, row 1, entry 2: 9.0 is outside its bounds"),
        ({"starts": 2.5}, "starts: 2.5 is neither a whole number nor an array"),
        ({"starts": None}, "starts: None is not an array of real numbers"),
        ({"rtol": "x"}, "rtol: 'x' is not a real number"),
        ({"tolerance": 0.5, "step": 0.25}, "tolerance, entry 0: 0.5 exceeds the step 0.25"),
        ({"best": 0}, "best: 0"),
        ({"bounds": [(1, 0)] * 3}, "bounds, row 0: lower 1.0 is above upper 0.0"),
        ({"bounds": [0, 1]}, "bounds: shape"),
        ({"step": 0.0}, "step, entry 0: 0.0 must be positive"),
        ({"criterion": "mean"}, "criterion"),
        ({"min_distance": -1}, "min_distance"),
        ({"max_candidates": 2}, "max_candidates: 2 must be at least 3"),
        ({"best": 2.5}, "best: 2.5 is not a whole number"),
        ({"seed": -1}, "seed: -1 must be at least 0"),
        ({"distinct": np.nan}, "distinct: nan"),
        ({"distinct": -1}, "distinct: -1.0 must be at least 0"),
        ({"time_limit": np.nan}, "time_limit: nan"),
        ({"target": np.nan}, "target: nan"),
        ({"progress": 3}, "progress: 3"),
        ({"placement": 3}, "placement: 3 is not a graspforce.PlacementNoise"),
        (
            {"frictoin": 0.5},
            "frictoin: no such option; there are starts, best, .*external_wrench.*, friction, ",
        ),
        ({"positions": 3}, "positions: no such option"),
    ],
)
def test_bad_arguments_are_refused(change, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        many(**change)


@pytest.mark.parametrize("search", [gf.plan, gf.plan_multistart, gf.plan_global, gf.refine])
def test_an_unknown_option_is_answered_by_those_of_the_search_and_of_the_grasp(search):
    start = {gf.plan: {"initial": [0, 2, 4], **OPTIONS}, gf.refine: {"params": [0, 2, 4]}}.get(search, {})
    if search is gf.plan_multistart:
        start = OPTIONS
    with pytest.raises(gf.InvalidInputError, match=r"^center: no such option; .*external_wrench.*friction"):
        search(EGG, bounds=BOUNDS, center=[0, 0, 0], **start)


@pytest.mark.parametrize("size", [1, 2, 4])
def test_a_start_of_another_length_than_the_bounds_is_named(size):
    with pytest.raises(gf.InvalidInputError, match=f"initial: {size} parameters, but bounds has 3 rows"):
        gf.plan(EGG, np.zeros(size), bounds=BOUNDS, **OPTIONS)
    with pytest.raises(gf.InvalidInputError, match=f"params: {size} parameters, but bounds has 3 rows"):
        gf.refine(EGG, np.zeros(size), BOUNDS)


def test_progress_of_one_search_counts_the_halvings_of_its_steps():
    seen = []
    found = gf.plan(EGG, [0, 2, 4], bounds=BOUNDS, progress=lambda *numbers: seen.append(numbers), **OPTIONS)
    done, total, epsilon = zip(*seen, strict=True)
    assert len(seen) == len(found.history) - 1
    assert list(done) == sorted(done)
    assert done[-1] == total[0] == max(total)
    assert epsilon[-1] == -found.history[-1].rho
