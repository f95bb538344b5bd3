"""Quality for a task: about a weight, in a metric, along directions; its gradient; the classical measures."""

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from support.random_grasps import random_grasp

import graspforce as gf

CRITERIA = ["sum", "max"]


def cup(**options):
    positions = [(0.04, 0, 0), (-0.02, 0.035, 0.01), (-0.02, -0.035, -0.01), (0, 0.04, 0.02)]
    normals = [(-1, 0, 0.1), (0.5, -0.866, 0), (0.5, 0.866, 0.2), (0, -1, -0.3)]
    return gf.Grasp(positions, normals, **{"friction": 0.6, "length_scale": 0.04, **options})


@pytest.mark.parametrize("criterion", CRITERIA)
def test_epsilon_is_the_least_resistance_over_all_directions(criterion):
    grasp = cup()
    q = grasp.quality(criterion)
    assert q.closure == "force"
    # Disturbances are hardest to resist along the opposite of the worst direction.
    worst = grasp.resistance(-q.direction, criterion)
    assert worst == pytest.approx(q.epsilon, rel=1e-9)
    random = np.random.default_rng(3).normal(size=(200, 6))
    scale = np.array([1, 1, 1, 0.04, 0.04, 0.04])
    random *= scale / np.linalg.norm(random, axis=1, keepdims=True)
    assert grasp.resistance(random, criterion).min() >= q.epsilon * (1 - 1e-9)


def test_resistance_is_zero_where_no_force_helps():
    pair = gf.Grasp([(1, 0, 0), (-1, 0, 0)], [(-1, 0, 0), (1, 0, 0)])
    twist, slide = pair.resistance([[0, 0, 0, 1, 0, 0], [0, 1, 0, 0, 0, 0]])
    assert twist == 0
    assert slide > 0


@pytest.mark.parametrize("directions", [[0, 0, 0], [[1, 0, 0], [0, 0, 0]], [1, 2], [[1, np.nan, 0]], "down"])
def test_unusable_directions_are_refused_by_row(directions):
    disc = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    with pytest.raises(gf.InvalidInputError, match="directions"):
        disc.resistance(directions)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_length_scale_is_the_simplest_metric(criterion):
    metric = np.diag([1, 1, 1, 0.04**-2, 0.04**-2, 0.04**-2])
    by_metric = cup(length_scale=1.0).quality(criterion, metric=metric)
    assert by_metric.epsilon == pytest.approx(cup().quality(criterion).epsilon, rel=2e-9)


@pytest.mark.parametrize(
    ("metric", "message"),
    [(np.eye(3), "shape"), (-np.eye(6), "definite"), (np.ones((6, 6)), "definite"),
     (np.triu(np.ones((6, 6))), "symmetric"), (np.full((6, 6), np.nan), "finite")],
)  # fmt: skip
def test_an_unusable_metric_is_refused(metric, message):
    with pytest.raises(gf.InvalidInputError, match=f"metric: .*{message}"):
        cup().quality(metric=metric)


def test_a_plate_on_three_fingers_has_quality_only_with_its_weight():
    angles = np.array([0.0, 2.1, 4.2])
    tips = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    plate = gf.Grasp(tips, np.tile([0, 0, 1.0], (3, 1)), friction=0.5, max_normal_force=10)
    weight = [0, 0, -9, 0, 0, 0]
    assert plate.quality().rho > 0
    resting = plate.quality(external_wrench=weight)
    assert resting.epsilon > 0
    assert resting.closure == "none"
    # What can be resisted on top of the weight, along the worst direction and any other: LP by LP.
    hold = gf.ForceDistributor(plate)
    for direction in np.vstack([-resting.direction, np.random.default_rng(0).normal(size=(50, 6))]):
        disturbance = 0.999999 * resting.epsilon * direction / np.linalg.norm(direction)
        assert hold.solve(weight + disturbance).sigma_max <= 1
    worst = -1.000001 * resting.epsilon * resting.direction
    with contextlib.suppress(gf.InfeasibleWrenchError):
        assert hold.solve(weight + worst).sigma_max > 1


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("edges", [8, None])
def test_the_gradient_predicts_small_moves(criterion, edges):
    grasp = cup(edges=edges)
    gradient = grasp.quality(criterion).gradient
    assert gradient.unique
    assert gradient.positions.shape == gradient.normals.shape == (4, 3)
    np.testing.assert_allclose((gradient.normals * grasp.normals).sum(axis=1), 0, atol=1e-9)
    move = np.random.default_rng(1).normal(size=(4, 3))
    h = 1e-7
    tangents = grasp.frames[:, 1]

    def epsilon(step):
        moved = gf.Grasp(
            grasp.positions + step * move,
            grasp.normals,
            0.6,
            edges=edges,
            tangents=tangents,
            length_scale=0.04,
        )
        return moved.quality(criterion, rtol=1e-11).epsilon

    slope = (epsilon(h) - epsilon(-h)) / (2 * h)
    assert slope == pytest.approx((gradient.positions * move).sum(), rel=1e-4)


def test_metrics_are_what_numpy_and_qhull_say():
    grasp = cup()
    scaled = np.diag([1, 1, 1, 25, 25, 25]) @ grasp.grasp_matrix
    singular = np.linalg.svd(scaled, compute_uv=False)
    measures = grasp.measures()
    assert measures.smallest_singular_value == pytest.approx(singular[-1])
    assert measures.isotropy == pytest.approx(singular[-1] / singular[0])
    assert measures.ellipsoid_volume == pytest.approx(np.sqrt(np.linalg.det(scaled @ scaled.T)))
    points = np.vstack([np.zeros(6), grasp.primitive_wrenches * [1, 1, 1, 25, 25, 25]])
    assert measures.hull_volume == pytest.approx(ConvexHull(points).volume)


def test_metrics_of_what_cannot_move_everything():
    pair = gf.Grasp([(1, 0, 0), (-1, 0, 0)], [(-1, 0, 0), (1, 0, 0)]).measures()
    assert pair.smallest_singular_value == pytest.approx(0, abs=1e-12)
    assert pair.hull_volume == 0
    one = gf.Grasp([(1, 0, 0)], [(-1, 0, 0)]).measures()
    assert one.smallest_singular_value == one.isotropy == one.ellipsoid_volume == 0
    assert cup(edges=None).measures().hull_volume is None


@given(seed=st.integers(0, 2**32 - 1))
def test_a_row_that_is_no_grasp_does_not_stop_the_batch(seed):
    grasps = [random_grasp(seed + i, 3, 4, 6) for i in range(4)]
    positions = np.stack([g["positions"] for g in grasps])
    normals = np.stack([g["normals"] for g in grasps])
    positions[1, 2, 0] = np.nan
    normals[3, 0] = 0
    batch = gf.quality_many(positions, normals)
    assert batch.status.tolist() == [0, 2, 0, 2]
    assert np.isnan(batch.rho[[1, 3]]).all()
    assert batch.closure[[1, 3]].tolist() == [-2, -2]
    assert "positions, contact 2" in batch.errors[1]
    assert "normals, contact 0" in batch.errors[3]
    alone = gf.Grasp(positions[2], normals[2]).quality("max")
    assert batch.rho[2] == alone.rho


def test_rows_of_a_batch_may_have_their_own_origin_and_length_scale():
    positions, normals = (np.tile(x, (3, 1, 1)) for x in (cup().positions, cup().normals))
    origins, scales = np.array([[0, 0, 0], [0, 0.01, 0], [0.1, 0, -0.2]]), np.array([0.04, 0.0, 2.0])
    batch = gf.quality_many(positions, normals, origin=origins, length_scale=scales)
    assert batch.status.tolist() == [0, 2, 0]
    assert batch.errors[1] == "length_scale: 0 must be finite and positive"
    for i in (0, 2):
        alone = gf.Grasp(positions[i], normals[i], origin=origins[i], length_scale=scales[i])
        assert batch.rho[i] == alone.quality("max").rho
    for wrong in ({"origin": origins[:2]}, {"length_scale": scales[:2]}):
        with pytest.raises(gf.InvalidGraspError, match=next(iter(wrong))):
            gf.quality_many(positions, normals, **wrong)
    with pytest.raises(gf.InvalidGraspError, match="length_scale"):
        gf.Grasp(positions[0], normals[0], length_scale=scales)


def test_progress_is_reported_and_may_end_the_batch():
    positions = np.tile(cup().positions, (600, 1, 1))
    normals = np.tile(cup().normals, (600, 1, 1))
    seen = []
    batch = gf.quality_many(positions, normals, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (600, 600)
    assert len(seen) > 1
    assert len(batch) == 600

    def stop(_done, _total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gf.quality_many(positions, normals, progress=stop)


def test_an_empty_batch_is_an_empty_answer():
    batch = gf.quality_many(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)))
    assert len(batch) == 0
    assert batch.rho.shape == (0,)
