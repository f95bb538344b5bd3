"""What a grasp accepts, and how it refuses the rest: by argument, contact and value."""

import itertools

import numpy as np
import pytest

import graspforce as gf

PLANAR = {"positions": [(-1, 0), (1, 0), (0, 1)], "normals": [(1, 0), (-1, 0), (0, -1)], "friction": 0.5}
SPATIAL = {
    "positions": [(-1, 0, 0), (1, 0, 0), (0, 1, 0)],
    "normals": [(1, 0, 0), (-1, 0, 0), (0, -1, 0)],
    "friction": 0.5,
}


def misaligned(rows):
    """Return numbers at an address that no double has, as fields of packed records have them."""
    numbers = np.array(rows, dtype=float)
    moved = np.zeros(numbers.nbytes + 1, np.uint8)[1:].view(float).reshape(numbers.shape)
    moved[...] = numbers
    assert not moved.flags.aligned
    return moved


@pytest.mark.parametrize("base", [PLANAR, SPATIAL], ids=["planar", "spatial"])
@pytest.mark.parametrize(
    "convert",
    [
        lambda rows: [list(row) for row in rows],
        lambda rows: np.array(rows, dtype=np.int32),
        lambda rows: np.array(rows, dtype=np.float32),
        lambda rows: np.array(rows, dtype=np.float64, order="F"),
        lambda rows: np.repeat(np.array(rows, dtype=float), 2, axis=0)[::2],
        lambda rows: np.array(rows, dtype=float)[::-1][::-1],
        lambda rows: np.array(rows, dtype=">f8"),
        misaligned,
    ],
    ids=[
        "lists",
        "int32",
        "float32",
        "Fortran order",
        "strided",
        "reversed twice",
        "big endian",
        "misaligned",
    ],
)
def test_any_real_array_makes_the_same_grasp(base, convert):
    same = {**base, "positions": convert(base["positions"]), "normals": convert(base["normals"])}
    expected = gf.Grasp(**base).primitive_wrenches
    np.testing.assert_array_equal(gf.Grasp(**same).primitive_wrenches, expected)


def test_scalars_stand_for_every_contact():
    each = {**PLANAR, "friction": [0.5] * 3, "max_normal_force": np.full(3, 4.0)}
    expected = gf.Grasp(**PLANAR, max_normal_force=4).primitive_wrenches
    np.testing.assert_array_equal(gf.Grasp(**each).primitive_wrenches, expected)


def test_normals_of_any_length_mean_their_direction():
    longer = {**PLANAR, "normals": [(3, 0), (-1e-200, 0), (0, -1e100)]}
    np.testing.assert_array_equal(
        gf.Grasp(**longer).primitive_wrenches, gf.Grasp(**PLANAR).primitive_wrenches
    )


def test_a_frictionless_contact_has_one_extreme_force():
    assert gf.Grasp(**{**PLANAR, "friction": [0.5, 0, 0.5]}).primitive_wrenches.shape == (5, 3)


def test_contacts_may_have_different_numbers_of_edges():
    assert gf.Grasp(**SPATIAL, edges=[3, 4, 8]).primitive_wrenches.shape == (15, 6)


@pytest.mark.parametrize(
    ("base", "change", "fragments"),
    [
        (PLANAR, {"positions": [(-1, 0), (np.nan, 0), (0, 1)]}, ["positions", "contact 1", "not finite"]),
        (SPATIAL, {"normals": [(1, 0, 0), (0, 0, 0), (0, 1, 0)]}, ["normals", "contact 1", "0.0"]),
        (PLANAR, {"normals": [(1, 0), (-1, 0), (0, np.inf)]}, ["normals", "contact 2", "inf"]),
        (PLANAR, {"friction": -0.1}, ["friction", "contact 0", "-0.1"]),
        (PLANAR, {"friction": [0.5, 0.5, -2]}, ["friction", "contact 2", "-2"]),
        (PLANAR, {"friction": np.nan}, ["friction", "contact 0", "NaN"]),
        (PLANAR, {"max_normal_force": [1, 0, 1]}, ["max_normal_force", "contact 1", "0"]),
        (PLANAR, {"max_normal_force": np.inf}, ["max_normal_force", "contact 0", "inf"]),
        (PLANAR, {"torsion": 0.1}, ["torsion", "contact 0", "planar"]),
        (SPATIAL, {"torsion": -1}, ["torsion", "contact 0", "-1"]),
        (SPATIAL, {"edges": 2}, ["edges", "contact 0", "2"]),
        (SPATIAL, {"tangents": [(1, 0, 0), (0, 1, 0), (1, 0, 0)]}, ["tangents", "contact 0", "parallel"]),
        (PLANAR, {"length_scale": 0.0}, ["length_scale", "0"]),
        (PLANAR, {"friction_margin": 0.5}, ["friction_margin", "0.5"]),
        (PLANAR, {"origin": (np.nan, 0)}, ["origin", "NaN"]),
    ],
)
def test_bad_values_are_refused_by_argument_contact_and_value(base, change, fragments):
    with pytest.raises(gf.InvalidGraspError) as caught:
        gf.Grasp(**{**base, **change})
    for fragment in fragments:
        assert fragment in str(caught.value)


@pytest.mark.parametrize(
    ("base", "change", "argument"),
    [
        (PLANAR, {"positions": np.zeros((0, 2)), "normals": np.zeros((0, 2))}, "positions"),
        (PLANAR, {"positions": np.zeros(3)}, "positions"),
        (PLANAR, {"positions": np.zeros((3, 4))}, "positions"),
        (PLANAR, {"normals": [(1, 0), (-1, 0)]}, "normals"),
        (SPATIAL, {"normals": [(1, 0), (-1, 0), (0, 1)]}, "normals"),
        (PLANAR, {"friction": [0.5, 0.5]}, "friction"),
        (PLANAR, {"max_normal_force": np.ones((3, 1))}, "max_normal_force"),
        (SPATIAL, {"tangents": np.ones((2, 3))}, "tangents"),
        (SPATIAL, {"edges": [4, 4]}, "edges"),
        (SPATIAL, {"origin": (0, 0)}, "origin"),
        (PLANAR, {"positions": [["a", "b"]] * 3}, "positions"),
        (PLANAR, {"positions": np.ones((3, 2), dtype=complex)}, "positions"),
        (PLANAR, {"friction": "rough"}, "friction"),
    ],
)
def test_wrong_shapes_and_types_are_refused_by_argument(base, change, argument):
    with pytest.raises((gf.InvalidGraspError, TypeError), match=argument):
        gf.Grasp(**{**base, **change})


def test_every_refusal_is_also_a_value_error():
    assert issubclass(gf.InvalidGraspError, ValueError)
    assert issubclass(gf.InvalidInputError, ValueError)
    assert issubclass(gf.InvalidGraspError, gf.GraspForceError)


@pytest.mark.parametrize("criterion", ["mean", "", None, 3])
def test_an_unknown_criterion_is_refused(criterion):
    with pytest.raises((gf.InvalidInputError, TypeError), match="criterion"):
        gf.Grasp(**PLANAR).quality(criterion)


@pytest.mark.parametrize("rtol", [0.0, -1.0, 1.0, float("nan")])
def test_a_tolerance_must_lie_between_zero_and_one(rtol):
    with pytest.raises(gf.InvalidInputError, match="rtol"):
        gf.Grasp(**PLANAR).quality("max", rtol=rtol)


def test_misaligned_wrenches_and_points_are_read_like_others():
    grasp = gf.Grasp(**SPATIAL)
    wrenches = np.array([[0.1, -0.5, 0, 0, 0, 0.01], [0, -0.2, 0.1, 0, 0.01, 0]])
    distributor = gf.ForceDistributor(grasp)
    np.testing.assert_array_equal(
        distributor.solve(misaligned(wrenches[0])).forces, distributor.solve(wrenches[0]).forces
    )
    assert len(distributor.solve_many(misaligned(wrenches))) == 2
    np.testing.assert_array_equal(grasp.resistance(misaligned(wrenches)), grasp.resistance(wrenches))


@pytest.mark.parametrize("argument", ["edges", "extreme_forces"])
def test_an_iterator_without_end_is_refused(argument):
    endless = itertools.repeat(8 if argument == "edges" else [[1.0, 0.5], [1.0, -0.5]])
    with pytest.raises(gf.InvalidGraspError, match=f"{argument}: more than 3 .* for 3 contacts"):
        gf.Grasp(**PLANAR, **{argument: endless})
