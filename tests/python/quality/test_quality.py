"""The two quality criteria: reference answers, Qhull, and the laws that hold for every grasp."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import QhullError
from scipy.spatial.transform import Rotation
from support.oracles import grasp_arguments, inner_radius, minkowski_points, primitive_wrenches
from support.random_grasps import random_grasp
from support.reference_answers import SPATIAL

import graspforce as gf

CRITERIA = ["sum", "max"]
# Past a few hundred points in six dimensions Qhull is slow, and soon fails.
SMALL_SUMS = [case for case in SPATIAL if (case["edges"] + 1) ** len(case["positions"]) < 700]


planar_or_spatial = st.builds(
    random_grasp,
    seed=st.integers(0, 2**32 - 1),
    dim=st.sampled_from([2, 3]),
    count=st.integers(1, 6),
    edges=st.integers(3, 9),
)


def quality(arguments, criterion):
    return gf.Grasp(**arguments).quality(criterion)


def scale_of(arguments):
    return np.linalg.norm(gf.Grasp(**arguments).primitive_wrenches, axis=1).max()


@pytest.mark.parametrize("criterion", CRITERIA)
def test_every_spatial_reference_case_is_met(spatial_case, criterion):
    result = quality(grasp_arguments(spatial_case), criterion)
    assert result.closure == spatial_case["closure"]
    if spatial_case["closure"] == "partial":
        assert result.rho == 0
    else:
        assert result.rho == pytest.approx(spatial_case[f"rho_{criterion}"], rel=1e-8)


def test_primitive_wrenches_follow_equations_3_and_8(spatial_case):
    arguments = grasp_arguments(spatial_case)
    expected = np.vstack(primitive_wrenches(**arguments))
    scale = np.abs(expected).max()
    np.testing.assert_allclose(gf.Grasp(**arguments).primitive_wrenches, expected, atol=1e-13 * scale)


def agree_with_qhull(arguments, criterion, points):
    """Compare with the hull of the points; where it has no inside, Qhull calls it flat."""
    result, scale = quality(arguments, criterion), np.abs(points).max()
    try:
        radius = inner_radius(points)
    except QhullError:
        flat = np.linalg.matrix_rank(points - points[0], tol=1e-9 * scale) < points.shape[1]
        radius = 0.0 if flat else np.nan
    if radius > 1e-9 * scale:
        assert result.epsilon == pytest.approx(radius, rel=1e-8)
    else:
        assert radius <= 1e-9 * scale
        assert result.rho >= -1e-9 * scale


def test_the_union_has_the_inner_radius_of_qhulls_hull(spatial_case):
    arguments = grasp_arguments(spatial_case)
    agree_with_qhull(arguments, "sum", np.vstack(primitive_wrenches(**arguments)))


@pytest.mark.parametrize("case", SMALL_SUMS, ids=lambda case: case["name"])
def test_the_minkowski_sum_has_the_inner_radius_of_qhulls_hull(case):
    arguments = grasp_arguments(case)
    agree_with_qhull(arguments, "max", minkowski_points(primitive_wrenches(**arguments)))


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 5))
def test_planar_hulls_agree_with_qhull(seed, count):
    arguments = random_grasp(seed, 2, count, 2)
    wrenches = primitive_wrenches_of(arguments)
    agree_with_qhull(arguments, "sum", np.vstack(wrenches))
    agree_with_qhull(arguments, "max", minkowski_points(wrenches))


@pytest.mark.parametrize("criterion", CRITERIA)
@given(arguments=planar_or_spatial)
def test_the_result_carries_its_certificate(criterion, arguments):
    result, scale = quality(arguments, criterion), scale_of(arguments)
    assert result.lower <= result.rho <= result.upper
    assert result.epsilon == -result.rho
    # Where the origin nearly lies on the boundary, rounding of the wrenches is what is left of the bracket.
    assert result.upper - result.lower <= max(1e-9 * abs(result.rho), 1e-11 * scale)
    assert result.converged == (result.upper - result.lower <= 1e-9 * abs(result.rho) + 1e-11 * scale)
    assert result.closure == ("force" if result.rho < 0 else "none" if result.rho > 0 else "partial")
    assert np.linalg.norm(result.direction) == pytest.approx(1, abs=1e-9)
    np.testing.assert_allclose(result.wrench, -result.rho * result.direction, atol=1e-9 * scale)
    if result.rho < 0:
        contact_best = [(w @ result.direction).max() for w in primitive_wrenches_of(arguments)]
        support = max(contact_best) if criterion == "sum" else np.maximum(contact_best, 0).sum()
        assert support == pytest.approx(result.epsilon, abs=1e-8 * scale)


def primitive_wrenches_of(arguments):
    known = {k: v for k, v in arguments.items() if k != "edges" or "tangents" in arguments}
    return primitive_wrenches(**known)


@pytest.mark.parametrize("criterion", CRITERIA)
@given(arguments=planar_or_spatial, factor=st.floats(1e-3, 1e3))
def test_quality_scales_with_the_force_limits(criterion, arguments, factor):
    stronger = {**arguments, "max_normal_force": factor * arguments["max_normal_force"]}
    expected = factor * quality(arguments, criterion).rho
    assert quality(stronger, criterion).rho == pytest.approx(
        expected, abs=3e-9 * factor * scale_of(arguments)
    )


@pytest.mark.parametrize("criterion", CRITERIA)
@given(arguments=planar_or_spatial, seed=st.integers(0, 2**32 - 1))
def test_quality_does_not_change_when_everything_turns_about_the_origin(criterion, arguments, seed):
    dim = arguments["positions"].shape[1]
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=rng).as_matrix()
    if dim == 2:
        turn = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()[:2, :2]
    vectors = [name for name in ("positions", "normals", "tangents") if name in arguments]
    turned = {**arguments, **{name: arguments[name] @ turn.T for name in vectors}}
    expected = quality(arguments, criterion).rho
    assert quality(turned, criterion).rho == pytest.approx(expected, abs=3e-9 * scale_of(arguments))


@pytest.mark.parametrize("criterion", CRITERIA)
@given(arguments=planar_or_spatial, seed=st.integers(0, 2**32 - 1))
def test_the_order_of_the_contacts_does_not_matter(criterion, arguments, seed):
    order = np.random.default_rng(seed).permutation(len(arguments["positions"]))
    shuffled = {name: value[order] if np.ndim(value) else value for name, value in arguments.items()}
    expected = quality(arguments, criterion).rho
    assert quality(shuffled, criterion).rho == pytest.approx(expected, abs=3e-9 * scale_of(arguments))


@pytest.mark.parametrize("criterion", CRITERIA)
@given(arguments=planar_or_spatial, factor=st.floats(1.0, 5.0))
def test_more_friction_never_hurts(criterion, arguments, factor):
    rougher = {**arguments, "friction": factor * arguments["friction"]}
    assert quality(rougher, criterion).rho <= quality(arguments, criterion).rho + 3e-9 * scale_of(rougher)


@given(arguments=planar_or_spatial)
def test_limiting_each_force_leaves_more_than_limiting_their_sum(arguments):
    rho_sum, rho_max = (quality(arguments, criterion).rho for criterion in CRITERIA)
    assert rho_max <= rho_sum + 3e-9 * scale_of(arguments)


@pytest.mark.parametrize("criterion", CRITERIA)
@given(seed=st.integers(0, 2**32 - 1), dim=st.sampled_from([2, 3]))
def test_a_batch_answers_like_its_grasps_one_by_one(criterion, seed, dim):
    grasps = [random_grasp(seed + i, dim, 4, 6) for i in range(3)]
    common = {"friction": 0.5, "max_normal_force": [1.0, 2.0, 3.0, 4.0], "edges": 6}
    vectors = [name for name in ("positions", "normals", "tangents") if name in grasps[0]]
    batch = gf.quality_many(
        **{n: np.stack([g[n] for g in grasps]) for n in vectors}, **common, criterion=criterion
    )
    assert batch.status.dtype == np.int8
    for i, arguments in enumerate(grasps):
        alone = quality({**{n: arguments[n] for n in vectors}, **common}, criterion)
        assert batch.rho[i] == alone.rho
        assert batch.epsilon[i] == alone.epsilon
        assert (batch.lower[i], batch.upper[i]) == (alone.lower, alone.upper)
        assert batch.status[i] == (gf.Status.SOLVED if alone.converged else gf.Status.NOT_CONVERGED)
