"""The field's surrogates of quality, beside solvers of their definitions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear
from support.moved_contacts import STEP, ellipsoid_grasps, tangents_of, turned

import graspforce as gf
from graspforce import surrogates

if TYPE_CHECKING:
    from collections.abc import Callable

SURROGATES: dict[str, Callable[..., surrogates.SurrogateBatch]] = {
    "min_weight": surrogates.min_weight,
    "differentiable_force_closure": surrogates.differentiable_force_closure,
    "span_residual": surrogates.span_residual,
}


def wrenches_of(positions: Any, normals: Any, **options: Any) -> Any:
    return gf.Grasp(positions, normals, **options).primitive_wrenches.T


@pytest.mark.parametrize(("dim", "contacts"), [(2, 3), (3, 3), (3, 4), (3, 5)])
def test_the_least_weight_is_that_of_its_linear_program(dim: int, contacts: int) -> None:
    rng = np.random.default_rng(1)
    positions, normals = ellipsoid_grasps(rng, 60, dim, contacts)
    options: dict[str, Any] = {"friction": 0.5, "edges": 6}
    found = surrogates.min_weight(positions, normals, **options)
    assert (found.status == 0).all()
    assert {-1.0, 1.0} <= set(np.sign(found.values))
    closed = gf.quality_many(positions, normals, **options).closure == 1
    np.testing.assert_array_equal(found.values > 0, closed)
    for row in range(60):
        w = wrenches_of(positions[row], normals[row], **options)
        d, n = w.shape
        least = linprog(
            np.r_[np.zeros(n), -1.0],
            A_ub=np.c_[-np.eye(n), np.ones(n)],
            b_ub=np.zeros(n),
            A_eq=np.r_[np.c_[w, np.zeros(d)], [np.r_[np.ones(n), 0.0]]],
            b_eq=np.r_[np.zeros(d), 1.0],
            bounds=[(None, None)] * (n + 1),
        )
        assert found.values[row] == pytest.approx(-least.fun, abs=1e-8)


@pytest.mark.parametrize(("dim", "contacts", "limit"), [(2, 3, 5.0), (3, 3, 20.0), (3, 4, 3.0), (3, 6, 1.0)])
def test_the_span_residual_is_that_of_bounded_least_squares(dim: int, contacts: int, limit: float) -> None:
    rng = np.random.default_rng(2)
    positions, normals = ellipsoid_grasps(rng, 60, dim, contacts)
    options: dict[str, Any] = {"friction": 0.5, "edges": 5, "length_scale": 0.5}
    found = surrogates.span_residual(positions, normals, limit=limit, **options)
    assert (found.status == 0).all()
    scale = np.r_[np.ones(dim), np.full(1 if dim == 2 else 3, 2.0)]
    for row in range(60):
        w = scale[:, None] * wrenches_of(positions[row], normals[row], **options)
        if limit == 1.0:
            expected = np.linalg.norm(w.sum(axis=1))
        else:
            n = w.shape[1]
            best = lsq_linear(w, np.zeros(len(w)), (1.0, limit), method="bvls", tol=1e-14, max_iter=1000)
            assert n == len(best.x)
            expected = np.linalg.norm(w @ np.clip(best.x, 1.0, limit))
        assert found.values[row] == pytest.approx(expected, abs=1e-7)


def test_the_wrench_of_unit_normals_is_a_sum() -> None:
    positions, normals = ellipsoid_grasps(np.random.default_rng(3), 20, 3)
    found = surrogates.differentiable_force_closure(
        positions, normals, length_scale=0.5, origin=(0.1, 0.2, 0.3)
    )
    torques = np.cross(positions - (0.1, 0.2, 0.3), normals).sum(axis=1) / 0.5
    expected = np.linalg.norm(np.c_[normals.sum(axis=1), torques], axis=1)
    np.testing.assert_allclose(found.values, expected, rtol=1e-13)


@pytest.mark.parametrize("name", SURROGATES)
@pytest.mark.parametrize("dim", [2, 3])
def test_the_gradient_is_that_of_central_differences(name: str, dim: int) -> None:
    rng = np.random.default_rng(4)
    positions, normals = ellipsoid_grasps(rng, 1000, dim, dim + 1)
    tangents = {"tangents": tangents_of(normals)} if dim == 3 else {}
    surrogate = SURROGATES[name]
    found = surrogate(positions, normals, **tangents)
    check = (found.status == 0) & found.unique
    assert check.sum() > (300 if name == "span_residual" else 950)
    along = rng.normal(size=positions.shape)
    sides = [surrogate(positions + s * STEP * along, normals, **tangents).values for s in (1, -1)]
    pairs = [((sides[0] - sides[1]) / (2 * STEP), (found.positions * along).sum((1, 2)))]
    at = turned(rng, normals)
    (ahead, frames, slope), (behind, others, _) = at(STEP), at(-STEP)
    sides = [surrogate(positions, ahead, **frames).values, surrogate(positions, behind, **others).values]
    pairs.append(((sides[0] - sides[1]) / (2 * STEP), (found.normals * slope).sum((1, 2))))
    for difference, expected in pairs:
        scale = np.abs(difference) + np.abs(expected) + 1e-2 * np.abs(found.values)
        wrong = check & ~(np.abs(difference - expected) <= 1e-4 * scale)
        assert wrong.sum() <= 2, np.argwhere(wrong)


@pytest.mark.parametrize("name", SURROGATES)
def test_rows_of_bad_input_get_a_status_and_harm_no_other_row(name: str) -> None:
    positions, normals = ellipsoid_grasps(np.random.default_rng(5), 6, 3)
    positions[0, 1, 2] = np.nan
    normals[1, 0] = 0.0
    positions[2], normals[2] = positions[2, 0], normals[2, 0]
    found = SURROGATES[name](positions, normals)
    assert (found.status[:2] == gf.Status.INVALID).all()
    assert np.isnan(found.values[:2]).all()
    solved = found.status == 0
    assert solved[3:].all()
    assert np.isfinite(found.values[solved]).all()
    for field in (found.positions, found.normals):
        assert (np.isfinite(field).all(axis=(1, 2)) == solved).all()
    np.testing.assert_array_equal(found.values[3:], SURROGATES[name](positions[3:], normals[3:]).values)


def test_a_single_contact_has_no_weights() -> None:
    found = surrogates.min_weight([[(0.0, 0.0, 0.1)]], [[(0.0, 0.0, -1.0)]])
    assert found.status.tolist() == [gf.Status.INFEASIBLE]
    assert list(found.errors) == [0]


def test_true_cones_have_no_primitive_wrenches() -> None:
    found = surrogates.span_residual([[(0, 0, 1.0)]], [[(0, 0, -1.0)]], edges=None)
    assert found.status.tolist() == [gf.Status.INVALID]
    with pytest.raises(gf.InvalidInputError, match=r"limit: 0\.5 must be at least 1"):
        surrogates.span_residual([[(0, 0, 1.0)]], [[(0, 0, -1.0)]], limit=0.5)


@pytest.mark.parametrize("name", SURROGATES)
def test_a_ragged_batch_gives_what_its_grasps_give(name: str) -> None:
    rng = np.random.default_rng(6)
    (first, second), surrogate = [ellipsoid_grasps(rng, 1, 3, count) for count in (3, 5)], SURROGATES[name]
    positions, normals = (np.concatenate([first[side][0], second[side][0]]) for side in (0, 1))
    found = surrogate(positions, normals, offsets=[0, 3, 8])
    for row, (own, grasp) in enumerate([(slice(3), first), (slice(3, 8), second)]):
        alone = surrogate(*grasp)
        assert found.values[row] == alone.values[0]
        np.testing.assert_array_equal(found.positions[own], alone.positions[0])
        np.testing.assert_array_equal(found.spins[own], alone.spins[0])
