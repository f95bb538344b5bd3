"""The least friction of a grasp, and its probability of closure."""

from __future__ import annotations

import math

import numpy as np
import pytest

import graspforce as gf
from graspforce.uncertainty.clopper_pearson import binomial_interval


def random_grasp(seed: int, **options) -> gf.Grasp:
    rng = np.random.default_rng([7, seed])
    dim = int(rng.choice([2, 3]))
    outward = rng.standard_normal((int(rng.integers(2, 6)), dim))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    normals = -outward + 0.2 * rng.standard_normal(outward.shape)
    return gf.Grasp(0.05 * outward, normals, length_scale=0.05, **options)


def test_a_grasp_closes_at_the_upper_end_and_not_at_the_lower_one():
    found = 0
    for seed in range(40):
        options = {} if seed % 3 else {"friction_margin": 1.5}
        grasp = random_grasp(seed, **options)
        least = gf.least_friction(grasp, rtol=1e-9, max_friction=5.0)
        assert least.lower <= least.upper
        if math.isinf(least.upper):
            assert least.lower == 5.0
            assert not grasp.replace(friction=5.0).is_force_closure
            continue
        found += 1
        assert grasp.replace(friction=least.upper).is_force_closure
        if least.lower > 0:
            assert not grasp.replace(friction=least.lower).is_force_closure
            assert least.upper - least.lower <= 1e-9 * least.upper
    assert found > 20


def test_a_pinch_needs_the_tangent_of_its_angle():
    # Normals 0.2 rad off the line between the contacts.
    normals = [(math.cos(0.2), math.sin(0.2)), (-math.cos(0.2), math.sin(0.2))]
    pinch = gf.Grasp([(-0.03, 0), (0.03, 0)], normals)
    least = gf.least_friction(pinch, rtol=1e-10)
    assert least.lower <= math.tan(0.2) * (1 + 1e-9)
    assert least.upper == pytest.approx(math.tan(0.2), rel=1e-9)
    straight = gf.least_friction(gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]))
    assert (straight.lower, straight.upper <= 1e-9) == (0.0, True)


def test_a_wrench_is_held_within_the_limits_at_the_upper_end_and_not_at_the_lower_one():
    held = 0
    for seed in range(20):
        grasp = random_grasp(seed, max_normal_force=5.0)
        wrench = np.zeros(grasp.wrench_dim)
        wrench[1] = -1.0
        for criterion in ("max", "sum"):
            least = gf.least_friction(grasp, wrench, criterion, max_friction=5.0)
            for friction, holds in ((least.upper, True), (least.lower, False)):
                if not np.isfinite(friction) or (friction == 0 and least.upper == 0):
                    continue
                distributor = gf.ForceDistributor(grasp.replace(friction=friction), criterion)
                try:
                    sigma = getattr(distributor.solve(wrench), f"sigma_{criterion}")
                except gf.InfeasibleWrenchError:
                    sigma = np.inf
                assert (sigma <= 1 + 1e-8) == holds
                held += holds
    assert held > 15


def test_friction_that_is_no_number_is_refused():
    grasp = random_grasp(1)
    for options, message in [
        ({"rtol": 0.0}, "rtol: 0 must be"),
        ({"max_friction": np.inf}, "max_friction: inf"),
        ({"external_wrench": [1, 2]}, r"external_wrench: shape \(2,\)"),
        ({"criterion": "least"}, "criterion: 'least'"),
    ]:
        with pytest.raises(gf.InvalidInputError, match=message):
            gf.least_friction(grasp, **options)
    general = gf.Grasp([(0, 0)], [(0, 1)], extreme_forces=[[(1, 0.5), (1, -0.5)]])
    with pytest.raises(gf.InvalidGraspError, match="extreme_forces, contact 0"):
        gf.least_friction(general)


def test_the_interval_is_that_of_clopper_and_pearson():
    stats = pytest.importorskip("scipy.stats")
    for trials in (1, 7, 100, 20_000):
        for successes in {0, 1, trials // 3, trials - 1, trials}:
            for confidence in (0.5, 0.95, 0.9999):
                tail, failures = (1 - confidence) / 2, trials - successes
                low = stats.beta.ppf(tail, successes, failures + 1) if successes else 0.0
                high = stats.beta.ppf(1 - tail, successes + 1, failures) if failures else 1.0
                found = binomial_interval(successes, trials, confidence)
                np.testing.assert_allclose(found, (low, high), rtol=1e-8)


def test_intervals_hold_the_probability_as_often_as_they_promise():
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.2)
    many = gf.probability_of_closure(grasp, gf.PlacementNoise(normal_std=0.15, samples=30_000, seed=1))
    missed = 0
    for seed in range(40):
        noise = gf.PlacementNoise(normal_std=0.15, samples=100, seed=100 + seed)
        found = gf.probability_of_closure(grasp, noise, confidence=0.9)
        assert found.lower <= found.estimate <= found.upper
        missed += not found.lower <= many.estimate <= found.upper
    # Binomial, at most a tenth of 40: more than 10 have a probability of 0.2%.
    assert missed <= 10


def test_a_pinch_closes_as_often_as_its_angles_stay_within_both_friction_cones():
    # Tilts t of the normals are normal; the line between the contacts must lie in both cones of half-angle a.
    std, friction = 0.2, 0.3
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=friction)
    found = gf.probability_of_closure(
        grasp, gf.PlacementNoise(normal_std=std, samples=20_000), confidence=0.999
    )
    expected = math.erf(math.atan(friction) / std / math.sqrt(2)) ** 2
    assert found.lower <= expected <= found.upper
    rough = gf.probability_of_closure(grasp, gf.PlacementNoise(samples=2000), friction_std=0.3)
    # Friction is cut off at zero, where the pinch does not close: half of the normal's tail at each contact.
    assert rough.lower <= (1 - 0.5 * math.erfc(1 / math.sqrt(2))) ** 2 <= rough.upper


def test_noise_that_makes_no_sense_is_refused():
    grasp, noise = random_grasp(1), gf.PlacementNoise(0.001)
    for arguments, options, message in [
        ((grasp, noise), {"confidence": 1.0}, "confidence: 1.0"),
        ((grasp, noise), {"friction_std": -1.0}, "friction_std: -1.0"),
        ((grasp, noise), {"friction_std": [0.1] * 9}, "friction_std: .* expected one number"),
        ((grasp, 3), {}, "noise: 3 is not"),
        ((3, noise), {}, "grasp: 3 is not"),
    ]:
        with pytest.raises(gf.InvalidInputError, match=message):
            gf.probability_of_closure(*arguments, **options)


def test_graded_columns_are_those_of_single_grasps():
    pa = pytest.importorskip("pyarrow")
    grasps = [random_grasp(seed) for seed in range(12)]
    table = pa.table(
        {
            "positions": [grasp.positions.tolist() for grasp in grasps] + [[[0.0, 0.0]]],
            "normals": [grasp.normals.tolist() for grasp in grasps] + [[[0.0, 0.0]]],
            "friction": [0.5] * 13,
            "max_normal_force": [1.0] * 13,
        }
    )
    noise = gf.PlacementNoise(position_std=0.002, normal_std=0.1, samples=100)
    graded = gf.grade(table, length_scale=0.05, least_friction=True, noise=noise, friction_std=0.1)
    rows = graded.to_pylist()
    for grasp, row in zip(grasps, rows[:-1], strict=True):
        least = gf.least_friction(grasp)
        assert (row["least_friction_lower"], row["least_friction"]) == pytest.approx(
            (least.lower, least.upper)
        )
        found = gf.probability_of_closure(grasp, noise, friction_std=0.1)
        assert row["closure_probability"] == found.estimate
        assert (row["closure_probability_lower"], row["closure_probability_upper"]) == (
            found.lower,
            found.upper,
        )
    assert rows[-1]["least_friction"] is rows[-1]["closure_probability"] is None
    assert "least_friction" not in gf.grade(table).column_names
