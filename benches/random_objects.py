"""Plan grasps of random objects, unattended: 3 and 4 contacts, both criteria, a plan or a reason for each.

Run by ``python benches/random_objects.py``; ``--refine 50`` measures instead what gradients add to the
pattern search's result on fifty objects.
"""

import argparse
import time

import numpy as np
from pybullet_meshes import random_object

import graspforce as gf
from graspforce.surfaces import contacts_on

FRICTION = 0.5


def problem(number, contacts):
    mesh = random_object(number, normals="face")
    size = float(np.ptp(mesh.bounds, axis=1).max())
    bounds = np.tile(mesh.bounds, (contacts, 1))
    options = {"friction": FRICTION, "edges": 8, "length_scale": size / 2, "min_distance": size / 20}
    return contacts_on(*[mesh] * contacts), bounds, size, options


def plans(count, starts):
    began, reached = time.perf_counter(), 0
    for number in range(count):
        for contacts in (3, 4):
            for criterion in ("max", "sum"):
                start = time.perf_counter()
                try:
                    surface, bounds, size, options = problem(number, contacts)
                    found = gf.plan_multistart(
                        surface, bounds, size / 5, size / 100, criterion, starts=starts, best=3, **options
                    )
                    quality = found.best.quality
                    result = f"epsilon {quality.epsilon:.4f}, {quality.closure} closure"
                    reached += quality.closure == "force"
                except gf.GraspForceError as error:
                    result = f"no plan: {error}"
                seconds = time.perf_counter() - start
                print(
                    f"object {number:03d}, {contacts} contacts, rho_{criterion}: {result} ({seconds:.1f} s)"
                )
    total = time.perf_counter() - began
    print(f"{reached} of {4 * count} plans are force closure; {total:.1f} s in all")


def refinements(count):
    began = time.perf_counter()
    gains, proven, neither = [], 0, []
    for number in range(count):
        try:
            surface, bounds, size, options = problem(number, 3)
            found = gf.plan_multistart(surface, bounds, size / 5, size / 50, starts=5, best=1, **options)
            before = found.best.quality.epsilon
            after = gf.refine(surface, found.best.params, bounds, **options)
        except gf.GraspForceError as error:
            print(f"object {number:03d}: no plan: {error}")
            continue
        gains.append(after.gain / abs(before))
        proven += after.stationary
        if after.gain <= 0 and not after.stationary:
            neither.append(number)
        print(
            f"object {number:03d}: epsilon {before:.5f} to {after.quality.epsilon:.5f} "
            f"({100 * gains[-1]:+.2f}%), "
            f"{'stationary' if after.stationary else f'slope {after.slope:.2g}'}, {after.evaluations} "
            "qualities"
        )
    gains = np.array(gains)
    print(
        f"{len(gains)} objects: {(gains > 0).sum()} improved (median {100 * np.median(gains):.2f}%), "
        f"{(gains < 0).sum()} worsened, {proven} stationary, neither: {neither}; "
        f"{time.perf_counter() - began:.1f} s"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=int, default=20)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--refine", type=int, metavar="N", help="refine plans of N objects instead")
    given = parser.parse_args()
    if given.refine:
        refinements(given.refine)
    else:
        plans(given.objects, given.starts)


if __name__ == "__main__":
    main()
