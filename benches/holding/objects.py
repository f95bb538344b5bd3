"""Random objects to hold: meshes of the installed ``pybullet``; nothing of it is part of this project."""

import importlib.util
import random
from pathlib import Path

import trimesh


def data_folder():
    """Return where pybullet keeps its meshes, without importing it."""
    found = importlib.util.find_spec("pybullet_data")
    if found is None or not found.submodule_search_locations:
        raise SystemExit("these objects are meshes of pybullet: pip install --group objects")
    return Path(found.submodule_search_locations[0])


def numbers(count, seed):
    """Draw some of the thousand objects."""
    return random.Random(seed).sample(range(1000), count)


def random_mesh(number, size):
    """Return an object of several closed parts, scaled to a largest extent of `size` m."""
    mesh = trimesh.load_mesh(data_folder() / "random_urdfs" / f"{number:03d}" / f"{number:03d}.obj")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.apply_scale(size / mesh.extents.max())
    return mesh
