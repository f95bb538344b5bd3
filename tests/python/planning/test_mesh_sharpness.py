"""Contacts keep away from sharp edges and corners by the radius, however the mesh is cut into triangles."""

import numpy as np
import pytest
import trimesh

import graspforce as gf
from graspforce.surfaces import MeshSurface

BOX = np.array([0.06, 0.04, 0.02])


def refined(mesh, times):
    for _ in range(times):
        mesh = mesh.subdivide()
    return mesh


def chamfered(width):
    corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * BOX / 2
    cut = [corners - np.sign(corners) * width * (1 - np.eye(3)[axis]) for axis in range(3)]
    return trimesh.convex.convex_hull(np.vstack(cut))


def asked(mesh, number=400):
    return np.random.default_rng(0).uniform(*(1.3 * mesh.bounds), (number, 3))


def to_edges_of_the_box(points):
    """Distance (B,) of points on the surface of the box to its edges."""
    below = np.sort(BOX / 2 - np.abs(points), axis=1)
    return np.hypot(below[:, 0], below[:, 1])


@pytest.mark.parametrize("times", [0, 1, 4])
@pytest.mark.parametrize("curvature", [100, 200, 1000])
def test_contacts_on_a_box_keep_the_radius_from_its_edges_and_no_more(curvature, times):
    mesh = refined(trimesh.creation.box(BOX), times)
    surface = MeshSurface(mesh, normals="face", max_curvature=curvature)
    radius = 1 / curvature
    points, _ = surface.contacts(np.vstack([asked(mesh), [BOX / 2]]))
    assert to_edges_of_the_box(points).min() >= radius * (1 - 1e-3)
    # The corner's nearest place is next to the border of what is left.
    assert to_edges_of_the_box(points[-1:])[0] <= 1.05 * radius + 1e-4
    middle = [[0, 0, 0.1]]
    np.testing.assert_allclose(surface.contacts(middle)[0], [[0, 0, 0.01]], atol=1e-12)


def test_coarse_and_fine_meshes_of_a_shape_leave_the_same_region():
    for make in (lambda: trimesh.creation.box(BOX), lambda: chamfered(0.004)):
        coarse = MeshSurface(make(), normals="face", max_curvature=150)
        fine = MeshSurface(refined(make(), 4), normals="face", max_curvature=150)
        points = asked(make())
        apart = np.linalg.norm(points - coarse.contacts(points)[0], axis=1)
        np.testing.assert_allclose(
            np.linalg.norm(points - fine.contacts(points)[0], axis=1), apart, atol=5e-4
        )


@pytest.mark.parametrize("subdivisions", [1, 2, 3, 4])
def test_a_sphere_is_kept_whole_or_excluded_by_its_radius(subdivisions):
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.05)
    surface = MeshSurface(ball, max_curvature=21)
    assert surface.allowed.all()
    points = asked(ball)
    np.testing.assert_array_equal(surface.contacts(points)[0], MeshSurface(ball).contacts(points)[0])
    with pytest.raises(gf.InvalidInputError, match=r"max_curvature: none .* 15\.0 rad"):
        MeshSurface(ball, max_curvature=15)


@pytest.mark.parametrize("seed", range(3))
def test_an_irregular_mesh_of_a_sphere_is_kept(seed):
    points = np.random.default_rng(seed).normal(size=(1000, 3))
    ball = trimesh.convex.convex_hull(0.05 * points / np.linalg.norm(points, axis=1)[:, None])
    assert MeshSurface(ball, max_curvature=40).allowed.all()


@pytest.mark.parametrize("sections", [12, 32, 128])
def test_the_side_of_a_cylinder_is_kept_up_to_the_radius_from_its_rims(sections):
    rod = trimesh.creation.cylinder(radius=0.03, height=0.1, sections=sections)
    surface = MeshSurface(rod, max_curvature=40)
    points, _ = surface.contacts(asked(rod))
    height = np.abs(points[np.hypot(points[:, 0], points[:, 1]) > 0.02, 2]).max()
    assert 0.025 * (1 - 1e-3) <= 0.05 - height <= 0.025 * 1.05 + 1e-4
    np.testing.assert_allclose(surface.contacts([[0.1, 0.0, 0.01]])[0][0, 2], 0.01, atol=1e-9)
    with pytest.raises(gf.InvalidInputError, match=r"max_curvature: none .* 30\.0 rad"):
        MeshSurface(rod, max_curvature=30)


def test_the_tip_of_a_cone_is_sharp_and_its_side_is_kept_away_from_it():
    cone = trimesh.creation.cone(radius=0.03, height=0.1, sections=64)
    surface = MeshSurface(cone, max_curvature=100)
    tip = cone.vertices[np.argmax(cone.vertices[:, 2])]
    points, _ = surface.contacts(np.vstack([asked(cone), [tip]]))
    assert np.linalg.norm(points - tip, axis=1).min() >= 0.01 * (1 - 1e-3)


def test_a_place_too_near_an_edge_is_refused_on_its_face():
    surface = MeshSurface(trimesh.creation.box(BOX), normals="face", max_curvature=100)
    face = int(np.flatnonzero(surface.allowed)[0])
    with pytest.raises(gf.InvalidInputError, match=r"weights, row 0: .* from a sharp edge or corner"):
        surface.on_faces([face], [[0.98, 0.01, 0.01]])
