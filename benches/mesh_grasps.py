"""Plan four contacts on meshes somebody downloaded: 200 starts, true friction cones, the best ten grasps.

Run by ``python benches/mesh_grasps.py --out pictures``. The best grasp of each object is compared with the
best of 1,000 random force-closure grasps, and drawn.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pybullet_meshes import named

import graspforce as gf
from graspforce.plotting import draw_spatial_grasp
from graspforce.surfaces import contacts_on

# name: file, largest extent in m, subdivisions, options of the surface
OBJECTS = {
    "bunny": ("bunny.obj", 0.10, 3, {}),
    "teddy": ("teddy2_VHACD_CHs.obj", 0.12, 0, {"normals": "face"}),
    "duck": ("duck.obj", 0.10, 0, {}),
    "mug": ("objects/mug.obj", 0.12, 0, {"normals": "face", "check_watertight": False}),
    "torus": ("torus/torus_textured.obj", 0.12, 0, {"check_watertight": False}),
}
FRICTION = 0.5


def random_best(surface, bounds, options, wanted=1000, seed=1):
    """Best epsilon of the first `wanted` force-closure grasps of a sequence, and how many were drawn."""
    random = np.random.default_rng(seed)
    best, closed, drawn = 0.0, 0, 0
    while closed < wanted and drawn < 200 * wanted:
        batch = gf.quality_many(
            *surface(random.uniform(*bounds.T, (1000, len(bounds)))), rtol=1e-3, **options
        )
        drawn += 1000
        epsilon = batch.epsilon[batch.closure == 1][: wanted - closed]
        closed += len(epsilon)
        best = max(best, epsilon.max(initial=0.0))
    return best, closed, drawn


def plan(name, contacts, starts):
    file, size, subdivisions, choices = OBJECTS[name]
    mesh = named(file, size, subdivisions, **choices)
    surface = contacts_on(*[mesh] * contacts)
    bounds = np.tile(mesh.bounds, (contacts, 1))
    options = {"friction": FRICTION, "edges": None, "length_scale": size / 2}
    began = time.perf_counter()
    # A bracket of a ten-thousandth is narrow enough to tell grasps apart.
    limits = {"starts": starts, "best": 10, "min_distance": size / 20, "rtol": 1e-4}
    found = gf.plan_multistart(surface, bounds, size / 5, size / 50, **limits, **options)
    seconds = time.perf_counter() - began
    chance, closed, drawn = random_best(surface, bounds, options)
    plan_best = found.best.quality.epsilon
    print(
        f"{name}: {len(mesh.faces)} faces, {contacts} contacts, {starts} starts in {seconds:.1f} s; "
        f"best ten epsilon {[round(p.quality.epsilon, 4) for p in found.plans]}; "
        f"best of {closed} random force-closure grasps ({drawn} drawn) {chance:.4f}: "
        f"{'beaten' if plan_best > chance else 'NOT beaten'}"
    )
    if found.failures:
        print(f"  failures: {found.failures}")
    return mesh, found


def picture(name, mesh, found, path):
    figure = Figure(figsize=(9, 3.4), dpi=130, layout="constrained")
    for place, grasp in enumerate(found.plans[:3], start=1):
        axes = figure.add_subplot(1, 3, place, projection="3d")
        draw_spatial_grasp(axes, grasp.grasp, mesh=(mesh.vertices, mesh.faces), labels=True)
        axes.set_title(rf"$\epsilon = {grasp.quality.epsilon:.3f}$", fontsize=9)
    figure.suptitle(
        f"{name}: the three best of {len(found.starts)} starts, {found.best.grasp.num_contacts} contacts",
        fontsize=10,
    )
    figure.savefig(path)
    print(f"  wrote {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="*", default=list(OBJECTS), help=f"any of {', '.join(OBJECTS)}")
    parser.add_argument("--contacts", type=int, default=4)
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("pictures"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.objects:
        try:
            mesh, found = plan(name, given.contacts, given.starts)
        except gf.GraspForceError as error:
            print(f"{name}: no plan: {error}")
            continue
        picture(name, mesh, found, given.out / f"mesh-{name}.png")


if __name__ == "__main__":
    main()
