"""Contacts on meshes: exact projection, normals, exclusions, and what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from trimesh.proximity import closest_point_naive

import graspforce as gf
from graspforce.surfaces import MeshSurface, contacts_on


def sphere(radius=0.05, subdivisions=3):
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def test_projection_is_to_the_nearest_point_of_the_mesh():
    mesh = trimesh.creation.annulus(0.02, 0.05, 0.03)
    points = np.random.default_rng(0).normal(scale=0.06, size=(200, 3))
    found, _ = MeshSurface(mesh).contacts(points)
    expected, distance, _ = closest_point_naive(mesh, points)
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), distance, atol=1e-12)
    # Where the nearest point is unique, as it is for points off the axes of symmetry, it is the same one.
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_interpolated_normals_are_nearly_radial_and_face_normals_those_of_the_faces():
    points = np.random.default_rng(1).normal(size=(100, 3))
    where, smooth = MeshSurface(sphere()).contacts(points)
    radial = -where / np.linalg.norm(where, axis=1)[:, None]
    assert (smooth * radial).sum(axis=1).min() > 0.9999
    mesh = sphere(subdivisions=1)
    _, flat = MeshSurface(mesh, normals="face").contacts(points)
    assert np.abs(flat @ -mesh.face_normals.T).max(axis=1) == pytest.approx(1)


def test_units_scale_the_mesh():
    metres = MeshSurface(sphere(0.05))
    millimetres = MeshSurface(sphere(50.0), unit="mm")
    np.testing.assert_allclose(metres.bounds, millimetres.bounds, atol=1e-12)


def test_sharp_edges_are_excluded_by_their_curvature():
    box = trimesh.creation.box((0.06, 0.04, 0.02))
    for _ in range(4):
        box = box.subdivide()
    surface = MeshSurface(box, normals="face", max_curvature=200.0)
    assert 0 < surface.allowed.sum() < len(surface.faces)
    points, _ = surface.contacts(np.array([[0.03, 0.02, 0.01]]))
    # The corner itself is out of reach, the middle of a side is not.
    assert np.linalg.norm(points - [0.03, 0.02, 0.01]) > 1e-3
    np.testing.assert_allclose(surface.contacts(np.array([[0.1, 0, 0]]))[0], [[0.03, 0, 0]], atol=1e-12)


def test_faces_inside_another_part_are_excluded():
    outer = trimesh.creation.box((0.1, 0.1, 0.1))
    inner = trimesh.creation.box((0.02, 0.02, 0.02))
    stuck = trimesh.creation.box((0.02, 0.02, 0.1))
    stuck.apply_translation((0, 0, 0.09))
    surface = MeshSurface(trimesh.util.concatenate([outer, inner, stuck]))
    assert not surface.allowed[12:24].any()
    assert surface.allowed[:12].all()
    assert 0 < surface.allowed[24:].sum() < 12


def test_a_plan_on_a_sphere_ends_at_an_even_spread():
    surface = contacts_on(*[MeshSurface(sphere(1.0), friction=0.3)] * 3)
    start = [1, 0.1, 0.2, -0.5, 0.9, 0, -0.4, -0.9, 0.1]
    plan = gf.plan(surface, start, 0.4, 0.01, [(-1, 1)] * 9, "sum", edges=16)
    assert plan.blocks == ((0, 1, 2), (3, 4, 5), (6, 7, 8))
    positions = plan.grasp.positions
    assert np.linalg.norm(positions.sum(axis=0)) < 0.1
    assert "3 blocks" in repr(plan)


def open_sphere():
    mesh = sphere()
    mesh.update_faces(np.arange(len(mesh.faces)) != 5)
    return mesh


def inside_out():
    mesh = sphere()
    mesh.invert()
    return mesh


def inconsistent():
    mesh = sphere()
    faces = mesh.faces.copy()
    faces[3] = faces[3][::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def broken():
    vertices = sphere().vertices.copy()
    vertices[7, 1] = np.nan
    return trimesh.Trimesh(vertices, sphere().faces, process=False)


def flat():
    corners = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)]
    return trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 1)], process=False)


def triangles(vertices=None, faces=None):
    """Return a stand-in for a mesh: trimesh itself would mend or refuse some of these."""
    mesh = sphere()
    kept = mesh.vertices if vertices is None else vertices
    return SimpleNamespace(vertices=kept, faces=mesh.faces if faces is None else faces)


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (flat, {}, "flat: it encloses no volume"),
        (
            lambda: triangles(faces=[(0, 1, 9999)]),
            {},
            r"face 0: \[0.0, 1.0, 9999.0\] must be whole numbers from 0 to 641",
        ),
        (lambda: triangles(faces=[(0, 1, -1)]), {}, "face 0"),
        (lambda: triangles(faces=[(0, 1, 2.5)]), {}, "face 0: .* must be whole numbers"),
        (lambda: triangles(faces=[(0, 1)]), {}, r"faces of shape \(1, 2\)"),
        (lambda: triangles(vertices=np.zeros((642, 2))), {}, r"vertices float64 of shape \(642, 2\)"),
        (sphere, {"unit": None}, "unit: None is not a real number"),
        (sphere, {"max_curvature": "5"}, "max_curvature: '5' is not a real number"),
        (sphere, {"max_curvature": np.nan}, "max_curvature: nan"),
        (open_sphere, {}, r"not watertight: 3 of \d+ edges"),
        (inside_out, {}, "inside out: its normals point inward"),
        (inconsistent, {}, "oriented differently"),
        (lambda: sphere(60.0), {}, r"unit: the mesh would be 120 m long"),
        (sphere, {"unit": "furlong"}, "unit: 'furlong' is none of"),
        (sphere, {"unit": -1.0}, "unit: -1.0 must be"),
        (sphere, {"normals": "vertex"}, "normals: 'vertex'"),
        (sphere, {"max_curvature": 0.0}, "none of 1280 faces remains"),
        (sphere, {"allowed": [True]}, "allowed: bool of shape"),
        (broken, {}, "vertex 7 is not finite"),
        (lambda: None, {}, "has no triangles"),
        (trimesh.Trimesh, {}, "has no triangles"),
    ],
)
def test_meshes_that_cannot_be_grasped_are_refused(make, options, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        MeshSurface(make(), **options)


def test_checks_can_be_waived():
    assert MeshSurface(open_sphere(), check_watertight=False).allowed.sum() == 1279
    assert MeshSurface(sphere(60.0), check_size=False).bounds.max() == pytest.approx(60.0)


def test_files_are_read_and_unreadable_ones_named(tmp_path):
    path = tmp_path / "ball.obj"
    sphere().export(path)
    assert MeshSurface.load(path).bounds.max() == pytest.approx(0.05, rel=1e-3)
    (tmp_path / "empty.obj").write_text("nothing\n")
    others = [f"other.{kind}" for kind in ("3mf", "dae", "step", "svg", "zip", "glb", "ply", "stl")]
    for name in others:
        (tmp_path / name).write_bytes(b"nothing of that kind")
    for name in ("empty.obj", "missing.obj", "what.xyz123", *others):
        with pytest.raises(gf.InvalidInputError, match=name.partition(".")[0]):
            MeshSurface.load(tmp_path / name)


def test_points_that_are_not_finite_are_refused():
    with pytest.raises(gf.InvalidInputError, match="points, row 1"):
        MeshSurface(sphere()).contacts(np.array([[0, 0, 0], [0, np.inf, 0]]))
