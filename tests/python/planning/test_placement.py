"""Quality under placement noise: reproducible, consistent with its parts, and a criterion of the planner."""

import tracemalloc

import numpy as np
import pytest

import graspforce as gf
from graspforce.planning import placement_noise as placement_module
from graspforce.surfaces import contacts_on, ellipse

ANGLES = np.array([[0.0, 2.1, 4.2], [0.1, 1.9, 4.0]])
OUTWARD = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=-1)
OPTIONS = {"friction": 0.5, "length_scale": 0.1}


def test_without_noise_every_sample_is_the_grasp_itself():
    noisy = gf.PlacementNoise(samples=5).quality(0.1 * OUTWARD, -OUTWARD, **OPTIONS)
    nominal = gf.quality_many(0.1 * OUTWARD, -OUTWARD, **OPTIONS).epsilon
    np.testing.assert_allclose(noisy.epsilon, np.repeat(nominal[:, None], 5, axis=1), rtol=1e-12)
    np.testing.assert_allclose(noisy.mean, nominal, rtol=1e-12)


def test_statistics_are_those_of_the_samples_measured_one_by_one():
    placement = gf.PlacementNoise(position_std=0.01, normal_std=0.1, samples=40, seed=5)
    noisy = placement.quality(0.1 * OUTWARD, -OUTWARD, **OPTIONS)
    positions, normals = placement.perturbed(0.1 * OUTWARD, -OUTWARD)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, rtol=1e-12)
    one = [gf.Grasp(p, n, **OPTIONS).quality().epsilon for p, n in zip(positions[1], normals[1], strict=True)]
    np.testing.assert_allclose(noisy.epsilon[1], one, rtol=1e-9, atol=1e-12)
    assert noisy.percentile_5[1] == pytest.approx(np.percentile(one, 5), rel=1e-9)
    again = placement.quality(0.1 * OUTWARD, -OUTWARD, **OPTIONS)
    np.testing.assert_array_equal(noisy.epsilon, again.epsilon)


@pytest.mark.parametrize("dim", [2, 3])
def test_noise_has_the_deviations_asked_for(dim):
    normals = np.zeros((1, 4, dim))
    normals[..., 0] = 3.0
    placement = gf.PlacementNoise(position_std=0.02, normal_std=0.05, samples=20_000)
    positions, tilted = placement.perturbed(0 * normals, normals)
    assert positions.std() == pytest.approx(0.02, rel=0.01)
    assert tilted[..., 1:].std() == pytest.approx(0.05, rel=0.01)


def in_space(rows):
    outward = np.random.default_rng(0).normal(size=(rows, 4, 3))
    return outward / np.linalg.norm(outward, axis=-1, keepdims=True)


def test_the_closure_rate_of_true_cones_is_that_of_their_samples():
    placement = gf.PlacementNoise(position_std=0.3, normal_std=0.3, samples=30)
    noisy = placement.quality(in_space(1), -in_space(1), friction=0.5, edges=None)
    assert noisy.closure_rate[0] == pytest.approx((noisy.epsilon[0] > 0).mean())
    assert 0 < noisy.closure_rate[0] < 1


@pytest.mark.parametrize("shared", [False, True])
def test_every_noisy_copy_keeps_the_tangents_it_is_given(shared):
    outward = in_space(2)
    tangents = np.random.default_rng(1).normal(size=(4, 3) if shared else (2, 4, 3))
    placement = gf.PlacementNoise(position_std=0.02, normal_std=0.05, samples=10)
    options = {"friction": 0.6, "edges": 3}
    noisy = placement.quality(outward, -outward, tangents, **options)
    positions, normals = placement.perturbed(outward, -outward)
    for row in range(2):
        along = tangents if shared else tangents[row]
        pairs = zip(positions[row], normals[row], strict=True)
        one = [gf.Grasp(p, n, tangents=along, **options).quality().epsilon for p, n in pairs]
        np.testing.assert_allclose(noisy.epsilon[row], one, rtol=1e-9, atol=1e-12)
    # With three edges their directions matter.
    assert np.abs(noisy.epsilon - placement.quality(outward, -outward, **options).epsilon).max() > 1e-3


@pytest.mark.parametrize("length", [1e-300, 1e-200, 1e200, 1e300])
def test_normals_of_any_length_are_worth_the_same(length):
    placement = gf.PlacementNoise(position_std=0.01, normal_std=0.1, samples=10)
    expected = placement.quality(0.1 * OUTWARD, -OUTWARD, **OPTIONS).epsilon
    found = placement.quality(0.1 * OUTWARD, -length * OUTWARD, **OPTIONS).epsilon
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_memory_does_not_grow_with_the_number_of_grasps(monkeypatch):
    monkeypatch.setattr(placement_module, "_ROWS", 500)
    outward = np.repeat(OUTWARD, 50, axis=0)
    placement = gf.PlacementNoise(position_std=0.01, normal_std=0.1, samples=500)
    tracemalloc.start()
    placement.quality(outward, -outward, rtol=0.1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # All noise at once would be 100 x 500 x 3 contacts of 4 doubles: 4.8 MB before any copy.
    assert peak < 3e6


def test_no_grasps_are_worth_nothing_and_no_contacts_are_refused():
    none = gf.PlacementNoise(samples=4).quality(np.zeros((0, 3, 2)), np.zeros((0, 3, 2)))
    assert none.epsilon.shape == (0, 4)
    assert none.mean.shape == none.percentile_5.shape == none.closure_rate.shape == (0,)
    with pytest.raises(gf.InvalidInputError, match="m at least 1"):
        gf.PlacementNoise().quality(np.zeros((1, 0, 2)), np.zeros((1, 0, 2)))
    with pytest.raises(
        gf.InvalidInputError, match=r"tangents: shape \(3, 3\), expected \(1, 4, 3\) or \(4, 3\)"
    ):
        gf.PlacementNoise().quality(in_space(1), -in_space(1), np.ones((3, 3)))


def test_the_planner_improves_the_statistic_it_is_given():
    egg = contacts_on(*[ellipse(0.05, 0.03)] * 3)
    arguments = (egg, [0.0, 2.0, 4.5], 0.4, 0.05, [(-1, 7)] * 3)
    options = {"friction": 0.4, "length_scale": 0.05}
    for statistic in ("mean", "percentile_5"):
        placement = gf.PlacementNoise(position_std=0.004, normal_std=0.15, samples=32, statistic=statistic)
        robust = gf.plan(*arguments, placement=placement, **options)
        nominal = gf.plan(*arguments, **options)
        worth = {}
        for name, plan in (("robust", robust), ("nominal", nominal)):
            grasp = plan.grasp
            found = placement.quality(grasp.positions[None], grasp.normals[None], **options)
            worth[name] = getattr(found, statistic)[0]
        assert worth["robust"] == pytest.approx(-robust.history[-1].rho, rel=1e-9)
        assert worth["robust"] > 1.02 * worth["nominal"]
        assert robust.quality.closure == "force"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position_std": -1.0}, "position_std: -1.0"),
        ({"normal_std": np.nan}, "normal_std: nan"),
        ({"samples": 0}, "samples: 0"),
        ({"samples": 2.5}, "samples: 2.5 is not a whole number"),
        ({"seed": -1}, "seed: -1 must be at least 0"),
        ({"statistic": "median"}, "statistic: 'median'"),
    ],
)
def test_bad_noise_is_refused(change, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.PlacementNoise(**change)


def test_a_row_that_is_no_grasp_is_named():
    normals = -OUTWARD.copy()
    normals[1, 2] = 0
    with pytest.raises(gf.InvalidGraspError, match=r"row 1, contact 2: \[0.0, 0.0\] has no direc") as raised:
        gf.PlacementNoise(samples=4).quality(OUTWARD, normals)
    assert raised.value.row == 1


def test_an_option_with_a_row_for_each_grasp_holds_for_all_its_copies(monkeypatch):
    outward = in_space(3)
    placement = gf.PlacementNoise(position_std=0.02, normal_std=0.05, samples=10)
    options = {
        "friction": np.random.default_rng(1).uniform(0.4, 0.8, (3, 4)),
        "max_normal_force": np.random.default_rng(2).uniform(1, 2, (3, 4)),
        "torsion": np.random.default_rng(3).uniform(0.1, 0.2, (3, 4)),
        "origin": np.random.default_rng(4).normal(size=(3, 3)),
        "length_scale": [0.5, 1.0, 2.0],
    }
    # Two grasps at a time, so that their rows are told apart from those of all.
    monkeypatch.setattr(placement_module, "_ROWS", 20)
    noisy = placement.quality(outward, -outward, **options)
    for row in range(3):
        own = {name: np.asarray(values)[row] for name, values in options.items()}
        alone = placement.quality(outward[row : row + 1], -outward[row : row + 1], **own)
        np.testing.assert_array_equal(noisy.epsilon[row], alone.epsilon[0])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"friction": np.full((3, 4), 0.5)}, "friction: 3 rows for 2 grasps"),
        ({"length_scale": [1.0]}, "length_scale: 1 rows for 2 grasps"),
        ({"friction": [[0.5], [0.5, 0.5]]}, "friction"),
        ({"friction": np.full((2, 3), 0.5)}, "friction: shape"),
    ],
)
def test_options_with_rows_of_other_grasps_are_refused(options, message):
    with pytest.raises((gf.InvalidInputError, gf.InvalidGraspError), match=message):
        gf.PlacementNoise(samples=4).quality(in_space(2), -in_space(2), **options)
