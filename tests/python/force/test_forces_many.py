"""Least forces of many grasps in one call, and their gradients."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.moved_contacts import ellipsoid_grasps, slopes

import graspforce as gf

ROWS = 1000

OBJECTIVES: dict[str, dict[str, Any]] = {
    "max": {"objective": "max"},
    "sum": {"objective": "sum"},
    "weighted": {"objective": "max", "weight": 0.1},
    "squares": {"objective": "squares"},
    "squares within limits": {"objective": "squares", "limits": True, "max_normal_force": 3.0},
    "squares with slack": {"objective": "squares", "slack": 3.0},
}
CONTACTS: dict[str, tuple[int, dict[str, Any]]] = {
    "planar": (2, {}),
    "pyramids": (3, {"edges": 8}),
    "true cones": (3, {"edges": None}),
    "soft true cones": (3, {"edges": None, "torsion": 0.1}),
}


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("contacts", CONTACTS)
def test_the_gradient_is_that_of_central_differences(objective: str, contacts: str) -> None:
    dim, options = CONTACTS[contacts]
    rng = np.random.default_rng(3)
    rows = ROWS if "soft" not in contacts else ROWS // 4
    positions, normals = ellipsoid_grasps(rng, rows, dim)
    wrenches = rng.normal(size=(rows, 1, 3 * dim - 3))
    options = {**options, **OBJECTIVES[objective], "friction": 0.6}
    found = gf.forces_many(positions, normals, wrenches, gradient=True, **options)
    solved = found.status == 0
    assert solved.mean() > 0.5
    gradient = found.gradient
    assert gradient is not None
    assert gradient.unique[solved].mean() > 0.99

    def sigma(r: Any, n: Any, w: Any, **tangents: Any) -> Any:
        return gf.forces_many(r, n, w, **options, **tangents).sigma

    check = solved & gradient.unique
    for difference, slope in slopes(rng, sigma, positions, normals, wrenches, gradient):
        scale = np.abs(difference) + np.abs(slope) + 1e-2 * found.sigma
        # A step may cross a kink: then both sides differ, in a row or two.
        wrong = check & ~(np.abs(difference - slope) <= 1e-4 * scale)
        assert wrong.sum() <= 2, np.argwhere(wrong)


@pytest.mark.parametrize("contacts", CONTACTS)
@pytest.mark.parametrize("objective", ["max", "squares"])
def test_the_gradient_of_the_distance_is_that_of_central_differences(contacts: str, objective: str) -> None:
    dim, options = CONTACTS[contacts]
    rng = np.random.default_rng(4)
    rows = ROWS // 4
    positions, normals = ellipsoid_grasps(rng, rows, dim)
    wrenches = 2.0 * rng.normal(size=(rows, 1, 3 * dim - 3))
    options = {
        **options,
        "objective": objective,
        "friction": 0.6,
        "infeasible": "nearest",
        "length_scale": 0.7,
    }
    found = gf.forces_many(positions, normals, wrenches, gradient=True, **options)
    assert (found.status == 0).all()
    gradient = found.distance_gradient
    assert gradient is not None
    assert (gradient.positions[found.balanced] == 0.0).all()

    def distance(r: Any, n: Any, w: Any, **tangents: Any) -> Any:
        return gf.forces_many(r, n, w, **options, **tangents).distance

    check = gradient.unique & ~found.balanced
    assert check.mean() > 0.5
    for difference, slope in slopes(rng, distance, positions, normals, wrenches, gradient):
        wrong = check & ~(np.abs(difference - slope) <= 1e-5 * (1.0 + np.abs(slope)))
        assert wrong.sum() <= 1, np.argwhere(wrong)


@pytest.mark.parametrize("infeasible", ["status", "nearest"])
@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("contacts", ["planar", "pyramids", "true cones"])
def test_a_batch_gives_what_a_distributor_gives(objective: str, contacts: str, infeasible: str) -> None:
    dim, options = CONTACTS[contacts]
    rng = np.random.default_rng(5)
    positions, normals = ellipsoid_grasps(rng, 12, dim)
    wrenches = rng.normal(size=(5, 3 * dim - 3))
    grasp_options = {**options, "friction": 0.6, "length_scale": 0.5}
    chosen = dict(OBJECTIVES[objective])
    if "max_normal_force" in chosen:
        grasp_options["max_normal_force"] = chosen.pop("max_normal_force")
    found = gf.forces_many(positions, normals, wrenches, infeasible=infeasible, **grasp_options, **chosen)
    for row in range(12):
        grasp = gf.Grasp(positions[row], normals[row], **grasp_options)
        distributor = gf.ForceDistributor(grasp, **chosen)
        for k, wrench in enumerate(wrenches):
            try:
                if infeasible == "nearest":
                    expected = distributor.nearest(wrench)
                else:
                    expected = distributor.solve(wrench)
            except gf.InfeasibleWrenchError:
                assert found.status[row, k] == gf.Status.INFEASIBLE
                assert np.isnan(found.forces[row, k]).all()
                continue
            assert found.status[row, k] == gf.Status.SOLVED
            assert found.balanced[row, k] == expected.balanced
            assert found.sigma[row, k] == pytest.approx(expected.value, rel=1e-8, abs=1e-9)
            assert found.distance[row, k] == pytest.approx(expected.distance, rel=1e-6, abs=1e-9)
            np.testing.assert_allclose(found.forces[row, k], expected.forces, atol=2e-4)


def test_rows_of_bad_input_get_a_status_and_harm_no_other_row() -> None:
    rng = np.random.default_rng(6)
    positions, normals = ellipsoid_grasps(rng, 8, 3)
    wrenches = rng.normal(size=(8, 3, 6))
    positions[0, 1, 2] = np.nan
    normals[1, 0] = 0.0
    positions[2], normals[2] = positions[2, 0], normals[2, 0]
    wrenches[3, 1, 4] = np.inf
    positions[4] *= 1e200
    for objective in ("max", "sum", "squares"):
        for edges in (8, None):
            for infeasible in ("status", "nearest"):
                options: dict[str, Any] = {"objective": objective, "edges": edges, "infeasible": infeasible}
                found = gf.forces_many(positions, normals, wrenches, gradient=True, **options)
                assert (found.status[[0, 1, 4]] == gf.Status.INVALID).all()
                assert sorted(found.errors) == [0, 1, 4]
                assert found.status[3, 1] == gf.Status.INVALID
                assert found.status[2, 0] == (
                    gf.Status.SOLVED if infeasible == "nearest" else gf.Status.INFEASIBLE
                )
                solved = found.status == 0
                for gradient in (found.gradient, found.distance_gradient):
                    if gradient is None:
                        assert infeasible == "status"
                        continue
                    for field in ("positions", "normals", "spins", "external_wrench"):
                        finite = np.isfinite(getattr(gradient, field)).reshape(*solved.shape, -1)
                        assert (finite.all(axis=-1) == solved).all()
                    assert not gradient.unique[~solved].any()
                others = gf.forces_many(positions[5:], normals[5:], wrenches[5:], **options)
                np.testing.assert_array_equal(found.sigma[5:], others.sigma)


def test_one_contact_gets_a_status() -> None:
    found = gf.forces_many([[(0.0, 0.0, 0.0)]], [[(0.0, 0.0, 1.0)]], np.eye(6), edges=None, gradient=True)
    assert (found.status == gf.Status.INFEASIBLE).all()
    held = gf.forces_many([[(0.0, 0.0, 0.0)]], [[(0.0, 0.0, 1.0)]], [[0, 0, -1.0, 0, 0, 0]], gradient=True)
    assert held.sigma[0, 0] == pytest.approx(1.0)
    assert held.gradient is not None
    assert not held.gradient.unique[0, 0]


def test_shared_wrenches_are_those_of_each_grasp() -> None:
    rng = np.random.default_rng(7)
    positions, normals = ellipsoid_grasps(rng, 6, 3)
    wrenches = rng.normal(size=(4, 6))
    shared = gf.forces_many(positions, normals, wrenches)
    each = gf.forces_many(positions, normals, np.broadcast_to(wrenches, (6, 4, 6)))
    np.testing.assert_array_equal(shared.forces, each.forces)
    assert shared.forces.shape == (6, 4, 5, 3)
    assert not shared.forces.flags.writeable
    assert shared.to_dict()["status"] == shared.status.tolist()
    assert repr(shared).startswith("GraspForces(6 grasps, 4 wrenches of each, ")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"external_wrenches": np.zeros((2, 5))},
            "external_wrenches: shape (2, 5), expected (K, 6) or (6, K, 6)",
        ),
        ({"infeasible": "raise"}, "infeasible: 'raise' is neither 'status' nor 'nearest'"),
        ({"metric": np.eye(6)}, 'metric: only infeasible="nearest" takes it'),
        ({"slack": 1.0}, 'slack: only the objective "squares" takes it'),
        ({"gradient": 1}, "gradient: 1 is neither True nor False"),
    ],
)
def test_an_argument_that_all_rows_share_is_refused_by_name(options: dict[str, Any], message: str) -> None:
    positions, normals = ellipsoid_grasps(np.random.default_rng(8), 6, 3)
    with pytest.raises(gf.InvalidInputError) as refused:
        gf.forces_many(positions, normals, **{"external_wrenches": np.eye(6), **options})
    assert message in str(refused.value)


@pytest.mark.parametrize("infeasible", ["status", "nearest"])
def test_a_ragged_batch_gives_what_its_grasps_give(infeasible: str) -> None:
    rng = np.random.default_rng(9)
    counts = [4, 0, 5, 1, 6]
    parts = [ellipsoid_grasps(rng, 1, 3, count) if count else (np.zeros((1, 0, 3)),) * 2 for count in counts]
    positions, normals = (np.concatenate([part[side][0] for part in parts]) for side in (0, 1))
    wrenches = rng.normal(size=(5, 3, 6))
    offsets = np.cumsum([0, *counts])
    options: dict[str, Any] = {"friction": 0.7, "infeasible": infeasible, "gradient": True}
    found = gf.forces_many(positions, normals, wrenches, offsets=offsets, **options)
    assert found.forces.shape == (16, 3, 3)
    assert found.status[1].tolist() == [gf.Status.INVALID] * 3
    for row, count in enumerate(counts):
        if not count:
            continue
        own = slice(offsets[row], offsets[row + 1])
        alone = gf.forces_many(positions[None, own], normals[None, own], wrenches[row], **options)
        np.testing.assert_array_equal(found.sigma[row], alone.sigma[0])
        np.testing.assert_array_equal(found.forces[own], alone.forces[0].swapaxes(0, 1))
        for gradient, expected in (
            (found.gradient, alone.gradient),
            (found.distance_gradient, alone.distance_gradient),
        ):
            assert (gradient is None) == (expected is None)
            if gradient is None or expected is None:
                continue
            np.testing.assert_array_equal(gradient.positions[own], expected.positions[0].swapaxes(0, 1))
            np.testing.assert_array_equal(gradient.spins[own], expected.spins[0].T)
            np.testing.assert_array_equal(gradient.external_wrench[row], expected.external_wrench[0])
    with pytest.raises(gf.InvalidInputError, match="weights: beside offsets"):
        gf.forces_many(
            positions, normals, wrenches, offsets=offsets, objective="squares", weights=np.ones(16)
        )
