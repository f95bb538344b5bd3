"""Places for contacts: computed normals, ties, mirror images, and what is refused."""

import numpy as np
import pytest

import graspforce as gf
from graspforce.paper import TILE, tile_side
from graspforce.surfaces import ParametricSurface, PlanarCurve, contacts_on, ellipse, line, mirrored, tied


def test_computed_normals_of_a_curve_are_the_given_ones():
    given = ellipse(0.3, 0.1)
    computed = PlanarCurve(given.point, object_side=given.object_side)
    params = np.linspace(-3, 3, 41)
    np.testing.assert_allclose(computed.normals(params), given.normals(params), atol=1e-9)


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_computed_normals_of_a_surface_are_the_given_ones(side):
    given = tile_side(side)
    computed = ParametricSurface(given.point, object_side=given.object_side)
    params = np.random.default_rng(0).uniform(-0.2, 0.2, (50, 2))
    np.testing.assert_allclose(computed.normals(params), given.normals(params), atol=1e-9)


def test_singular_parameters_are_reported():
    cusp = PlanarCurve(lambda s: np.stack([0.68 * s**3, 0.8 * s**2], axis=-1))
    assert np.isfinite(cusp.normals(np.array([0.1, 0.2]))).all()
    with pytest.raises(gf.InvalidInputError, match=r"singular at parameters 0\.0: the tangent has no"):
        cusp.normals(np.array([0.2, 0.0]))
    cone = ParametricSurface(
        lambda p: np.stack([p[:, 1] * np.cos(p[:, 0]), p[:, 1] * np.sin(p[:, 0]), p[:, 1]], axis=-1)
    )
    with pytest.raises(gf.InvalidInputError, match=r"singular at parameters \[1\.0, 0\.0\]"):
        cone.normals(np.array([[1.0, 0.0]]))


def test_a_surface_that_returns_nan_is_refused_with_its_parameters():
    hole = ParametricSurface(
        lambda p: np.where(p[:, :1] > 0.5, np.nan, np.column_stack([p, np.zeros(len(p))])),
        object_side="against",
    )
    surface = contacts_on(hole, hole, hole)
    with pytest.raises(gf.InvalidInputError, match=r"parameters \[0\.25, 0\.0, 0\.0, 0\.0, 0\.75, 0\.0\]"):
        gf.plan(surface, [0.25, 0, 0, 0, 0.75, 0], 0.1, 0.05, [(0, 1)] * 6, max_candidates=9)


def test_ties_make_the_tile_of_its_four_contacts():
    params = np.random.default_rng(1).uniform(-0.2, 0.2, (7, 4))
    positions, _ = TILE.surface(params)
    np.testing.assert_array_equal(positions[:, 1, :2], -positions[:, 0, :2])
    np.testing.assert_array_equal(positions[:, 3, :2], -positions[:, 2, :2])
    np.testing.assert_allclose(positions[:, :2, 2] + positions[:, [1, 0], 2], 0.01, atol=1e-15)


def test_mirror_images_lie_on_the_other_side_with_mirrored_normals():
    surface = mirrored(contacts_on(ellipse(0.2, 0.1)), normal=(2, 0), through=(0.5, 3.0))
    positions, normals = surface(np.array([[0.3], [1.1]]))
    np.testing.assert_allclose(positions[:, 1], [1, 0] + positions[:, 0] * [-1, 1], atol=1e-15)
    np.testing.assert_allclose(normals[:, 1], normals[:, 0] * [-1, 1], atol=1e-15)


def test_places_bring_their_friction_and_limits_and_the_caller_comes_first():
    rough, smooth = ellipse(0.1, 0.1), ellipse(0.1, 0.1)
    places = [
        PlanarCurve(curve.point, curve.tangent, "left", friction, limit)
        for curve, friction, limit in ((rough, 0.8, 5.0), (smooth, 0.2, 20.0), (rough, 0.8, 10.0))
    ]
    surface = contacts_on(*places)
    arguments = ([0.0, 2.0, 4.0], 0.3, 0.1, [(-1, 7)] * 3)
    own = gf.plan(surface, *arguments)
    told = gf.plan(
        contacts_on(*[ellipse(0.1, 0.1)] * 3),
        *arguments,
        friction=[0.8, 0.2, 0.8],
        max_normal_force=[5.0, 20.0, 10.0],
    )
    assert own.quality.rho == told.quality.rho
    assert gf.plan(surface, *arguments, friction=0.5).quality.rho != own.quality.rho
    with pytest.raises(gf.InvalidInputError, match="friction: contact 1 has none"):
        contacts_on(places[0], ellipse(1, 1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (contacts_on, "at least one contact"),
        (lambda: contacts_on(ellipse(1, 1), tile_side("upper"))(np.zeros((2, 3))), "contact 1 has points"),
        (lambda: contacts_on(ellipse(1, 1))(np.zeros((2, 3))), r"params: shape \(2, 3\), expected \(B, 1\)"),
        (lambda: tied(contacts_on(ellipse(1, 1)), np.ones((2, 1))), "matrix: 2 rows for a surface of 1"),
        (lambda: tied(contacts_on(ellipse(1, 1)), [[np.nan]]), "matrix, entry"),
        (lambda: mirrored(contacts_on(ellipse(1, 1)), (0, 0)), "no direction"),
        (lambda: mirrored(contacts_on(ellipse(1, 1)), (0, 0, 1))(np.zeros((1, 1))), "3 components"),
        (lambda: mirrored(lambda p: p, (0, 1)), "not an arrangement"),
        (lambda: ParametricSurface(lambda p: p, object_side="left"), "object_side"),
        (lambda: line((0, 0), (1, 0, 0), object_side="left"), "start and direction"),
    ],
)
def test_bad_arrangements_are_refused(make, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        make()
