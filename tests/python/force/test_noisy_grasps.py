"""Grasps that act along some directions by noise of their normals alone: least squares, gaps, histories."""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust.degenerate_nearest import cases

import graspforce as gf

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")


def opposite_normals(rng: np.random.Generator) -> gf.Grasp:
    """Draw frictionless contacts in the plane whose normals are opposite but for noise."""
    count = int(rng.integers(2, 6))
    sides = np.where(np.arange(count) % 2, -1.0, 1.0)
    noise = 10.0 ** rng.uniform(-13, -11.3)
    positions = np.column_stack([0.05 * sides, np.zeros(count)])
    normals = np.column_stack([-sides, noise * rng.normal(size=count)])
    return gf.Grasp(positions, normals, friction=0.0, max_normal_force=100.0)


@pytest.mark.parametrize("limits", [False, True])
@pytest.mark.parametrize("pull", [False, True])
def test_least_squares_are_solved_where_the_maximum_is(limits, pull):
    rng = np.random.default_rng(15)
    for _ in range(60):
        grasp = opposite_normals(rng)
        m = grasp.num_contacts
        options = {"limits": limits, "weights": 10.0 ** rng.uniform(-3, 3, m)}
        if pull:
            options["reference"] = np.column_stack([rng.uniform(0, 60, m), np.zeros(m)])
        weights, reference = options["weights"], options.get("reference", np.zeros((m, 2)))[:, 0]
        wrench = [100.0 * rng.choice([-1, 1]) * rng.uniform(0.2, 0.9), 0, 0]
        most = gf.ForceDistributor(grasp, "max").solve(wrench)
        found = gf.ForceDistributor(grasp, "squares", **options).solve(wrench)
        assert most.balanced
        assert found.balanced
        assert found.gap <= 1e-9
        # Less than the least squares of the equation along the normals alone is impossible:
        # f = max(reference + z side / weight, 0), by bisection.
        sides = np.where(np.arange(m) % 2, -1.0, 1.0)

        def forces(z, sides=sides, weights=weights, reference=reference):
            return np.clip(reference - z * sides / weights, 0, 100.0 if limits else np.inf)

        low, high = -1e8, 1e8
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if wrench[0] > sides @ forces(middle) else (middle, high)
        least = 0.5 * (weights * (forces(low) - reference) ** 2).sum()
        assert found.value >= least * (1 - 1e-6)
        if m == 2 and found.fell_back:
            np.testing.assert_allclose(found.forces[:, 0], forces(low), atol=1e-4)


@pytest.mark.parametrize("noise", [1e-12, 1e-11, 1e-10])
def test_one_finger_of_two_pushes_alone(noise):
    grasp = gf.Grasp([(0.05, 0), (-0.05, 0)], [(-1, noise), (1, noise)], friction=0.0, max_normal_force=100)
    found = gf.ForceDistributor(grasp, objective="squares").solve([100, 0, 0])
    np.testing.assert_allclose(found.forces[:, 0], [100, 0], atol=1e-6)
    assert found.balanced


def test_batches_give_the_gap_of_each_row_and_keep_forces_that_are_not_proven():
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    distributor = gf.ForceDistributor(grasp)
    wrenches = [[0, -1, 0], [0, -5, 0], [float("nan"), 0, 0]]
    batch = distributor.solve_many(wrenches, infeasible="nearest")
    assert (batch.gap[:2] <= 1e-9).all()
    assert np.isnan(batch.gap[2])
    assert batch.to_dict()["gap"][2] is None
    assert distributor.solve_many(wrenches[:1]).gap[0] <= 1e-9
    forces = np.empty((2, 2))
    distance, gap = distributor.nearest_into(wrenches[1], forces, return_gap=True)
    assert distance == pytest.approx(1.0)
    assert gap <= 1e-9


def test_rows_with_a_wide_gap_have_the_status_of_the_single_call():
    loose = 0
    for grasp, wrench, objective, options in cases(200, 3):
        distributor = gf.ForceDistributor(grasp, objective, **options)
        alone = distributor.nearest(wrench)
        row = distributor.solve_many([wrench], infeasible="nearest")
        expected = gf.Status.NOT_CONVERGED if row.gap[0] > 1e-9 else gf.Status.SOLVED
        assert row.status[0] == expected
        assert np.isfinite(row.forces).all()
        np.testing.assert_allclose(
            row.distance[0], alone.distance, rtol=1e-6, atol=1e-9 * np.abs(wrench).max()
        )
        loose += expected == gf.Status.NOT_CONVERGED
    assert loose < 20


def test_nearest_forces_do_not_depend_on_earlier_wrenches():
    rng = np.random.default_rng(4)
    for grasp, wrench, objective, options in cases(120, 5):
        fresh = gf.ForceDistributor(grasp, objective, **options).nearest(wrench)
        distributor = gf.ForceDistributor(grasp, objective, **options)
        for earlier in (wrench, 3 * wrench, np.abs(wrench).max() * rng.normal(size=6)):
            distributor.nearest(earlier)
            again = distributor.nearest(wrench)
            size = max(np.abs(fresh.forces).max(), 1e-300)
            assert again.value == pytest.approx(fresh.value, rel=1e-6, abs=1e-300)
            assert np.abs(again.forces - fresh.forces).max() <= 1e-5 * size or not fresh.unique
