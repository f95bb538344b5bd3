"""Results travel: through pickles, copies, JSON and notebooks."""

import copy
import json
import pickle
import signal
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import graspforce as gf

POSITIONS = [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)]
NORMALS = [(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0)]


def spatial_grasp(**options):
    return gf.Grasp(POSITIONS, NORMALS, friction=0.6, max_normal_force=20.0, length_scale=0.04, **options)


def planar_grasp():
    return gf.Grasp([(-1, 0.1), (1, 0), (0, 1)], [(1, 0), (-1, 0), (0, -1)], friction=[0.5, 0.5, 0])


def squeezed_disc():
    def disc(angles):
        outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return 0.1 * outward, -outward

    return gf.plan(disc, [0.0, 2.0], step=0.5, tolerance=1e-2, bounds=[(0, 1), (1, 4)], friction=0.6)


RESULTS = {
    "grasp": spatial_grasp,
    "planar quality": lambda: planar_grasp().quality("sum"),
    "quality about a weight": lambda: spatial_grasp().quality("max", 1e-6, [0, 0, -1, 0, 0, 0], np.eye(6)),
    "gradient": lambda: spatial_grasp().quality("max").gradient,
    "planar gradient": lambda: planar_grasp().quality("max").gradient,
    "batch": lambda: gf.quality_many([POSITIONS] * 2, [NORMALS, np.zeros((3, 3))]),
    "many forces": lambda: gf.forces_many(
        [POSITIONS] * 2,
        [NORMALS, np.zeros((3, 3))],
        [[0, 0, -1.0, 0, 0, 0]],
        infeasible="nearest",
        gradient=True,
    ),
    "surrogates": lambda: gf.surrogates.min_weight([POSITIONS] * 2, [NORMALS, np.zeros((3, 3))]),
    "points": lambda: planar_grasp().minkowski_sum(),
    "plan": squeezed_disc,
}


def numbers(result):
    """Return a result as JSON text, in which equal numbers are equal strings."""
    return json.dumps(result.to_dict(), allow_nan=False)


@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS)
def test_a_result_survives_pickles_and_deep_copies(make):
    result = make()
    for again in (*(pickle.loads(pickle.dumps(result, p)) for p in range(2, 6)), copy.deepcopy(result)):
        assert type(again) is type(result)
        assert repr(again) == repr(result)
        assert numbers(again) == numbers(result)


@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS)
def test_a_result_can_be_written_as_json(make):
    assert json.loads(numbers(make()))


def test_a_restored_quality_still_knows_its_gradient():
    quality = spatial_grasp().quality(
        "max", external_wrench=[0, 0, -1, 0, 0, 0], metric=np.diag([1, 1, 1, 9, 9, 9.0])
    )
    again = pickle.loads(pickle.dumps(quality))
    np.testing.assert_array_equal(again.gradient.positions, quality.gradient.positions)
    assert (again.criterion, again.grasp.num_contacts) == ("max", 3)


def test_a_quality_does_not_change_with_the_arrays_it_was_asked_with():
    external_wrench, metric = np.array([0, 0, -1.0, 0, 0, 0]), np.diag([1, 1, 1, 9, 9, 9.0])
    quality = spatial_grasp().quality("max", external_wrench=external_wrench, metric=metric)
    external_wrench[:], metric[:] = 0, np.eye(6)
    for again in (copy.deepcopy(quality), pickle.loads(pickle.dumps(quality))):
        np.testing.assert_array_equal(again.gradient.positions, quality.gradient.positions)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="timers")
def test_a_signal_handler_may_ask_for_the_gradient_that_is_being_computed():
    quality = spatial_grasp(edges=None).quality("max", rtol=1e-3)
    asked = []
    before = signal.signal(signal.SIGALRM, lambda *_: asked.append(quality.gradient.unique))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.001)
        unique = quality.gradient.unique
        signal.setitimer(signal.ITIMER_REAL, 0)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert all(one == unique for one in asked)
    assert quality.gradient is quality.gradient


def test_an_array_without_a_copy_is_given_or_refused():
    points = planar_grasp().minkowski_sum()
    assert np.array(points, copy=False) is points.wrenches
    with pytest.raises(ValueError, match="without a copy"):
        points.__array__(np.float32, copy=False)
    solution = gf.ForceDistributor(planar_grasp()).solve([0, -1, 0])
    with pytest.raises(ValueError, match="a copy cannot be avoided"):
        solution.__array__(copy=False)
    assert np.asarray(solution, dtype=np.float32).dtype == np.float32
    assert np.array(points) is not points.wrenches


def test_restored_points_stay_read_only_and_keep_their_index_matrix():
    points = planar_grasp().minkowski_sum()
    again = pickle.loads(pickle.dumps(points))
    assert not again.wrenches.flags.writeable
    np.testing.assert_array_equal(again.to_scipy().toarray(), points.to_scipy().toarray())


def test_points_are_an_array_where_numpy_wants_one():
    points = planar_grasp().minkowski_sum()
    assert np.asarray(points) is points.wrenches
    assert np.array(points).flags.writeable
    assert np.asarray(points, dtype=np.float32).dtype == np.float32


def test_a_batch_keeps_its_failed_rows():
    batch = pickle.loads(pickle.dumps(gf.quality_many([POSITIONS] * 2, [NORMALS, np.zeros((3, 3))])))
    assert batch.status.tolist() == [0, 2]
    assert "normals" in batch.errors[1]
    assert batch.to_dict()["epsilon"][1] is None


@pytest.mark.parametrize("name", ["grasp", "planar quality", "batch", "plan"])
def test_a_notebook_shows_a_table(name):
    shown = RESULTS[name]()._repr_html_()
    assert shown.startswith("<table>")
    assert shown.count("<tr>") == shown.count("</tr>") > 1


def test_a_long_batch_is_cut_short_in_a_notebook():
    batch = gf.quality_many([POSITIONS] * 50, [NORMALS] * 50)
    assert "40 more" in batch._repr_html_()


def test_a_tampered_pickle_is_refused():
    grasp = spatial_grasp()
    restore, state = grasp.quality("max").__reduce__()
    with pytest.raises(gf.InvalidInputError, match="closure"):
        restore(*state[:7], (True, "half", 1), *state[8:])


def test_results_say_what_was_asked():
    grasp, wrench, metric = planar_grasp(), [0, -0.1, 0], np.diag([1, 1, 4.0])
    quality = grasp.quality("sum", 1e-6, wrench, metric, 500)
    plain = grasp.quality()
    distributor = gf.ForceDistributor(grasp, "max", weight=0.5, rtol=1e-6)
    for again in (quality, pickle.loads(pickle.dumps(quality))):
        asked = again.to_dict()
        assert (again.external_wrench.tolist(), again.metric.tolist()) == (wrench, metric.tolist())
        assert (again.rtol, again.max_facets) == (1e-6, 500)
        assert (asked["external_wrench"], asked["metric"], asked["length_scale"]) == (
            wrench,
            metric.tolist(),
            None,
        )
    assert plain.external_wrench is plain.metric is plain.rtol is plain.max_facets is None
    assert plain.to_dict()["length_scale"] == 1.0
    solution = distributor.solve(wrench)
    for again in (solution, pickle.loads(pickle.dumps(solution))):
        asked = again.to_dict()
        assert asked["external_wrench"] == again.external_wrench.tolist() == wrench
        assert asked["objective"] == again.objective == "max"
        assert (asked["weight"], asked["rtol"]) == (again.weight, again.rtol) == (0.5, 1e-6)
    assert distributor.samples is distributor.to_dict()["samples"] is None
    reduced = gf.ForceDistributor(grasp, method="reduced", samples=[wrench, [0, -1, 0]])
    assert reduced.samples.tolist() == reduced.to_dict()["samples"] == [wrench, [0, -1, 0]]


def test_an_epsilon_is_printed_as_far_as_it_is_proven():
    assert "epsilon=0.577350269," in repr(gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]).quality())
    for rtol in (1e-2, 1e-4, 1e-9):
        quality = spatial_grasp(edges=None).quality("max", rtol=rtol)
        shown = repr(quality).split("epsilon=")[1].split(",")[0]
        width = quality.upper - quality.lower
        assert len(shown.replace(".", "").lstrip("0")) <= 9
        assert 10.0 ** -len(shown.partition(".")[2]) >= 0.1 * width
        assert float(shown) == pytest.approx(quality.epsilon, abs=10 * width, rel=1e-8)


def test_threads_may_share_a_grasp_and_its_quality():
    quality = spatial_grasp().quality("max")
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: quality.grasp.quality("max").epsilon, range(64)))
        gradients = list(pool.map(lambda _: quality.gradient.positions, range(64)))
    assert set(found) == {quality.epsilon}
    assert all(np.array_equal(gradient, gradients[0]) for gradient in gradients)
