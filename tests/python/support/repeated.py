"""Calls repeated in a child process that watches its memory; prints by how many MB the later half grew it."""

from __future__ import annotations

import os
import resource
import sys
from pathlib import Path

import numpy as np

import graspforce as gf

PAIR = [(-1, 0), (1, 0)], [(1, 0), (-1, 0)]
CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
FLAT = gf.Grasp(*PAIR, friction=0.5)
GRASP = gf.Grasp(CORNERS + np.array([0.1, 0.2, 0.0]), -CORNERS, friction=0.7)
OPEN = gf.ForceDistributor(gf.Grasp([(-1, 0)], [(1, 0)]))
DISTRIBUTOR = gf.ForceDistributor(GRASP)
SMALL = gf.ForceDistributor(FLAT)
WRENCH, DOWN = np.array([0.1, 0.2, -1, 0, 0.1, 0]), np.array([0.0, -1.0, 0.0])
FORCES = np.empty((4, 3))
TILTING = [np.array([0.1 * np.sin(k), 0.2, -1, 0, 0.1 * np.cos(k), 0]) for k in range(64)]


def refused(call, *arguments):
    try:
        call(*arguments)
    except gf.GraspForceError:
        return
    raise AssertionError("was not refused")


def interrupt_free_batch(_):
    gf.quality_many([PAIR[0]], [PAIR[1]])


CALLS = {
    "solve_into": (1_000_000, lambda k: DISTRIBUTOR.solve_into(TILTING[k % 64], FORCES)),
    "solve": (1_000_000, lambda _: SMALL.solve(DOWN)),
    "quality": (1_000_000, lambda _: FLAT.quality()),
    "construction": (100_000, lambda _: gf.Grasp(*PAIR)),
    "distributor": (20_000, lambda _: gf.ForceDistributor(FLAT)),
    "infeasible": (200_000, lambda _: refused(OPEN.solve, DOWN)),
    "refused wrench": (200_000, lambda _: refused(SMALL.solve, [np.nan, 0, 0])),
    "refused grasp": (100_000, lambda _: refused(gf.Grasp, PAIR[0], [(0, 0), (1, 0)])),
    "forces": (200_000, lambda _: DISTRIBUTOR.solve(WRENCH).contact_wrenches),
    "gradient": (50_000, lambda _: FLAT.quality().gradient.positions),
    "minkowski": (50_000, lambda _: FLAT.minkowski_sum().wrenches),
    "batch": (20_000, interrupt_free_batch),
}


def resident():
    """Memory in use now, in MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def growth(name, share):
    times, call = CALLS[name]
    times = int(times * share)
    for k in range(times // 2):
        call(k)
    before = resident()
    for k in range(times // 2):
        call(k)
    return f"{times} {resident() - before}\n"


def main():
    for line in sys.stdin:
        name, _, share = line.rpartition(" ")
        # Each in a process of its own, in which everything is imported already.
        if os.fork() == 0:
            try:
                os.write(1, growth(name, float(share)).encode())
            finally:
                os._exit(1)
        os.wait()


if __name__ == "__main__":
    main()
