"""Places for contacts: computed normals, ties, mirror images, and what is refused."""

import numpy as np
import pytest

import graspforce as gf
from graspforce.paper import TILE, tile_side
from graspforce.surfaces import (
    ParametricSurface,
    PlanarCurve,
    contacts_on,
    cylinder,
    ellipse,
    ellipsoid,
    line,
    mirrored,
    tied,
)


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
        (lambda: line((0, 0), (0, 0), object_side="left"), r"direction: \[0.0, 0.0\] has no direction"),
        (lambda: line((0, np.nan), (0, 1), object_side="left"), "start, entry 1: nan is not finite"),
        (lambda: ellipse(-1, 1), "semi_x: -1.0 must be positive"),
        (lambda: ellipse(1, 0), "semi_y: 0.0 must be positive"),
        (lambda: ellipse(1, "1"), "semi_y: '1' is not a real number"),
        (lambda: ellipse(1, 1, pressed_from="outsid"), "pressed_from: 'outsid' is neither 'outside' nor"),
        (lambda: ellipsoid(1, 1, 1, pressed_from="in"), "pressed_from: 'in'"),
        (lambda: ellipsoid(1, -1, 1), "semi_y: -1.0"),
        (lambda: cylinder(1, pressed_from="in"), "pressed_from: 'in'"),
        (lambda: cylinder(np.inf), "radius: inf is not finite"),
        (lambda: contacts_on("a"), "places: contact 0: 'a' is no curve, surface or mesh"),
        (lambda: contacts_on(ellipse(1, 1), None), "places: contact 1: None"),
    ],
)
def test_bad_arrangements_are_refused(make, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        make()


def turning(rate):
    """Return a unit circle run through at `rate` rad by unit of its parameter."""
    return lambda s: np.stack([np.cos(rate * s), np.sin(rate * s)], axis=-1)


@pytest.mark.parametrize("degrees", [10, 59, 120])
def test_a_kink_is_reported_and_not_averaged(degrees):
    turn = np.deg2rad(degrees)
    kink = PlanarCurve(
        lambda s: (
            np.maximum(s, 0)[:, None] * [np.cos(turn), np.sin(turn)] + np.minimum(s, 0)[:, None] * [1, 0]
        )
    )
    assert np.allclose(kink.normals(np.array([-1e-3])), [[0, 1]])
    with pytest.raises(gf.InvalidInputError, match=r"singular at parameters 0\.0"):
        kink.normals(np.array([0.0]))
    ridge = ParametricSurface(
        lambda p: np.column_stack([p, np.tan(turn / 2) * np.abs(p[:, 0])]), object_side="along"
    )
    with pytest.raises(gf.InvalidInputError, match=r"singular at parameters \[0\.0, 0\.3\]"):
        ridge.normals(np.array([[0.0, 0.3]]))


@pytest.mark.parametrize("rate", [3e5, 1e6, 1.7e6, 2 * np.pi / 6e-6, 1e8])
def test_a_curve_that_turns_faster_than_the_steps_is_reported(rate):
    with pytest.raises(gf.InvalidInputError, match="singular"):
        PlanarCurve(turning(rate)).normals(np.array([0.3]))


@pytest.mark.parametrize("start", [0.0, 1e3, -1e6, 1e9])
def test_computed_normals_hold_for_large_parameters(start):
    params = start + np.linspace(0.1, 3, 7)
    expected = -np.stack([np.cos(params), np.sin(params)], axis=-1)
    np.testing.assert_allclose(PlanarCurve(turning(1.0)).normals(params), expected, atol=1e-4)


def test_where_a_function_ends_one_side_is_enough():
    arc = PlanarCurve(lambda s: np.stack([s, np.where((s >= 0) & (s <= 1), s**2, np.nan)], axis=-1))
    np.testing.assert_allclose(
        arc.normals(np.array([0.0, 1.0])), [[0, 1], np.array([-2, 1]) / np.sqrt(5)], atol=1e-4
    )
    root = PlanarCurve(lambda s: np.stack([s, np.sqrt(s)], axis=-1))
    np.testing.assert_allclose(root.normals(np.array([0.0])), [[-1, 0]], atol=5e-3)
    patch = ParametricSurface(
        lambda p: np.column_stack([p, np.where((p >= 0).all(axis=1), p[:, 0] * p[:, 1], np.nan)])
    )
    np.testing.assert_allclose(patch.normals(np.zeros((1, 2))), [[0, 0, 1]], atol=1e-4)
    alone = PlanarCurve(lambda s: np.stack([s, np.where(s == 0, 0, np.nan)], axis=-1))
    with pytest.raises(gf.InvalidInputError, match="singular"):
        alone.normals(np.array([0.0]))


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_normals_of_any_length_have_directions(size):
    curve = PlanarCurve(lambda s: np.stack([s, s], axis=-1), lambda s: np.full((len(s), 2), size))
    np.testing.assert_allclose(curve.normals(np.zeros(1)), [[-np.sqrt(0.5), np.sqrt(0.5)]], rtol=1e-15)
    sheet = ParametricSurface(lambda p: np.zeros((len(p), 3)), lambda p: np.full((len(p), 3), size))
    np.testing.assert_allclose(sheet.normals(np.zeros((1, 2))), [[np.sqrt(1 / 3)] * 3], rtol=1e-15)


def test_a_place_need_not_know_friction_and_limits():
    class Post:
        """A place with no more than what a place must have."""

        num_params = 1

        def contacts(self, params):
            return ellipse(1.0, 1.0).contacts(params)

    both = contacts_on(Post(), Post())
    assert both.grasp_options == {}
    assert both(np.array([[0.0, np.pi / 2]]))[0].round(12).tolist() == [[[1.0, 0.0], [0.0, 1.0]]]
