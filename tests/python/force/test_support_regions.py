"""Support regions beside linear and conic programs, and what patches of contact can exert.

The full run is `python -m benches.trust support_regions`.
"""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust import degenerate_regions
from benches.trust.support_regions import judged

import graspforce as gf

UP = (0.0, 0.0, 1.0)
LEGS = [(0.2, 0.1, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0), (0.2, -0.1, 0)]


def table(limit: float = 100.0, **options) -> gf.Grasp:
    return gf.Grasp(LEGS, [UP] * 4, max_normal_force=limit, **options)


@pytest.mark.parametrize(("cones", "tolerance", "gap"), [(False, 1e-8, 0.0), (True, 1e-7, 1e-5)])
def test_random_stances_agree_with_independent_programs(cones, tolerance, gap):
    ends = {seed: judged(seed, cones=cones, tolerance=tolerance, gap=gap) for seed in range(40)}
    assert not {seed: end for seed, end in ends.items() if end not in ("right", "undecided")}
    assert list(ends.values()).count("right") > 30


def test_degenerate_regions_agree_with_rational_programs():
    # Each kind four times, and those that rounding once got wrong.
    seeds = [*range(44), 225, 269, 297, 335, 434, 1488]
    ends = {seed: degenerate_regions.judged(seed) for seed in seeds}
    assert not {seed: end for seed, end in ends.items() if end != "right"}


@pytest.mark.parametrize("gap", [1e-2, 1e-6])
def test_a_region_smaller_than_the_gap_leaves_open_at_first_is_a_point_or_thin(gap):
    places = [(-0.07, -0.08, 0.09), (-0.04, 0.19, -0.01)]
    normals = [(-0.42, 0.17, 0.48), (-0.11, 0.23, 1.03)]
    feet = gf.Grasp(places, normals, friction=0.6, max_normal_force=100.0, edges=None)
    region = gf.support_region(feet, 100.0, gap=gap)
    assert region.converged
    thin = gf.Grasp([(0, 0, 0), (1, 0, 0), (1, 1e-6, 0), (0, 1e-6, 0)], [UP] * 4, max_normal_force=200.0)
    region = gf.support_region(thin, 100.0, gap=gap)
    assert (region.shape, region.converged) == ("polygon", True)
    assert region.inner_area == pytest.approx(1e-6, rel=1e-2)


def test_a_table_that_bears_enough_stands_between_its_legs():
    region = gf.support_region(table(), 100.0)
    assert region.shape == "polygon"
    assert region.converged
    assert region.area_gap < 1e-12
    assert region.inner_area == pytest.approx(0.08, rel=1e-12)
    assert {tuple(corner) for corner in region.inner.round(9)} == {leg[:2] for leg in LEGS}
    points = [(0.2, 0.1), (0.2 + 1e-6, 0.1), (0, 0), (0.19, 0), (0.3, 0)]
    assert region.contains(points).tolist() == [True, False, True, True, False]
    np.testing.assert_allclose(region.margin(points), [0, -1e-6, 0.1, 0.01, -0.1], atol=1e-12)
    assert region.margin((0, 0)).shape == ()


def test_limits_shrink_the_region_down_to_nothing():
    # Two legs on one side bear at most 60 of 100 N: a fifth of the way from the middle to the legs.
    assert np.abs(gf.support_region(table(30.0), 100.0).inner).max(axis=0) == pytest.approx([0.04, 0.02])
    assert gf.support_region(table(25.0), 100.0).shape == "point"
    empty = gf.support_region(table(24.9), 100.0)
    assert (empty.shape, len(empty.inner), empty.contains((0, 0)), empty.margin((0, 0))) == (
        "empty", 0, False, -np.inf,
    )  # fmt: skip
    # Each leg bears the whole limit, but only one at a time.
    assert gf.support_region(table(100.0), 100.0, "sum").inner_area == pytest.approx(0.08)
    assert gf.support_region(table(99.0), 100.0, "sum").shape == "empty"


@pytest.mark.parametrize("edges", [4, 8, None])
@pytest.mark.parametrize("seed", range(8))
def test_without_limits_the_region_is_that_of_limits_far_above_the_weight(edges, seed):
    random = np.random.default_rng(seed)
    number = int(random.integers(3, 6))
    places = random.uniform(-0.3, 0.3, (number, 3)) * [1, 1, 0.3]
    normals = 0.25 * random.standard_normal((number, 3)) + UP
    feet = gf.Grasp(places, normals, friction=0.5, edges=edges, torsion=0.01 * (seed % 2))
    load = {"acceleration": 0.3 * random.standard_normal(3), "height": 0.4}
    weight = (70.0, 1e-3, 1e5, 1e9)[seed % 4]
    free = gf.support_region(feet, weight, "max", limits=False, **load)
    strong = feet.replace(max_normal_force=1e3 * weight)
    for criterion in ("max", "sum"):
        region = gf.support_region(strong, weight, criterion, **load)
        assert region.shape == free.shape
        assert free.inner_area <= region.outer_area * (1 + 1e-9)
        assert region.inner_area <= free.outer_area * (1 + 1e-9)
    assert free.converged


@pytest.mark.parametrize("edges", [8, None])
@pytest.mark.parametrize("weight", [1e-3, 10.0, 1e5, 1e9])
def test_without_limits_a_table_stands_whatever_it_weighs(edges, weight):
    legs = gf.Grasp([(x, y, 0) for x in (-0.1, 0.1) for y in (-0.2, 0.2)], [UP] * 4, edges=edges)
    region = gf.support_region(legs, weight, limits=False)
    assert region.converged
    assert region.inner_area == pytest.approx(0.08, rel=1e-6)


def test_without_limits_contacts_that_press_against_each_other_leave_no_bounded_region():
    walls = gf.Grasp([(-0.3, 0, 0), (0.3, 0, 0), (0, 0.2, 0.1)], [(1, 0, 0), (-1, 0, 0), UP])
    with pytest.raises(gf.InvalidInputError, match=r"limits: False leaves no bounded region"):
        gf.support_region(walls, 10.0, limits=False)
    smooth = gf.Grasp(walls.positions[:2], walls.normals[:2], friction=0.0)
    empty = gf.support_region(smooth, 10.0, limits=False)
    assert empty.shape == "empty"
    # The walls reach no further along the witness, whatever they press; the weight demands more.
    assert (smooth.primitive_wrenches @ empty.witness <= 1e-12).all()
    assert empty.witness[2] > 0


def test_two_feet_hold_a_segment_and_one_holds_a_point():
    two = gf.support_region(gf.Grasp(LEGS[:3:2], [UP] * 2, max_normal_force=100.0, edges=None), 100.0)
    assert two.shape == "segment"
    np.testing.assert_allclose(sorted(two.inner.tolist()), [(-0.2, -0.1), (0.2, 0.1)], atol=1e-9)
    assert two.contains([(0, 0), (0.1, 0.05), (0.1, 0)]).tolist() == [True, True, False]
    one = gf.support_region(gf.Grasp(LEGS[:1], [UP], max_normal_force=100.0), 100.0)
    assert one.shape == "point"
    np.testing.assert_allclose(one.inner, [(0.2, 0.1)], atol=1e-12)


def test_an_acceleration_moves_the_region_with_the_height():
    region = gf.support_region(table(1000.0, friction=1.0), 100.0, acceleration=(2.0, 0, 0), height=0.5)
    shift = 0.5 * 2.0 / 9.80665
    np.testing.assert_allclose(region.inner.max(axis=0), [0.2 + shift, 0.1], atol=1e-9)
    slips = gf.support_region(table(1000.0, friction=0.2), 100.0, acceleration=(2.0, 0, 0))
    assert slips.shape == "empty"
    assert slips.witness is not None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weight": 0.0}, "weight: 0 must be finite and positive"),
        ({"weight": np.nan}, "weight: NaN"),
        ({"acceleration": (0, 0)}, r"acceleration: shape \(2,\), expected \(3,\)"),
        ({"acceleration": (0, 0, -9.80665)}, "acceleration: .* takes all weight"),
        ({"height": np.inf}, "height: inf"),
        ({"external_wrench": [0] * 5}, r"external_wrench: shape \(5,\)"),
        ({"gap": 1.0}, "gap: 1 must be"),
        ({"criterion": "min"}, "criterion: 'min'"),
        ({"max_directions": 3}, "max_directions: 3"),
        ({"grasp": None}, "grasp: None is not a Grasp"),
    ],
)
def test_an_unusable_argument_is_named(changes, message):
    arguments = {"grasp": table(), "weight": 100.0, **changes}
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.support_region(**arguments)


def test_planar_contacts_and_points_of_another_shape_are_refused():
    with pytest.raises(gf.InvalidGraspError, match="planar"):
        gf.support_region(gf.Grasp([(0, 0)], [(0, 1)]), 1.0)
    with pytest.raises(gf.InvalidInputError, match=r"points: shape \(3,\)"):
        gf.support_region(table(), 100.0).contains((0, 0, 0))


def test_a_patch_exerts_what_a_pressure_over_it_does():
    foot = gf.Grasp(
        **gf.patch((1, 2, 0), (0, 0, 2), 0.1, 0.05, friction=0.5, max_normal_force=400.0), edges=64
    )
    forces = gf.ForceDistributor(foot, "max")

    def tilted(x: float, y: float) -> float:
        return forces.solve([0, 0, -100, *np.cross((1 + x, 2 + y, 0), (0, 0, -100))]).sigma_max

    # The centre of pressure stays within the rectangle; at a corner that corner alone bears all.
    assert tilted(0.1, 0.05) == pytest.approx(1.0)
    with pytest.raises(gf.InfeasibleWrenchError):
        tilted(0.101, 0.05)
    # Yaw: friction times the normal force at the distance of the corners.
    yaw = 0.5 * 100 * np.hypot(0.1, 0.05)
    about = np.cross((1, 2, 0), (0, 0, -100))
    assert forces.solve([0, 0, -100, *about[:2], 0.99 * yaw]).sigma_max < 1
    with pytest.raises(gf.InfeasibleWrenchError):
        forces.solve([0, 0, -100, *about[:2], 1.01 * yaw])


def test_patches_follow_their_headings_and_refuse_what_has_none():
    feet = gf.patch([(0, 0, 0), (1, 0, 0)], UP, [0.1, 0.2], 0.05, heading=[(0, 1, 1), (1, 0, 0)])
    np.testing.assert_allclose(feet["positions"][0], [-0.05, 0.1, 0])
    np.testing.assert_allclose(feet["positions"][4], [1.2, 0.05, 0])
    assert feet["friction"].shape == (8,)
    for changes, message in [
        ({"normal": (0, 0, 0)}, "normal, row 0: no direction"),
        ({"heading": (0, 0, 1)}, "heading, row 0: .* parallel"),
        ({"half_x": -1}, "half_x, row 0: -1.0 must be at least 0"),
        ({"position": (0, 0)}, r"position: shape \(2,\)"),
        ({"max_normal_force": 0.0}, "max_normal_force, row 0"),
    ]:
        with pytest.raises(gf.InvalidInputError, match=message):
            gf.patch(**{"position": (0, 0, 0), "normal": UP, "half_x": 0.1, "half_y": 0.05, **changes})
