"""The pattern search of section 3.4: iterates, ties, bounds, and what it refuses."""

import itertools
import json

import numpy as np
import pytest

import graspforce as gf
from graspforce.paper import RACKET

PLANS = [("three fingers", "max"), ("three fingers", "sum"), ("four fingers", "max"), ("four fingers", "sum")]


def plan_racket(name, criterion):
    problem = RACKET[name]
    return gf.plan(
        problem.surface,
        problem.initial,
        problem.step,
        problem.tolerance,
        problem.bounds,
        criterion,
        friction=problem.friction,
        max_normal_force=problem.max_normal_force,
    )


def squeeze(params):
    """Two fingers on a disc of radius 0.1 m, one parameter each."""
    outward = np.stack([np.cos(params), np.sin(params)], axis=-1)
    return 0.1 * outward, -outward


ARGUMENTS = {
    "surface": squeeze,
    "initial": [0.0, 2.0],
    "step": [0.5, 0.5],
    "tolerance": [0.01, 0.01],
    "bounds": [(0, 1), (1, 4)],
}


@pytest.mark.parametrize(("name", "criterion"), PLANS)
def test_the_racket_plans_visit_the_reference_iterates(racket, name, criterion):
    plan = plan_racket(name, criterion)
    expected = racket[name.replace(" fingers", "_finger")][criterion]
    assert len(plan.history) == len(expected)
    for row, reference in zip(plan.history, expected, strict=True):
        np.testing.assert_allclose(row.params, reference["params"], rtol=0, atol=1e-12)
        np.testing.assert_allclose(row.step, reference["step"], rtol=1e-14)
        assert row.rho == pytest.approx(reference["rho"], rel=1e-9)


@pytest.mark.parametrize("criterion", ["max", "sum"])
def test_the_three_finger_plans_end_where_the_paper_prints(criterion):
    plan, published = plan_racket("three fingers", criterion), RACKET["three fingers"].published[criterion]
    assert len(plan.history) - 1 == published.iterations
    np.testing.assert_allclose(plan.params, published.params, atol=1e-12)


def test_a_plan_reports_the_grasp_and_quality_at_its_end():
    plan = gf.plan(**ARGUMENTS, friction=0.6)
    last = plan.history[-1]
    np.testing.assert_array_equal(plan.params, last.params)
    assert plan.quality.rho == pytest.approx(last.rho, rel=1e-12)
    assert plan.grasp.quality("max").rho == pytest.approx(last.rho, rel=1e-12)
    assert repr(plan).startswith("Plan(params=[")


def test_quality_never_gets_worse_from_one_iterate_to_the_next():
    rho = [row.rho for row in gf.plan(**ARGUMENTS, friction=0.6).history]
    assert all(after <= before + 1e-9 * abs(after) for before, after in itertools.pairwise(rho))


def test_candidates_of_an_iteration_reach_the_surface_in_one_call():
    batches = []

    def counted(params):
        batches.append(params.copy())
        return squeeze(params)

    plan = gf.plan(**{**ARGUMENTS, "surface": counted}, friction=0.6)
    iterations = len(plan.history) - 1
    assert sum(len(batch) > 1 for batch in batches) == iterations
    assert sum(len(batch) for batch in batches if len(batch) > 1) == plan.num_candidates


def test_offsets_run_down_stay_up_with_the_last_parameter_fastest_and_duplicates_merged():
    first = []

    def recorded(params):
        first.append(params.copy())
        return squeeze(params)

    gf.plan(**{**ARGUMENTS, "surface": recorded}, friction=0.6)
    # The first parameter starts at its lower bound, so its step down is its centre.
    np.testing.assert_array_equal(first[0], [[0, 1.5], [0, 2], [0, 2.5], [0.5, 1.5], [0.5, 2], [0.5, 2.5]])


def test_among_equals_the_centre_wins():
    def indifferent(params):
        return squeeze(np.tile([0.0, np.pi], (len(params), 1)))

    plan = gf.plan(indifferent, [0.5, 0.5], 0.25, 0.1, [(0, 1), (0, 1)], friction=0.5)
    assert len(plan.history) == 3
    np.testing.assert_array_equal(plan.params, [0.5, 0.5])


def test_among_equals_off_centre_the_lowest_index_wins():
    def even(params):
        return squeeze(np.hstack([np.zeros_like(params), np.pi - 0.5 + params**2]))

    first = gf.plan(even, [0.0], [0.25], [0.2], [(-1, 1)], friction=0.6).history[1]
    assert first.params[0] == -0.25


def test_only_the_steps_of_parameters_that_stayed_are_halved():
    history = gf.plan(**ARGUMENTS, friction=0.6).history
    for before, after in itertools.pairwise(history):
        stayed = before.params == after.params
        np.testing.assert_array_equal(after.step, np.where(stayed, before.step / 2, before.step))


def test_the_search_never_leaves_its_bounds():
    plan = gf.plan(**{**ARGUMENTS, "bounds": [(0, 0.1), (1.9, 2.2)]}, friction=0.6)
    for row in plan.history:
        assert 0 <= row.params[0] <= 0.1
        assert 1.9 <= row.params[1] <= 2.2


def test_spatial_surfaces_may_return_tangents():
    angles = 2 * np.pi * np.arange(3) / 3

    def ring(params):
        heights = np.repeat(params, 3, axis=1)
        around = np.broadcast_to(angles, heights.shape)
        outward = np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=-1)
        positions = outward + heights[..., None] * [0, 0, 1]
        return positions, -outward, np.broadcast_to([0.0, 0.0, 1.0], positions.shape)

    plan = gf.plan(ring, [0.5], [0.25], [0.01], [(-1, 1)], friction=0.5, edges=8)
    assert plan.quality.rho < 0
    assert plan.grasp.wrench_dim == 6


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bounds": [(0, 1), (4, 1)]}, r"bounds, row 1: lower 4.0 is above upper 1.0"),
        ({"bounds": [(0, 1)]}, "initial: 2 parameters, but bounds has 1 rows"),
        ({"bounds": [0, 1]}, r"bounds: shape \(2,\), expected \(p, 2\)"),
        ({"bounds": [(0, np.inf), (1, 4)]}, r"bounds, entry \(0, 1\): inf is not finite"),
        ({"step": [0.5, 0.0]}, r"step, entry 1: 0.0 must be positive"),
        ({"step": [0.5, -1.0]}, r"step, entry 1: -1.0 must be positive"),
        ({"step": [0.5] * 3}, r"step: shape \(3,\), expected \(2,\)"),
        ({"tolerance": [0.0, 0.1]}, r"tolerance, entry 0: 0.0 must be positive"),
        ({"tolerance": np.nan}, r"tolerance: nan is not finite"),
        ({"initial": [0.0, np.nan]}, r"initial, entry 1: nan is not finite"),
        ({"initial": [0.0, 9.0]}, r"initial, entry 1: 9.0 is outside its bounds \[1.0, 4.0\]"),
        ({"initial": [[0.0, 2.0]]}, r"initial: shape \(1, 2\), expected \(p,\)"),
        ({"initial": []}, r"initial: shape \(0,\), expected \(p,\)"),
        ({"initial": ["a", "b"]}, r"initial: .* is not an array of real numbers"),
        ({"initial": [[1.0], [1.0, 2.0]]}, r"initial: "),
        ({"criterion": "mean"}, r"criterion: 'mean' is neither 'max' nor 'sum'"),
        ({"surface": 3}, r"surface: 3 is not callable"),
        ({"surface": lambda params: params}, r"surface: returned ndarray"),
        ({"surface": lambda _: (1, 2, 3, 4)}, r"surface: returned tuple of 4"),
        ({"surface": lambda params: (params, params)}, r"surface: positions of shape \(\d, 2\), expected"),
        ({"surface": lambda params: (squeeze(params)[0][1:], params)}, r"surface: positions of shape"),
        (
            {"surface": lambda params: (squeeze(params)[0], squeeze(params)[1][:, :1])},
            r"surface: normals of shape \(6, 1, 2\), expected \(6, 2, 2\)",
        ),
        ({"surface": lambda _: ("a", "b")}, r"surface: positions: "),
        (
            {"surface": lambda params: (squeeze(params)[0] * (1 + 0.1j), squeeze(params)[1])},
            r"surface: positions: .* is not an array of real numbers",
        ),
        (
            {"surface": lambda params: (squeeze(params)[0], np.ma.masked_less(squeeze(params)[1], 0))},
            r"surface: normals: some of its entries are masked",
        ),
        (
            {"surface": lambda params: (squeeze(params)[0][:, :0],) * 2, "max_candidates": 3},
            r"surface: positions of shape \(\d, 0, 2\), expected .* with m at least 1",
        ),
    ],
)
def test_bad_arguments_are_refused_by_name_and_value(change, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan(**{**ARGUMENTS, **change}, friction=0.6)


def test_a_surface_without_a_normal_is_refused_with_its_parameters():
    def singular(params):
        positions, normals = squeeze(params)
        normals[params[:, 1] > 2.4, 1] = np.nan
        return positions, normals

    message = r"surface, row 2: normals of contact 1 at parameters \[0.0, 2.5\] are not finite: \[nan, nan\]"
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan(**{**ARGUMENTS, "surface": singular}, friction=0.6)


def test_tangents_from_two_sources_are_refused():
    def ring(params):
        ones = np.ones((len(params), 2, 3))
        return ones, ones, ones

    with pytest.raises(gf.InvalidInputError, match="tangents: the surface returns tangents already"):
        gf.plan(**{**ARGUMENTS, "surface": ring}, tangents=np.ones((2, 3)))


def test_errors_of_the_surface_itself_pass_through():
    def broken(_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        gf.plan(**{**ARGUMENTS, "surface": broken})


def test_the_callers_arrays_are_left_alone():
    arrays = {
        name: np.array(ARGUMENTS[name], dtype=float) for name in ("initial", "step", "tolerance", "bounds")
    }
    before = {name: array.copy() for name, array in arrays.items()}
    gf.plan(squeeze, **arrays, friction=0.6)
    for name, array in arrays.items():
        np.testing.assert_array_equal(array, before[name])


@pytest.mark.parametrize("dtype", [np.int64, np.float32])
def test_integers_and_single_precision_search_like_doubles(dtype):
    exact = {"initial": [0, 2], "step": [1, 1], "tolerance": [0.125, 0.125], "bounds": [(0, 1), (1, 4)]}
    typed = {
        name: np.array(value, dtype=dtype if name != "tolerance" else float) for name, value in exact.items()
    }
    assert (
        gf.plan(squeeze, **typed, friction=0.6).quality.rho
        == gf.plan(squeeze, **exact, friction=0.6).quality.rho
    )


def test_a_surface_that_writes_into_its_argument_moves_nothing():
    def careless(params):
        positions, normals = squeeze(params)
        params += 100
        return positions, normals

    plain, found = (gf.plan(**{**ARGUMENTS, "surface": surface}) for surface in (squeeze, careless))
    np.testing.assert_array_equal(found.params, plain.params)
    assert found.quality.rho == plain.quality.rho


def test_the_number_of_contacts_may_not_change_between_calls():
    calls = []

    def growing(params):
        calls.append(len(params))
        positions, normals = squeeze(params)
        return (positions, normals) if len(calls) < 3 else (positions[:, :1], normals[:, :1])

    with pytest.raises(gf.InvalidInputError, match=r"surface: returned .*\(1, 2\).* but .*\(2, 2\).* before"):
        gf.plan(**{**ARGUMENTS, "surface": growing})


def test_options_are_checked_before_the_surface_is_asked():
    def never(_):
        raise AssertionError

    for search in (gf.plan, gf.plan_multistart, gf.refine, gf.plan_global):
        given = {"plan": ([0.0], 0.1, 0.1, [(0, 1)]), "plan_multistart": ([(0, 1)], 0.1, 0.1),
                 "refine": ([0.0], [(0, 1)]), "plan_global": ([(0, 1)],)}[search.__name__]  # fmt: skip
        with pytest.raises(gf.InvalidInputError, match="normals: no such option"):
            search(never, *given, normals=3)
        with pytest.raises(gf.InvalidInputError, match="criterion: 'mean' is neither 'max' nor 'sum'"):
            search(never, *given, criterion="mean")


def test_a_plan_from_an_infeasible_start_can_be_written_and_drawn():
    found = gf.plan(**ARGUMENTS, min_distance=0.18)
    assert found.history[0].rho == np.inf
    written = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert written["history"][0]["rho"] is None
    assert written["counts"]["candidates"] == found.num_candidates
    figure = pytest.importorskip("matplotlib.figure").Figure()
    from graspforce.plotting import draw_plan_history  # noqa: PLC0415 - matplotlib only where it is installed

    (line,) = draw_plan_history(figure.subplots(), found)
    assert list(line.get_xdata()) == list(range(1, len(found.history)))
    assert np.isfinite(line.get_ydata()).all()
