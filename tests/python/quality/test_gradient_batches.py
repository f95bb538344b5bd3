"""Gradients of many grasps at once, and batches of grasps with different numbers of contacts."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import graspforce as gf

CRITERIA = ["sum", "max"]
FIELDS = ["positions", "normals", "spins", "friction", "max_normal_force"]


def contacts(rows, count, seed=1, dim=3):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(rows, count, dim))
    points /= np.linalg.norm(points, axis=-1, keepdims=True)
    axes = np.array([1.0, 1.3, 0.8])[:dim]
    return points * axes, -points / axes


def assert_rows_are_single_gradients(batch, positions, normals, rows=None, **options):
    criterion = options.pop("criterion")
    for row in range(len(positions)) if rows is None else rows:
        given = {name: value[row] if np.ndim(value) == 2 else value for name, value in options.items()}
        single = gf.Grasp(positions[row], normals[row], **given).quality(criterion).gradient
        assert batch.gradient.unique[row] == single.unique
        for name in FIELDS:
            expected = getattr(single, name)
            size = max(1.0, np.abs(expected).max())
            np.testing.assert_allclose(
                getattr(batch.gradient, name)[row], expected, atol=1e-12 * size, rtol=0
            )


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize(
    ("dim", "options"),
    [(2, {}), (3, {}), (3, {"torsion": 0.1, "friction_margin": 1.2}), (3, {"edges": None})],
    ids=["planar", "hard", "soft", "true cones"],
)
def test_gradients_of_a_batch_are_those_of_its_grasps(criterion, dim, options):
    positions, normals = contacts(40 if options.get("edges", 8) else 6, 4, dim=dim)
    batch = gf.quality_many(positions, normals, criterion=criterion, gradient=True, **options)
    assert batch.gradient.positions.shape == positions.shape
    assert_rows_are_single_gradients(batch, positions, normals, criterion=criterion, **options)
    alone = gf.quality_many(positions, normals, criterion=criterion, **options)
    np.testing.assert_array_equal(alone.rho, batch.rho)
    assert alone.gradient is None


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_thousand_gradients_are_central_differences(criterion):
    positions, normals = contacts(1000, 4, seed=2)
    rng = np.random.default_rng(3)
    friction, limits = rng.uniform(0.3, 0.8, (1000, 4)), rng.uniform(0.5, 2.0, (1000, 4))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    # As the default tangents, which do not turn with the normal.
    seeds = np.where(np.abs(normals[..., :1]) > 0.7, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    tangents = seeds - normals * (seeds * normals).sum(axis=-1, keepdims=True)
    gradient = gf.quality_many(
        positions, normals, friction, limits, tangents=tangents, criterion=criterion, gradient=True
    ).gradient
    assert gradient.unique.mean() > 0.95
    move, turn = rng.normal(size=(2, 1000, 4, 3))
    turn -= normals * (turn * normals).sum(axis=-1, keepdims=True)
    spin, rub, press = rng.normal(size=(3, 1000, 4))

    def epsilon(step):
        vectors = np.cross(normals, turn) + spin[..., None] * normals
        turned = Rotation.from_rotvec((step * vectors).reshape(-1, 3))
        return gf.quality_many(
            positions + step * move,
            turned.apply(normals.reshape(-1, 3)).reshape(normals.shape),
            friction + step * rub,
            limits + step * press,
            tangents=turned.apply(tangents.reshape(-1, 3)).reshape(normals.shape),
            criterion=criterion,
            rtol=1e-12,
        ).epsilon

    parts = [
        (gradient.positions * move).sum(axis=(1, 2)),
        (gradient.normals * turn).sum(axis=(1, 2)),
        (gradient.spins * spin).sum(axis=1),
        (gradient.friction * rub).sum(axis=1),
        (gradient.max_normal_force * press).sum(axis=1),
    ]
    difference = (epsilon(1e-6) - epsilon(-1e-6)) / 2e-6
    error = np.abs(difference - sum(parts))[gradient.unique] / np.abs(parts).max(axis=0)[gradient.unique]
    # A kink within the step is no fault of the gradient; it is rare.
    assert np.median(error) < 1e-8
    assert np.quantile(error, 0.995) < 1e-5


@pytest.mark.parametrize("criterion", CRITERIA)
def test_hostile_rows_have_a_status_and_leave_the_others_their_gradients(criterion):
    positions, normals = contacts(12, 4)
    friction = np.full((12, 4), 0.5)
    positions[1, 2, 0] = np.nan
    normals[2, 1] = 0.0
    friction[3, 3] = -1.0
    positions[4], normals[4] = positions[4, 0], normals[4, 0]
    positions[5, 1], normals[5, 1] = positions[5, 0], normals[5, 0]
    positions[6] *= 1e120
    positions[7] *= 1e-120
    normals[8] = np.abs(normals[8])
    positions[9] *= 1e200
    positions[10] = [(1, 0, 0), (-1, 0, 0)] * 2
    normals[10] = -positions[10]
    batch = gf.quality_many(positions, normals, friction, criterion=criterion, gradient=True)
    assert sorted(batch.errors) == np.flatnonzero(batch.status == gf.Status.INVALID).tolist() == [1, 2, 3, 9]
    for name in FIELDS:
        entries = getattr(batch.gradient, name).reshape(12, -1)
        good = batch.status != gf.Status.INVALID
        assert np.isnan(entries[~good]).all()
        assert np.isfinite(entries[good]).all()
    assert not batch.gradient.unique[[1, 2, 3, 9]].any()
    rows = [0, 4, 5, 6, 7, 8, 10, 11]
    assert_rows_are_single_gradients(batch, positions, normals, rows, friction=friction, criterion=criterion)


def test_a_gradient_beyond_float64_is_an_error_of_its_row():
    positions, normals = contacts(2, 4, seed=9)
    limits = np.ones((2, 4))
    limits[0] *= 1e-139
    friction = np.full((2, 4), 0.5)
    friction[0] = 1e-310
    batch = gf.quality_many(positions, normals, friction, limits, gradient=True)
    for name in FIELDS:
        assert np.isfinite(getattr(batch.gradient, name)[batch.status != gf.Status.INVALID]).all()


def ragged(counts=(4, 3, 6, 5), dim=3):
    rows = [contacts(1, count, seed=count, dim=dim) for count in counts]
    positions, normals = ([part[k][0] for part in rows] for k in (0, 1))
    return positions, normals, np.cumsum([0, *counts])


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("dim", [2, 3])
def test_rows_of_a_ragged_batch_are_single_grasps(criterion, dim):
    positions, normals, offsets = ragged(dim=dim)
    rng = np.random.default_rng(4)
    numbers = {
        "friction": rng.uniform(0.4, 0.9, offsets[-1]),
        "max_normal_force": rng.uniform(0.5, 2.0, offsets[-1]),
        "edges": rng.integers(4, 9, offsets[-1]).tolist(),
    }
    if dim == 3:
        numbers["torsion"] = rng.uniform(0.0, 0.2, offsets[-1])
        numbers["tangents"] = rng.normal(size=(offsets[-1], 3))
    origins, scales = rng.normal(size=(4, dim)) * 0.1, rng.uniform(0.5, 2.0, 4)
    batch = gf.quality_many(
        np.vstack(positions),
        np.vstack(normals),
        **numbers,
        origin=origins,
        length_scale=scales,
        criterion=criterion,
        gradient=True,
        offsets=offsets,
    )
    assert batch.gradient.positions.shape == (offsets[-1], dim)
    for row in range(4):
        own = slice(offsets[row], offsets[row + 1])
        given = {name: value[own] for name, value in numbers.items()}
        grasp = gf.Grasp(positions[row], normals[row], **given, origin=origins[row], length_scale=scales[row])
        quality = grasp.quality(criterion)
        assert batch.rho[row] == quality.rho
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(batch.gradient, name)[own], getattr(quality.gradient, name))


def test_a_ragged_batch_answers_row_by_row():
    positions, normals, offsets = ragged()
    positions, normals = np.vstack(positions), np.vstack(normals)
    positions[5] = np.nan
    offsets = np.insert(offsets, 2, offsets[2])
    batch = gf.quality_many(positions, normals, offsets=offsets, gradient=True)
    assert batch.status.tolist() == [0, 2, 2, 0, 0]
    assert "contact 1" in batch.errors[1]
    assert "at least one contact" in batch.errors[2]
    assert np.isnan(batch.gradient.positions[4:7]).all()
    assert np.isfinite(np.delete(batch.gradient.positions, [4, 5, 6], axis=0)).all()
    empty = gf.quality_many(np.empty((0, 3)), np.empty((0, 3)), offsets=[0], gradient=True)
    assert len(empty) == len(empty.gradient) == 0


@pytest.mark.parametrize(
    ("offsets", "message"),
    [
        ([1, 18], "offsets, entry 0: 1, expected 0"),
        ([0, 7, 4, 18], "offsets, entry 2: 4, expected at least 7"),
        ([0, 4, 17], "offsets, entry 2: 17, expected 18"),
        ([0, 19], "offsets, entry 1: 19, expected at most 18"),
        ([0, 2.5, 18], "offsets, entry 1: 2.5, expected a whole number"),
        ([[0, 18]], "offsets: shape"),
        ([], "offsets: shape"),
        ([0, np.nan, 18], "offsets, entry 1: NaN"),
        ("all", "offsets"),
    ],
)
def test_offsets_that_cut_no_batch_are_refused_by_entry_and_value(offsets, message):
    positions, normals, _ = ragged()
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.quality_many(np.vstack(positions), np.vstack(normals), offsets=offsets)


def test_single_precision_gives_double_precision():
    positions, normals = contacts(20, 4)
    single = positions.astype(np.float32), normals.astype(np.float32)
    batch = gf.quality_many(*single, gradient=True)
    same = gf.quality_many(*(part.astype(np.float64) for part in single), gradient=True)
    assert batch.rho.dtype == batch.gradient.positions.dtype == np.float64
    np.testing.assert_array_equal(batch.gradient.positions, same.gradient.positions)


def test_a_batch_keeps_its_gradients_in_pickles_and_dictionaries():
    positions, normals = contacts(3, 4)
    normals[1] = 0.0
    batch = gf.quality_many(positions, normals, gradient=True)
    again = pickle.loads(pickle.dumps(batch))
    for name in [*FIELDS, "unique"]:
        np.testing.assert_array_equal(getattr(again.gradient, name), getattr(batch.gradient, name))
        assert not getattr(again.gradient, name).flags.writeable
    listed = batch.to_dict()["gradient"]
    assert listed["positions"][1][0] == [None] * 3
    assert listed["positions"][0] == batch.gradient.positions[0].tolist()
    make, (rows, *_) = batch.__reduce__()
    other = gf.quality_many(positions, positions, gradient=True).gradient
    for wrong in [other, rows, gf.quality_many(positions[:2], normals[:2], gradient=True).gradient]:
        with pytest.raises(gf.InvalidInputError):
            make(rows, wrong)


def test_of_contacts_with_very_unequal_limits_only_right_gradients_are_called_unique():
    rng = np.random.default_rng(5)
    axes = np.array([1.0, 1.3, 0.8])
    points = rng.normal(size=(30, 4, 3))
    points = points / np.linalg.norm(points, axis=-1, keepdims=True) * axes
    normals, way, step = -points / axes**2, rng.normal(size=points.shape), 1e-6
    options = {"max_normal_force": [1e-4, 1, 1e4, 1], "edges": None, "bundle": 1, "rtol": 1e-9}
    batch = gf.quality_many(points, normals, gradient=True, **options)
    ends = [gf.quality_many(points + s * step * way, normals, **options).bundle.values[:, 0] for s in (1, -1)]
    slopes = (batch.gradient.positions * way).sum(axis=(1, 2))
    sizes = np.abs(batch.gradient.positions).max(axis=(1, 2))
    counted = batch.gradient.unique & (batch.closure == 1)
    assert counted.sum() >= 3
    assert (np.abs((ends[0] - ends[1]) / (2 * step) - slopes) <= 1e-2 * sizes)[counted].all()
