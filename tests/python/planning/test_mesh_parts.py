"""Meshes of several parts: the surface is the boundary of their union; a part that is no solid is named."""

import sys
import time

import numpy as np
import pytest
import trimesh
from benches.trust.mesh_unions import KINDS, assembly, faults

import graspforce as gf
from graspforce.surfaces import MeshSurface
from graspforce.viewer.state import ViewState


def box(*extents, at=(0, 0, 0)):
    made = trimesh.creation.box(extents)
    made.apply_translation(at)
    return made


def joined(*parts, merged=False):
    mesh = trimesh.util.concatenate(list(parts))
    if merged:
        mesh.merge_vertices()
    return mesh


def area(surface):
    vertices, faces = surface.boundary
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize("kind", KINDS)
def test_contacts_lie_on_the_boundary_of_the_union_and_reach_all_of_it(kind):
    start = KINDS.index(kind)
    for seed in range(start, start + 5 * len(KINDS), len(KINDS)):
        assert faults(assembly(seed, kind), np.random.default_rng(seed)) is None, (kind, seed)


@pytest.mark.parametrize(("length", "expected"), [(6, 10.0), (1.5, 6.4), (1.0, 6.0), (0.8, 6.0)])
def test_a_rod_through_a_cube_adds_what_sticks_out_of_it(length, expected):
    surface = MeshSurface(joined(box(1, 1, 1), box(0.2, 0.2, length)), normals="face", check_size=False)
    assert area(surface) == pytest.approx(expected, rel=1e-9)
    points, _ = surface.contacts(np.random.default_rng(0).uniform(*surface.bounds.T, (500, 3)))
    inside = np.abs(points).max(axis=1) < 0.5 - 1e-9
    assert not inside.any()
    np.testing.assert_allclose(surface.contacts([[0.7, 0, 0]])[0], [[0.5, 0, 0]], atol=1e-9)
    end = max(length, 1) / 2
    np.testing.assert_allclose(surface.contacts([[0, 0, 5]])[0], [[0, 0, end]], atol=1e-9)


@pytest.mark.parametrize("merged", [False, True])
def test_parts_that_touch_are_one_solid_however_they_are_turned(merged):
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.4, 0.8]))
    for at, expected in [((0, 0, 1), 10.0), ((0, 0.3, 1), 10 + 2 * 0.3), ((1, 1, 0), 12.0), ((0, 0, 0), 6.0)]:
        mesh = joined(box(1, 1, 1), box(1, 1, 1, at=at), merged=merged)
        for _ in range(2):
            assert area(MeshSurface(mesh)) == pytest.approx(expected, rel=1e-6)
            mesh.apply_transform(turn)


def test_an_inward_part_is_a_cavity_and_what_is_in_the_cavity_stays():
    hole = box(0.6, 0.6, 0.6)
    hole.invert()
    surface = MeshSurface(joined(box(1, 1, 1), hole, box(0.2, 0.2, 0.2)), normals="face")
    assert surface.allowed.all()
    points, normals = surface.contacts([[0.28, 0, 0], [0.12, 0, 0], [0.6, 0, 0]])
    np.testing.assert_allclose(points[:, 0], [0.3, 0.1, 0.5], atol=1e-9)
    np.testing.assert_allclose(normals[:, 0], [1, -1, -1], atol=1e-9)
    through = MeshSurface(joined(box(1, 1, 1), hole, box(0.1, 0.1, 3)), normals="face", check_size=False)
    np.testing.assert_allclose(through.contacts([[0.06, 0, 0]])[0], [[0.05, 0, 0]], atol=1e-9)


def inverted():
    part = box(0.1, 0.1, 0.1, at=(2, 0, 0))
    part.invert()
    return part


def opened():
    part = box(0.1, 0.1, 0.1, at=(0.5, 0, 0))
    part.update_faces(np.arange(12) != 3)
    return part


def twisted():
    part = box(0.1, 0.1, 0.1)
    faces = part.faces.copy()
    faces[2] = faces[2][::-1]
    return trimesh.Trimesh(part.vertices, faces, process=False)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (opened, r"part 1 of 2 \(faces 12 to 22, about \[0.5, 0, 0\] m\): not watertight: 3 of \d+ edges"),
        (inverted, r"part 1 of 2 \(faces 12 to 23, .*\): inside out: .* no other part is around it"),
        (twisted, r"part 1 of 2 \(faces 12 to 23, .*\): faces are oriented differently"),
    ],
)
def test_a_part_that_is_no_solid_is_named_with_the_reason(part, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        MeshSurface(joined(box(1, 1, 1), part()), check_size=False)


def test_a_part_with_holes_that_is_let_through_is_warned_of_by_name():
    with pytest.warns(gf.GraspWarning, match="part 2 of 3 .*not solid"):
        surface = MeshSurface(
            joined(box(1, 1, 1), box(0.2, 0.2, 3), opened()), check_watertight=False, check_size=False
        )
    assert area(surface) == pytest.approx(6 + 2 * 2 * 0.2 * 4 * 0.5 + 0.01 * 5.5, rel=1e-6)


def test_faces_keep_their_numbers_and_covered_places_are_refused():
    surface = MeshSurface(joined(box(1, 1, 1), box(0.2, 0.2, 6)), normals="face", check_size=False)
    side = int(np.flatnonzero((surface.vertices[surface.faces][:, :, 0] == 0.1).all(axis=1))[0])
    corners = surface.vertices[surface.faces[side]]
    at_top = np.where(corners[:, 2] > 0, 0.45, 0.05)
    points, normals = surface.on_faces([side], [at_top / at_top.sum()])
    assert abs(points[0, 2]) > 0.5
    np.testing.assert_allclose(normals, [[-1, 0, 0]], atol=1e-12)
    halves = np.where(corners[:, 2] > 0, 0.5 / (corners[:, 2] > 0).sum(), 0.5 / (corners[:, 2] < 0).sum())
    with pytest.raises(gf.InvalidInputError, match=r"row 0: .* lies in another part"):
        surface.on_faces([side], [halves])


def test_curved_parts_keep_their_own_normals_up_to_where_they_meet():
    balls = [trimesh.creation.icosphere(subdivisions=4, radius=0.05) for _ in range(2)]
    balls[1].apply_translation((0.06, 0, 0))
    surface = MeshSurface(joined(*balls))
    points, normals = surface.contacts(np.random.default_rng(1).normal(0, 0.1, (300, 3)))
    radial = np.array([[0, 0, 0], [0.06, 0, 0]])[:, None] - points
    cosines = (normals * radial).sum(axis=2) / np.linalg.norm(radial, axis=2)
    on = np.abs(np.linalg.norm(radial, axis=2) - 0.05) < 2e-4
    assert np.where(on, cosines, -1).max(axis=0).min() > 0.999


def test_parts_apart_need_no_other_package_and_parts_together_say_which(monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    apart = MeshSurface(joined(box(0.1, 0.1, 0.1), box(0.1, 0.1, 0.1, at=(0.3, 0, 0))))
    assert apart.allowed.all()
    with pytest.raises(gf.MissingExtraError, match=r"manifold3d is not installed.*graspforce\[mesh\]"):
        MeshSurface(joined(box(0.1, 0.1, 0.1), box(0.02, 0.02, 0.3)))


@pytest.mark.alone
def test_many_overlapping_parts_take_time_in_proportion():
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    took = []
    for count in (50, 200):
        places = np.random.default_rng(0).uniform(0, count ** (1 / 3) * 0.05, (count, 3))
        parts = [ball.copy() for _ in places]
        for part, place in zip(parts, places, strict=True):
            part.apply_translation(place)
        mesh = joined(*parts)
        began = time.perf_counter()
        MeshSurface(mesh)
        took.append(time.perf_counter() - began)
    # Four times the parts: quadratic time would be sixteen times as much.
    assert took[1] < 12 * took[0] + 0.5


def test_the_viewer_moves_contacts_on_the_outside_of_all_parts():
    mesh = joined(box(0.1, 0.1, 0.1), box(0.02, 0.02, 0.3))
    grasp = gf.Grasp([(0.05, 0, 0), (-0.05, 0, 0)], [(-1, 0, 0), (1, 0, 0)])
    state = ViewState(grasp, (mesh.vertices, mesh.faces))
    np.testing.assert_allclose(state.move(0, (0.012, 0.045, 0.0)), [0.012, 0.05, 0.0], atol=1e-9)
