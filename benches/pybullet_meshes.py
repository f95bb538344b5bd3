"""Meshes to grasp, read from the installed ``pybullet`` package; nothing of it is part of this project."""

from xml.etree import ElementTree as ET

import trimesh
from holding.objects import data_folder

from graspforce.surfaces import MeshSurface


def named(name, size, subdivisions=0, **options):
    """Surface of a file of the package, scaled to a largest extent of `size` m, about its centre."""
    mesh = trimesh.load_mesh(data_folder() / name)
    if isinstance(mesh, trimesh.Scene):
        mesh = mesh.to_mesh()
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return prepared(mesh, size / mesh.extents.max(), subdivisions, **options)


def decimated(name, size, count, **options):
    """Surface of a file of the package with so many faces, scaled to a largest extent of `size` m."""
    mesh = trimesh.load_mesh(data_folder() / name)
    if isinstance(mesh, trimesh.Scene):
        mesh = mesh.to_mesh()
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    while len(mesh.faces) < count:
        mesh = mesh.subdivide()
    # Needs fast-simplification, which decimates a few faces more or less than it is asked for.
    mesh = mesh.simplify_quadric_decimation(face_count=count)
    return prepared(mesh, size / mesh.extents.max(), check_watertight=False, **options)


def random_object(number, **options):
    """One of the thousand random objects, at the scale its own description says."""
    folder = data_folder() / "random_urdfs" / f"{number:03d}"
    description = ET.parse(folder / f"{number:03d}.urdf")
    part = description.find(".//collision/geometry/mesh")
    mesh = trimesh.load_mesh(folder / part.get("filename"))
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return prepared(mesh, float(part.get("scale").split()[0]), **options)


def prepared(mesh, scale, subdivisions=0, **options):
    """Centre, refine and check a mesh."""
    for _ in range(subdivisions):
        mesh = mesh.subdivide()
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return MeshSurface(mesh, unit=scale, **options)
