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


def test_threads_may_share_a_grasp_and_its_quality():
    quality = spatial_grasp().quality("max")
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: quality.grasp.quality("max").epsilon, range(64)))
        gradients = list(pool.map(lambda _: quality.gradient.positions, range(64)))
    assert set(found) == {quality.epsilon}
    assert all(np.array_equal(gradient, gradients[0]) for gradient in gradients)
