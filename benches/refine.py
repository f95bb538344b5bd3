"""Refine plans of 100 objects, and five random grasps on a sphere of 82,000 faces, by gradients.

Run by ``python benches/refine.py``. ``--against FILE`` refines the same grasps by the `refine` of another
Python file beside, such as an older version of the planner, and compares quality and time object by object.
"""

import argparse
import importlib.util
import sys
import time
import warnings

import numpy as np
import trimesh

import graspforce as gf
from graspforce.surfaces import MeshSurface, contacts_on, ellipsoid

CONTACTS = 3


def bumpy(rng):
    mesh = trimesh.creation.icosphere(subdivisions=3)
    waves = rng.normal(size=(4, 3)) * 2
    bumps = 1 + 0.1 * np.sin(mesh.vertices @ waves.T + rng.uniform(0, 6, 4)).sum(axis=1)
    return trimesh.Trimesh(mesh.vertices * bumps[:, None] * rng.uniform(0.02, 0.05, 3), mesh.faces)


def hull(rng):
    return trimesh.convex.convex_hull(rng.normal(size=(25, 3)) * rng.uniform(0.01, 0.03, 3))


def box(rng):
    mesh = trimesh.creation.box(rng.uniform(0.02, 0.1, 3))
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    return mesh


def problem(number):
    """Return the surface of an object, the bounds of its parameters, steps of the search and options."""
    rng = np.random.default_rng(number)
    options = {"friction": 0.5, "criterion": ("max", "sum")[number % 2]}
    kind = ("ellipsoid", "bumpy", "hull", "box")[number // 2 % 4]
    if kind == "ellipsoid":
        axes = rng.uniform(0.02, 0.06, 3)
        place, one, steps = ellipsoid(*axes), [(0, 2 * np.pi), (-1.4, 1.4)], (0.5, 0.05)
        size = 2 * axes.max()
    else:
        make = {"bumpy": bumpy, "hull": hull, "box": box}[kind]
        place = MeshSurface(make(rng), normals="interpolated" if kind == "bumpy" else "face")
        one, size = place.bounds, float(np.ptp(place.bounds, axis=1).max())
        steps = (size / 5, size / 50)
    options |= {"length_scale": size / 2, "min_distance": size / 20}
    return kind, contacts_on(*[place] * CONTACTS), np.tile(one, (CONTACTS, 1)), steps, options


def timed(refine, *arguments, **options):
    began = time.perf_counter()
    return refine(*arguments, **options), time.perf_counter() - began


def compared(label, others, surface, start, bounds, options, totals):
    """Print one line of all versions, and return whether the first is as good as every other one."""
    found = [timed(refine, surface, start, bounds, **options) for refine in others]
    totals += [seconds for _, seconds in found]
    ends = [better.quality.epsilon for better, _ in found]
    parts = [f"{end:.6f} ({seconds:.2f} s)" for end, (_, seconds) in zip(ends, found, strict=True)]
    before = found[0][0].quality.epsilon - found[0][0].gain
    worse = ends[0] < max(ends) * (1 - 1e-6)
    print(f"{label}: epsilon {before:.6f} to {', '.join(parts)}{'  worse' if worse else ''}", flush=True)
    return not worse


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=int, default=100)
    parser.add_argument("--against", metavar="FILE", help="a Python file with another `refine`")
    given = parser.parse_args()
    versions = [gf.refine]
    if given.against:
        spec = importlib.util.spec_from_file_location("other_refine", given.against)
        module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        versions.append(module.refine)
    warnings.simplefilter("ignore", gf.GraspWarning)
    totals = np.zeros(len(versions))
    kept = 0
    for number in range(given.objects):
        kind, surface, bounds, steps, options = problem(number)
        found = gf.plan_multistart(surface, bounds, *steps, starts=5, best=1, seed=number, **options)
        label = f"{number:03d} {kind} {options['criterion']}"
        kept += compared(label, versions, surface, found.best.params, bounds, options, totals)
    print(f"{kept} of {given.objects} at least as good; seconds in all: {totals.round(1).tolist()}")
    sphere = MeshSurface(trimesh.creation.icosphere(subdivisions=6, radius=0.05))
    surface, bounds = contacts_on(*[sphere] * 4), np.tile(sphere.bounds, (4, 1))
    rng, totals = np.random.default_rng(0), np.zeros(len(versions))
    options = {"friction": 0.5, "length_scale": 0.05}
    for start in rng.uniform(*bounds.T, (5, 12)):
        compared("sphere", versions, surface, start, bounds, options, totals)
    print(f"sphere of {len(sphere.faces)} faces, 5 starts: seconds in all: {totals.round(1).tolist()}")


if __name__ == "__main__":
    main()
