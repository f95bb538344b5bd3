"""Contacts anywhere on meshes with face normals: bounds are proofs, beside sampling and known answers."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import graspforce as gf
from graspforce.surfaces import MeshSurface, contacts_on

GRIPPER = {"friction": 0.5, "torsion": 0.005, "length_scale": 0.03}


def box(extents=(0.06, 0.04, 0.02), **options):
    return MeshSurface(trimesh.creation.box(extents), normals="face", **options)


@pytest.mark.parametrize("criterion", ["max", "sum"])
@pytest.mark.parametrize("edges", [8, None])
def test_no_sampled_pinch_of_a_lump_exceeds_the_bound(criterion, edges):
    lump = trimesh.creation.icosphere(subdivisions=1, radius=0.04)
    lump.apply_scale([1, 0.7, 0.5])
    mesh = MeshSurface(lump, normals="face")
    surface = contacts_on(mesh, mesh)
    options = {**GRIPPER, "edges": edges}
    found = gf.plan_global(surface, criterion=criterion, max_opening=0.05, gap=0.03, **options)
    assert (found.stopped, found.proven) == ("tolerance", True)
    assert found.gap <= 0.03
    positions, normals = (part[0] for part in surface(found.params[None]))
    assert np.linalg.norm(positions[0] - positions[1]) <= 0.05
    assert gf.Grasp(positions, normals, **options).quality(criterion).epsilon == found.quality.epsilon
    random = np.random.default_rng(0)
    faces = random.integers(0, len(lump.faces), (2, 20_000))
    places = [mesh.on_faces(face, random.dirichlet([1, 1, 1], len(face))) for face in faces]
    positions, normals = (np.stack(part, axis=1) for part in zip(*places, strict=True))
    near = np.linalg.norm(positions[:, 0] - positions[:, 1], axis=1) <= 0.05
    sampled = gf.quality_many(positions[near], normals[near], criterion=criterion, rtol=1e-3, **options)
    assert sampled.epsilon.max() <= found.epsilon_upper
    # Without the limit a better grasp may exist.
    free = gf.plan_global(surface, criterion=criterion, gap=0.03, **options)
    assert free.epsilon_upper >= found.quality.epsilon


def test_three_contacts_on_a_box_are_bounded_within_the_time():
    mesh = box()
    surface = contacts_on(mesh, mesh, mesh)
    found = gf.plan_global(surface, friction=0.5, length_scale=0.03, gap=0.05, time_limit=5.0)
    assert found.proven
    assert found.stopped in ("tolerance", "time")
    random = np.random.default_rng(0)
    params = random.uniform(*np.tile(mesh.bounds, (3, 1)).T, (5000, 9))
    epsilon = gf.quality_many(*surface(params), friction=0.5, length_scale=0.03, rtol=1e-3).epsilon
    assert epsilon.max() <= found.epsilon_upper


def test_a_gripper_that_cannot_open_finds_no_closure():
    mesh = box()
    found = gf.plan_global(contacts_on(mesh, mesh), max_opening=0.015, **GRIPPER)
    assert found.stopped == "open"
    assert found.epsilon_upper < 1e-4


def test_faces_that_are_not_allowed_are_left_out():
    whole = trimesh.creation.box((0.06, 0.04, 0.02))
    sides = np.abs(whole.face_normals[:, 1]) > 0.5
    mesh = MeshSurface(whole, normals="face", allowed=sides)
    found = gf.plan_global(contacts_on(mesh, mesh), **GRIPPER)
    assert (np.abs(found.grasp.normals[:, 1]) > 0.99).all()


def test_conditions_of_the_caller_hold():
    mesh = box()

    def low(positions, _):
        return (positions[..., 2] < 0).all(axis=-1)

    found = gf.plan_global(
        contacts_on(mesh, mesh), feasible=low, max_opening=0.05, gap=0.2, time_limit=5.0, **GRIPPER
    )
    assert (found.grasp.positions[:, 2] < 0).all()
    assert found.quality.epsilon > 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"max_opening": 0.0}, "max_opening: 0.0 must be positive"),
        ({"max_opening": "wide"}, "max_opening: 'wide'"),
        ({"curvature": np.zeros((2, 6))}, "curvature: meshes with face normals have none"),
        ({"bounds": [(0, 1)] * 6}, "bounds: .* hold the whole meshes"),
    ],
)
def test_bad_arguments_are_refused(change, message):
    mesh = box()
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan_global(**{"surface": contacts_on(mesh, mesh), **GRIPPER, **change})


def test_interpolated_normals_are_refused_by_name():
    mesh = MeshSurface(trimesh.creation.icosphere(subdivisions=1, radius=0.04))
    with pytest.raises(gf.InvalidInputError, match='use "face"'):
        gf.plan_global(contacts_on(mesh, mesh))


def test_bounds_are_needed_elsewhere():
    with pytest.raises(gf.InvalidInputError, match="bounds: None"):
        gf.plan_global(contacts_on(gf.surfaces.ellipse(1, 1)))


def test_a_problem_too_large_says_what_it_would_take():
    ball = MeshSurface(trimesh.creation.icosphere(subdivisions=5, radius=0.04), normals="face")
    with pytest.raises(gf.TooLargeError, match=r"combinations of faces take some .* hours"):
        gf.plan_global(contacts_on(ball, ball, ball))


def test_three_contacts_are_bounded_in_a_metric():
    surface = contacts_on(*[box()] * 3)
    metric = np.diag([1.0, 1.0, 1.0, 1e3, 1e3, 1e3])
    found = gf.plan_global(surface, friction=0.5, metric=metric, gap=0.9, time_limit=20)
    assert np.isfinite(found.epsilon_upper)
    assert found.stopped == "tolerance"
