"""How far planned grasps are from the best there is: ``python benches/global_search.py [--meshes]``.

Branch and bound over the parameters of the paper's two examples: the racket to 0.1%, the tile to 1%. With
``--meshes`` two soft contacts of a parallel gripper anywhere on meshes of 5,000 faces, to 1%, beside the
pattern search and plans from many starts; and three hard contacts on 500 faces, for a minute. These meshes
need ``pip install --group objects``.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import graspforce as gf
from graspforce.paper import RACKET, TILE
from graspforce.paper.tile import INFERRED_FRICTION
from graspforce.surfaces import contacts_on

MESHES = {"bunny": "bunny.obj", "mug": "objects/mug.obj", "teddy": "teddy2_VHACD_CHs.obj"}
SIZE = 0.1  # m
GRIPPER = {"friction": 0.5, "torsion": 0.005, "length_scale": 0.03}
OPENING = 0.08  # m


def compare(name, problem, criterion, **options):
    found = gf.plan(
        problem.surface,
        problem.initial,
        problem.step,
        problem.tolerance,
        problem.bounds,
        criterion,
        **options,
    )
    stop = {"gap": 1e-2} if "tile" in name else {"gap": 1e-3}
    best = gf.plan_global(problem.surface, problem.bounds, criterion, initial=found.params, **stop, **options)
    print_row(f"{name}, {criterion}", [found.quality.epsilon], best)


def print_row(name, others, best):
    below = 100 * (1 - others[-1] / best.epsilon_upper)
    numbers = " | ".join(f"{epsilon:.4f}" for epsilon in (*others, best.quality.epsilon, best.epsilon_upper))
    kind = "proven" if best.proven else "estimate"
    print(
        f"| {name} | {numbers} | {below:.1f}% | {best.stopped}, {kind} | {best.seconds:.1f} s |", flush=True
    )


def examples():
    print("| problem | pattern search | best found | upper bound | below it by at most | end | time |")
    print("|---|---|---|---|---|---|---|")
    for problem in RACKET.values():
        limits = {"friction": problem.friction, "max_normal_force": problem.max_normal_force}
        for criterion in ("max", "sum"):
            compare(f"racket, {problem.name}", problem, criterion, **limits)
    tile = {"friction": INFERRED_FRICTION, "max_normal_force": TILE.max_normal_force, "edges": TILE.edges}
    # The default frames switch axes on the tile; first tangents along x make its wrenches smooth.
    tangents = np.tile([1.0, 0.0, 0.0], (4, 1))
    for criterion in ("max", "sum"):
        compare("tile", TILE, criterion, tangents=tangents, **tile)


def planned(surface, bounds, options, opening):
    """Epsilon of the pattern search from the middle of the bounds, and the best one from 100 starts."""

    def near(positions, _):
        return np.linalg.norm(positions[:, 0] - positions[:, 1], axis=-1) <= opening

    feasible = {"feasible": near} if opening < np.inf else {}
    starts = gf.plan_multistart(
        surface, bounds, step=0.02, tolerance=0.001, starts=100, best=1, seed=0, **feasible, **options
    )
    try:
        one = gf.plan(surface, bounds.mean(axis=1), 0.02, 0.001, bounds, **feasible, **options)
        first = one.quality.epsilon
    except gf.GraspForceError:
        first = np.nan
    return [first, starts.best.quality.epsilon]


def meshes():
    from pybullet_meshes import decimated  # noqa: PLC0415 - needs pybullet

    print(
        "| problem | pattern search | many starts | best found | upper bound | below it by at most | end "
        "| time |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, file in MESHES.items():
        mesh = decimated(file, SIZE, 5000, normals="face")
        surface, bounds = contacts_on(mesh, mesh), np.tile(mesh.bounds, (2, 1))
        for kind, edges in (("8 edges", 8), ("true cones", None)):
            options = GRIPPER | {"edges": edges}
            began = time.perf_counter()
            others = planned(surface, bounds, options, OPENING)
            print(f"<!-- {time.perf_counter() - began:.1f} s for the plans beside -->")
            best = gf.plan_global(surface, max_opening=OPENING, gap=0.01, time_limit=120, **options)
            print_row(f"{name}, {len(mesh.faces)} faces, two soft contacts, {kind}", others, best)
    for name, file in MESHES.items():
        mesh = decimated(file, SIZE, 500, normals="face")
        surface, bounds = contacts_on(*[mesh] * 3), np.tile(mesh.bounds, (3, 1))
        options = {"friction": 0.5, "length_scale": 0.03}
        others = planned(surface, bounds, options, np.inf)
        best = gf.plan_global(surface, gap=0.01, time_limit=60, **options)
        print_row(f"{name}, {len(mesh.faces)} faces, three hard contacts", others, best)


if __name__ == "__main__":
    meshes() if "--meshes" in sys.argv[1:] else examples()
