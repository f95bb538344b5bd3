"""Bundles: the most critical directions of many grasps, with supports and gradients."""

import itertools
import pickle

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import graspforce as gf

CRITERIA = ["sum", "max"]
FIELDS = ["positions", "normals", "spins", "friction", "max_normal_force"]


def contacts(rows, count, seed=1, dim=3):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(rows, count, dim))
    points /= np.linalg.norm(points, axis=-1, keepdims=True)
    axes = np.array([1.0, 1.3, 0.8])[:dim]
    normals = -points / axes
    return points * axes, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def vertices(grasp, criterion):
    """Points of the wrench set in the norm's coordinates."""
    points = grasp.primitive_wrenches if criterion == "sum" else grasp.minkowski_sum().wrenches
    return points / scale_of(grasp)


def scale_of(grasp):
    forces = grasp.wrench_dim // 2 + grasp.wrench_dim % 2
    return np.where(np.arange(grasp.wrench_dim) < forces, 1.0, grasp.length_scale)


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize(
    ("dim", "count", "options"),
    [(2, 4, {}), (3, 4, {"length_scale": 0.7}), (3, 3, {"edges": 3, "friction": 0.8})],
)
def test_a_bundle_holds_all_weakest_facets_of_the_enumerated_hull(criterion, dim, count, options):
    if criterion == "max" and options.get("length_scale"):
        options = {**options, "edges": 3}
    positions, normals = contacts(30, count, dim=dim)
    batch = gf.quality_many(positions, normals, criterion=criterion, bundle=6, **options)
    closed = np.flatnonzero(batch.epsilon > 1e-3)
    assert len(closed) >= 3
    for row in closed[:6]:
        grasp = gf.Grasp(positions[row], normals[row], **options)
        points = vertices(grasp, criterion)
        found = batch.bundle.count[row]
        assert found == 6
        directions = batch.bundle.directions[row] / scale_of(grasp)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-12)
        values = batch.bundle.values[row]
        np.testing.assert_allclose((points @ directions.T).max(axis=0), values, rtol=1e-12)
        assert values[0] == pytest.approx(batch.epsilon_upper[row], rel=1e-9)
        # Every direction is the normal of a facet. Where the facet holds its foot point, it is a local
        # minimum of the support: none of those is missing below the largest value.
        equations = ConvexHull(points).equations
        for direction in directions:
            assert np.abs(equations[:, :-1] - direction).max(axis=1).min() < 1e-6
        for equation in equations[-equations[:, -1] < values[-1] - 1e-9]:
            normal, distance = equation[:-1], -equation[-1]
            if (equations[:, :-1] @ (distance * normal) + equations[:, -1] < 1e-9).all():
                assert np.abs(directions - normal).max(axis=1).min() < 1e-6


def turned(normals, tangents, turn, spin, step):
    """Turn normals and tangents by the smallest rotation, and spin them."""
    rotation = Rotation.from_rotvec(step * (np.cross(normals, turn) + spin[:, None] * normals))
    return rotation.apply(np.array(normals)), rotation.apply(np.array(tangents))


def moves(rng, normals):
    """Draw a change of all contacts, with the fields of a gradient."""
    move, turn = rng.normal(size=(2, *normals.shape))
    turn -= normals * (turn * normals).sum(axis=-1, keepdims=True)
    return (
        move,
        turn,
        rng.normal(size=len(normals)),
        rng.normal(size=len(normals)),
        rng.normal(size=len(normals)),
    )


def moved(grasp, change, step, edges=8):
    move, turn, spin, rub, press = change
    normals, tangents = turned(grasp.normals, grasp.frames[:, 1], turn, spin, step)
    return gf.Grasp(
        grasp.positions + step * move,
        normals,
        grasp.friction + step * rub,
        grasp.max_normal_force + step * press,
        edges=edges,
        tangents=tangents,
    )


def along(bundle, row, change):
    """Return derivatives of all directions of a row along a change."""
    parts = (getattr(bundle, name)[row] * by for name, by in zip(FIELDS, change, strict=True))
    return sum(part.reshape(len(part), -1).sum(axis=1) for part in parts)


def support_of_cones(grasp, direction, criterion):
    """Support of the true cones along a direction, by its closed form."""
    a, b = direction[:3], direction[3:]
    v = a + np.cross(b, grasp.positions)
    n = (grasp.normals * v).sum(axis=1)
    t = np.linalg.norm(v - n[:, None] * grasp.normals, axis=1)
    reach = grasp.max_normal_force * (n + grasp.friction * t)
    return reach.max() if criterion == "sum" else np.maximum(reach, 0).sum()


@pytest.mark.parametrize("criterion", CRITERIA)
def test_gradients_of_true_cones_are_differences_at_the_fixed_direction(criterion):
    positions, normals = contacts(12, 4, seed=5)
    bundle = gf.quality_many(positions, normals, edges=None, criterion=criterion, bundle=4).bundle
    rng = np.random.default_rng(7)
    smooth = tested = 0
    for row, k in zip(*np.nonzero(np.isfinite(bundle.values)), strict=True):
        direction = bundle.directions[row, k]
        if bundle.values[row, k] <= 0:
            continue
        grasp = gf.Grasp(positions[row], normals[row], edges=None)
        assert support_of_cones(grasp, direction, criterion) == pytest.approx(bundle.values[row, k], rel=1e-9)
        change = moves(rng, normals[row])
        before, here, after = (
            support_of_cones(moved(grasp, change, step * 1e-6, None), direction, criterion)
            for step in (-1, 0, 1)
        )
        slopes = along(bundle, row, change)
        size = 1e-5 * max(1.0, np.abs(slopes).max())
        # Two one-sided differences: at kinks of p itself the gradient is one of the subdifferential.
        assert (here - before) / 1e-6 - size <= slopes[k] <= (after - here) / 1e-6 + size
        smooth += abs(after - 2 * here + before) / 1e-6 < size
        tested += 1
    assert tested >= 8
    assert smooth >= 1


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("dim", [2, 3])
def test_gradients_belong_to_the_subdifferential_of_the_support(criterion, dim):
    positions, normals = contacts(40, 4, seed=9, dim=dim)
    bundle = gf.quality_many(positions, normals, criterion=criterion, bundle=5).bundle
    rng = np.random.default_rng(8)
    step = 1e-6
    tested = 0
    for row in np.flatnonzero(bundle.count > 1):
        grasp = gf.Grasp(positions[row], normals[row])
        change = list(moves(rng, normals[row]))
        if dim == 2:
            tangent = np.stack([-normals[row][:, 1], normals[row][:, 0]], axis=-1)
            angle = (change[1] * tangent).sum(axis=1)
            change[2] *= 0
        ends = []
        for sign in (1, -1):
            if dim == 3:
                ends.append(moved(grasp, change, sign * step))
                continue
            cos, sin = np.cos(sign * step * angle)[:, None], np.sin(sign * step * angle)[:, None]
            ends.append(
                gf.Grasp(
                    positions[row] + sign * step * change[0],
                    cos * normals[row] + sin * tangent,
                    grasp.friction + sign * step * change[3],
                    grasp.max_normal_force + sign * step * change[4],
                )
            )

        def supports(of, row=row):
            reach = [
                of.primitive_wrenches.reshape(4, -1, of.wrench_dim)[i] @ bundle.directions[row].T
                for i in range(4)
            ]
            best = np.array([part.max(axis=0) for part in reach])
            return best.max(axis=0) if criterion == "sum" else np.maximum(best, 0).sum(axis=0)

        here, after, before = supports(grasp), supports(ends[0]), supports(ends[1])
        slopes = along(bundle, row, change)
        size = 1e-4 * max(1.0, np.abs(slopes).max())
        assert (slopes <= (after - here) / step + size).all()
        assert (slopes >= (here - before) / step - size).all()
        tested += 1
    assert tested >= 5


def ring(count, dim=2):
    angles = 2 * np.pi * np.arange(count) / count
    points = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return points if dim == 2 else np.column_stack([points, np.zeros(count)])


TETRAHEDRON = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / np.sqrt(3)
SYMMETRIC = {
    "two on a disc": ring(2),
    "three on a disc": ring(3),
    "four on a disc": ring(4),
    "three on a ball": ring(3, 3),
    "four on a ball": TETRAHEDRON,
}


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("name", SYMMETRIC)
def test_at_a_kink_the_derivative_of_epsilon_is_the_least_of_the_bundle_where_that_is_unique(name, criterion):
    points = SYMMETRIC[name]
    batch = gf.quality_many(points[None], -points[None], criterion=criterion, bundle=64)
    bundle = batch.bundle
    worst = bundle.values[0] <= batch.epsilon[0] * (1 + 1e-9)
    assert worst.sum() > 1
    rng = np.random.default_rng(3)
    move = rng.normal(size=(20, *points.shape))
    step = 1e-6
    after = gf.quality_many(
        points + step * move, np.broadcast_to(-points, move.shape), criterion=criterion, rtol=1e-12
    )
    derivative = (after.epsilon - batch.epsilon) / step
    slopes = np.einsum("kmi,bmi->bk", bundle.positions[0][worst], move).min(axis=1)
    if bundle.unique[0][worst].all():
        np.testing.assert_allclose(slopes, derivative, atol=1e-4)
    else:
        assert (slopes <= derivative + 1e-4).all()


@pytest.mark.parametrize("criterion", CRITERIA)
def test_hostile_rows_have_no_directions_and_leave_the_others_theirs(criterion):
    positions, normals = contacts(8, 4)
    clean = gf.quality_many(positions, normals, criterion=criterion, bundle=3)
    broken = positions.copy(), normals.copy()
    broken[0][1] = np.nan
    broken[1][4] = 0.0
    broken[0][6, 1:] = broken[0][6, 0]
    batch = gf.quality_many(*broken, criterion=criterion, bundle=3)
    assert batch.status[[1, 4]].tolist() == [2, 2]
    assert batch.bundle.count[[1, 4]].tolist() == [0, 0]
    for name in ["values", "directions", *FIELDS]:
        array = getattr(batch.bundle, name)
        assert not np.isnan(array).any()
        kept = [0, 2, 3, 5, 7]
        np.testing.assert_array_equal(array[kept], getattr(clean.bundle, name)[kept])
    assert np.isinf(batch.bundle.values[1]).all()
    padding = np.arange(3) >= batch.bundle.count[:, None]
    assert (batch.bundle.positions[padding] == 0).all()
    np.testing.assert_array_equal(clean.rho, gf.quality_many(positions, normals, criterion=criterion).rho)


def test_a_ragged_bundle_is_that_of_its_grasps():
    rows = [contacts(1, count, seed=count) for count in (4, 3, 6)]
    positions, normals = (np.vstack([row[part][0] for row in rows]) for part in (0, 1))
    offsets = [0, 4, 7, 13]
    ragged = gf.quality_many(positions, normals, offsets=offsets, bundle=4).bundle
    assert ragged.positions.shape == (13, 4, 3)
    for row, (start, end) in enumerate(itertools.pairwise(offsets)):
        alone = gf.quality_many(positions[None, start:end], normals[None, start:end], bundle=4).bundle
        np.testing.assert_array_equal(ragged.values[row], alone.values[0])
        for name in FIELDS:
            np.testing.assert_array_equal(
                getattr(ragged, name)[start:end], np.moveaxis(getattr(alone, name)[0], 0, 1)
            )


def test_a_bundle_comes_with_the_gradient_and_lasts_in_pickles():
    positions, normals = contacts(4, 4)
    normals[1] = 0.0
    batch = gf.quality_many(positions, normals, gradient=True, bundle=2)
    alone = gf.quality_many(positions, normals, gradient=True)
    np.testing.assert_array_equal(batch.gradient.positions, alone.gradient.positions)
    again = pickle.loads(pickle.dumps(batch))
    for name in ["values", "directions", "count", "unique", *FIELDS]:
        np.testing.assert_array_equal(getattr(again.bundle, name), getattr(batch.bundle, name))
    assert batch.to_dict()["bundle"]["values"][1] == [None, None]
    assert alone.bundle is None
    make, (rows, *_) = batch.__reduce__()
    for wrong in [batch.gradient, gf.quality_many(positions[:2], normals[:2], bundle=2).bundle]:
        with pytest.raises(gf.InvalidInputError):
            make(rows, None, wrong)


@pytest.mark.parametrize("size", [0, -1, 1001, 2.5, True, "all"])
def test_bundles_of_no_size_are_refused(size):
    positions, normals = contacts(1, 4)
    with pytest.raises(gf.InvalidInputError, match=r"bundle: .* whole number from 1 to 1000"):
        gf.quality_many(positions, normals, bundle=size)
