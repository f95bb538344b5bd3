"""Normals that point out of the object are refused with a mesh, and warned of without one."""

import copy
import pickle
import warnings

import numpy as np
import pytest
import trimesh

import graspforce as gf
from graspforce.files import load_grasp
from graspforce.surfaces import MeshSurface, ellipsoid

EGG = ellipsoid(0.03, 0.03, 0.05)
RING = np.array([[0.0, 0.0], [2.1, 0.1], [4.2, -0.1]])


def on_the_egg():
    return EGG.contacts(RING)


def test_outward_normals_on_the_egg_do_not_silently_give_force_closure():
    positions, normals = on_the_egg()
    with pytest.warns(gf.GraspWarning, match="normals: all of them point away") as caught:
        assert gf.Grasp(positions, -normals).quality().closure == "force"
    assert caught[0].filename == __file__
    gf.Grasp(positions, normals)


@pytest.mark.parametrize("seed", range(20))
def test_closed_grasps_are_not_warned_of_and_their_mirror_images_are_where_all_point_away(seed):
    random = np.random.default_rng(seed)
    dim = 2 + seed % 2
    outward = random.normal(size=(int(random.integers(2, 9)), dim))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    positions = outward * 0.05 - outward.mean(axis=0) * 0.05
    towards = positions.mean(axis=0) - positions
    gf.Grasp(positions, towards)
    with pytest.warns(gf.GraspWarning, match="point away from the contacts' centre"):
        gf.Grasp(positions, -towards)


@pytest.mark.parametrize("noise", [0, 1e-12, 1e-9, 1e-6, 1e-4])
def test_feet_on_a_floor_of_uneven_height_are_not_warned_of(noise):
    heights = noise * np.random.default_rng(3).normal(size=4)
    feet = np.column_stack([[0.05, -0.05, -0.05, 0.05], [0.05, 0.05, -0.05, -0.05], heights])
    gf.Grasp(feet, [(0, 0, 1)] * 4)
    gf.Grasp(feet[:1], [(0, 0, 1)])


@pytest.mark.parametrize("far", range(4))
def test_a_contact_in_another_unit_is_named(far):
    positions = np.array([[0.04, 0, 0], [-0.02, 0.03, 0], [-0.02, -0.03, 0], [0, 0, 0.03]])
    normals = -positions
    gf.Grasp(positions, normals)
    positions[far] *= 1000
    with pytest.warns(gf.GraspWarning, match=f"positions, contact {far}: .*same unit"):
        gf.Grasp(positions, normals)
    # A hundred times is the limit.
    pair = np.array([[0, 0.5, 0], [0, -0.5, 0], [99.0, 0, 0]])
    gf.Grasp(pair, -pair)
    with pytest.warns(gf.GraspWarning, match="contact 2"):
        gf.Grasp(pair * [1.02, 1, 1] + [0, 0, 0], -pair)


@pytest.mark.parametrize(
    ("positions", "named"),
    [
        ([(0, 0, 0), (0, 0, 1), (500, 0, 0), (500, 0, 1)], "contacts 2, 3"),
        ([(0, 0, 0), (0, 0, 0), (0, 0, 0), (1, 0, 0)], "contact 3"),
        ([(1, 0, 0), (0, 0, 0), (0, 0, 0)], "contact 0"),
        ([(500, 0, 0), (0, 0, 1), (0, 1, 0), (500, 1, 0), (0, 0, 0)], "contacts 0, 3"),
        ([(0, 0, k) for k in range(9)] + [(1e6, 0, k) for k in range(9)], r"contacts 9, 10, 11, 12, \.\.\."),
    ],
)
def test_groups_of_contacts_far_apart_are_named(positions, named):
    towards = np.mean(positions, axis=0) - positions
    towards[:, 1] += 1e-3
    with pytest.warns(gf.GraspWarning, match=f"positions, {named}: .*same unit"):
        gf.Grasp(positions, towards)


def test_contacts_at_one_place_and_two_far_fingers_are_not_warned_of():
    gf.Grasp([(0, 0, 0)] * 3, [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    gf.Grasp([(-500, 0, 0), (500, 0, 0)], [(1, 0, 0), (-1, 0, 0)])


def test_many_contacts_of_which_one_is_far_are_looked_at_in_linear_time():
    positions = np.random.default_rng(0).normal(size=(100_000, 3))
    positions[77] *= 1e6
    with pytest.warns(gf.GraspWarning, match="contact 77:"):
        gf.Grasp(positions, positions.mean(axis=0) - positions, edges=3)


def test_batches_searches_and_copies_do_not_warn():
    positions, normals = on_the_egg()
    with pytest.warns(gf.GraspWarning):
        grasp = gf.Grasp(positions, -normals)
    again = [pickle.loads(pickle.dumps(grasp)), copy.copy(grasp), copy.deepcopy(grasp)]
    assert all(one.quality().rho == grasp.quality().rho for one in again)
    batch = gf.quality_many([positions], [-normals])
    assert batch.rho[0] == grasp.quality().rho

    def inside(params):
        found = [EGG.contacts(np.column_stack([row, np.zeros_like(row)])) for row in params]
        return np.stack([where for where, _ in found]), -np.stack([inward for _, inward in found])

    gf.plan(inside, [0, 2, 4], 0.5, 0.2, [(-1, 7)] * 3)
    distributor = gf.ForceDistributor(grasp)
    distributor.update(grasp)


def test_where_warnings_are_errors_the_grasp_is_not_made():
    positions, normals = on_the_egg()
    with warnings.catch_warnings():
        warnings.simplefilter("error", gf.GraspWarning)
        with pytest.raises(gf.GraspWarning):
            gf.Grasp(positions, -normals)


def egg_mesh():
    mesh = trimesh.creation.icosphere(subdivisions=3)
    mesh.apply_scale([0.03, 0.03, 0.05])
    return mesh


def test_a_mesh_refuses_outward_normals_by_contact_and_value():
    surface = MeshSurface(egg_mesh())
    positions, normals = surface.contacts(on_the_egg()[0])
    surface.grasp(positions, normals)
    wrong = normals.copy()
    wrong[1] *= -2
    value = ", ".join(str(x) for x in wrong[1])
    with pytest.raises(gf.InvalidInputError, match="normals, contact 1: ") as raised:
        surface.grasp(positions, wrong)
    assert value in str(raised.value)
    assert surface.grasp(positions, wrong, check_normals=False).num_contacts == 3


@pytest.mark.parametrize("seed", range(10))
def test_inward_normals_pass_on_flat_and_round_meshes_at_edges_too(seed):
    random = np.random.default_rng(seed)
    for mesh in (egg_mesh(), trimesh.creation.box((0.06, 0.04, 0.02)), trimesh.creation.cone(0.03, 0.1)):
        for kind in ("face", "interpolated"):
            surface = MeshSurface(mesh, normals=kind)
            positions, normals = surface.contacts(random.normal(0, 0.05, (50, 3)))
            surface.check_normals(positions, normals)
            for contact in range(5):
                with pytest.raises(gf.InvalidInputError, match="contact 0"):
                    surface.check_normals(positions[contact : contact + 1], -normals[contact : contact + 1])
    # On an edge, the normal of either face will do, and on a corner of any of three.
    box = MeshSurface(trimesh.creation.box((0.06, 0.04, 0.02)))
    box.check_normals([[0.03, 0.02, 0.0]] * 2, [(-1, 0, 0), (0, -1, 0)])
    box.check_normals([[0.03, 0.02, 0.01]] * 3, -np.eye(3))


def test_normals_in_a_cavity_point_into_the_wall_and_are_not_warned_of():
    hole = trimesh.creation.box((0.06, 0.06, 0.06))
    hole.invert()
    surface = MeshSurface(
        trimesh.util.concatenate([trimesh.creation.box((0.1, 0.1, 0.1)), hole]), normals="face"
    )
    grasp = surface.grasp([(0.03, 0, 0), (-0.03, 0, 0)], [(1, 0, 0), (-1, 0, 0)], friction=0.5)
    assert grasp.friction.tolist() == [0.5, 0.5]
    with pytest.raises(gf.InvalidInputError, match="contact 0"):
        surface.grasp([(0.03, 0, 0), (-0.03, 0, 0)], [(-1, 0, 0), (1, 0, 0)])


PINCH = """
mesh: {file: egg.stl}
contacts:
  - {position: [0.03, 0, 0], normal: [-1, 0, 0]}
  - {position: [-0.03, 0, 0], normal: [-1, 0, 0]}
"""


def test_a_grasp_file_with_a_mesh_refuses_outward_normals_unless_it_says_otherwise(tmp_path):
    egg_mesh().export(tmp_path / "egg.stl")
    path = tmp_path / "pinch.yaml"
    path.write_text(PINCH)
    message = r":5: contacts\[1\].normal: \[-1.0, 0.0, 0.0\] points out .*check_normals: false"
    with pytest.raises(gf.InvalidFileError, match=message):
        load_grasp(path)
    path.write_text(PINCH.replace("egg.stl}", "egg.stl, check_normals: false}"))
    assert load_grasp(path).grasp.normals[1].tolist() == [-1, 0, 0]
    path.write_text(PINCH.replace("[-0.03, 0, 0], normal: [-1", "[-0.03, 0, 0], normal: [1"))
    assert load_grasp(path).surface is None
