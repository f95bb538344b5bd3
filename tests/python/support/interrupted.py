"""Runs long calls, each in a forked process that is sent Ctrl-C; prints how long a call went on after it."""

from __future__ import annotations

import itertools
import os
import signal
import sys
import threading
import time

import numpy as np
import scipy.optimize  # imported before: Ctrl-C during an import is not what is measured
import scipy.spatial
import scipy.stats  # noqa: F401

import graspforce as gf
from graspforce._core import TriangleTree
from graspforce.paper.racket import run_racket
from graspforce.surfaces import contacts_on, ellipse

# Long enough for the call to be under way, short enough for the tests.
DELAY = 0.3

# Set while nothing but time is to be waited for.
UNDER_WAY = threading.Event()
UNDER_WAY.set()


def ball(count, seed=0):
    """Contacts all over a ball, pressing inwards."""
    rng = np.random.default_rng(seed)
    outward = rng.normal(size=(count, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    return outward, -outward


def symmetric(edges):
    """Fingers on the faces of a cube: a continuum of worst directions."""
    outward = np.vstack([np.eye(3), -np.eye(3)])
    return gf.Grasp(outward, -outward, friction=0.8, edges=edges, torsion=0.05)


def disc(angles):
    """One finger at each angle."""
    outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return 0.1 * outward, -outward


def egg(count):
    """Fingers on an ellipsoid by two angles each."""

    def surface(params):
        u, v = params[:, ::2], params[:, 1::2]
        outward = np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], axis=-1)
        return outward * [0.03, 0.04, 0.05], -outward / [0.03, 0.04, 0.05]

    return surface, [(-3.0, 3.0), (-1.4, 1.4)] * count


def watched(surface):
    """Return the surface; hold Ctrl-C back until its sixth question, when a search has found something."""
    UNDER_WAY.clear()
    questions = itertools.count(1)

    def answer(params):
        if next(questions) == 6:
            UNDER_WAY.set()
        return surface(params)

    return answer


def many(count, repeat):
    positions, normals = ball(count)
    return np.repeat(positions[None], repeat, 0), np.repeat(normals[None], repeat, 0)


def forces_many():
    positions, normals = many(5, 100_000)
    gf.forces_many(positions, normals, np.random.default_rng(0).normal(size=(20, 6)), edges=None)


def surrogates():
    gf.surrogates.span_residual(*many(40, 100_000))


def quality():
    positions, normals = ball(8)
    while True:
        gf.Grasp(positions, normals, edges=64).quality()


def true_cone_quality():
    while True:
        symmetric(None).quality("max", rtol=1e-12)


def many_forces_of_one_contact():
    positions, normals = ball(8)
    grasp = gf.Grasp(positions, normals, edges=65_536)
    while True:
        grasp.quality(rtol=1e-12)


def gradient():
    while True:
        _ = symmetric(None).quality("max", rtol=0.5).gradient


def quality_many():
    gf.quality_many(*many(6, 200_000), edges=None, torsion=0.05)


def quality_many_hard():
    outward = np.vstack([np.eye(3), -np.eye(3)])
    positions = np.repeat(outward[None], 256, 0)
    gf.quality_many(positions, -positions, edges=None, torsion=0.05, rtol=1e-12)


def closure():
    grasp = symmetric(None)
    while True:
        _ = grasp.is_force_closure


def resistance():
    rng = np.random.default_rng(0)
    gf.Grasp(*ball(8), edges=64).resistance(rng.normal(size=(1_000_000, 6)))


def solve_many():
    rng = np.random.default_rng(0)
    gf.ForceDistributor(gf.Grasp(*ball(8), edges=64)).solve_many(rng.normal(size=(1_000_000, 6)))


def solve_many_parallel():
    rng = np.random.default_rng(0)
    distributor = gf.ForceDistributor(gf.Grasp(*ball(8), edges=None))
    distributor.solve_many(rng.normal(size=(1_000_000, 6)), parallel=True)


def solve_enumerated():
    distributor = gf.ForceDistributor(gf.Grasp(*ball(6), edges=10), method="enumerated")
    while True:
        distributor.solve([1, 2, 3, 4, 5, 6])


def reduce_points():
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(1000, 6))
    gf.ForceDistributor(gf.Grasp(*ball(6), edges=10), method="reduced", samples=samples)


def minkowski_sum():
    gf.Grasp(*ball(7), edges=10).minkowski_sum(max_points=2**26)


def plan():
    surface, bounds = egg(5)
    start = np.arange(10) * 0.1
    return gf.plan(watched(surface), start, 0.1, 1e-9, bounds, edges=None, torsion=0.01)


def plan_multistart():
    surface, bounds = egg(4)
    return gf.plan_multistart(watched(surface), bounds, 0.5, 1e-4, starts=500, edges=8)


def plan_global():
    surface, bounds = egg(2)
    options = {"friction": 1.0, "torsion": 0.01, "edges": 16, "max_boxes": 10**9}
    return gf.plan_global(watched(surface), bounds, gap=1e-6, **options)


def refine():
    surface, bounds = egg(5)
    return gf.refine(surface, np.arange(10) * 0.1, bounds, edges=64, max_iterations=10**6, tolerance=1e-12)


def placement():
    surface = contacts_on(*[ellipse(0.05, 0.03)] * 4)
    noise = gf.PlacementNoise(position_std=0.001, samples=500)
    return gf.plan(watched(surface), [0, 1.5, 3, 4.5], 0.5, 1e-9, [(0, 6.3)] * 4, placement=noise)


def measures():
    while True:
        gf.Grasp(*ball(16), edges=8).measures()


def reproduce():
    run_racket(repeats=10**6)


def closest_points():
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(30_000, 3))
    tree = TriangleTree(corners, np.arange(30_000).reshape(-1, 3))
    while True:
        tree.closest(rng.normal(size=(100_000, 3)))


def one(name):
    call = globals()[name]
    sent = []

    def press():
        time.sleep(DELAY)
        UNDER_WAY.wait()
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press, daemon=True).start()
    try:
        outcome = getattr(call(), "stopped", "returned")
    except KeyboardInterrupt:
        outcome = "raised"
    ended = time.monotonic()
    if not sent:
        return f"{name} was over before Ctrl-C\n"
    return f"{outcome} {ended - sent[0]}\n"


def main():
    for line in sys.stdin:
        # Everything is imported already, and no thread has been started.
        if os.fork() == 0:
            signal.alarm(60)
            try:
                os.write(1, one(line.strip()).encode())
            finally:
                os._exit(1)
        os.wait()


if __name__ == "__main__":
    main()
