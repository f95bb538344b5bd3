"""Certified quality beside Qhull, from Python: ``python benches/quality.py``.

Prints medians and ratios of one run: the core alone (``cargo bench --bench quality``), the same grasps asked
through Python, the union's hull by SciPy's Qhull, and the Minkowski sum's hull by enumeration and Qhull.
"""

from __future__ import annotations

import statistics
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

import graspforce as gf

ROOT = Path(__file__).parents[1]
MASK = (1 << 64) - 1


def random_numbers(seed: int) -> Iterator[float]:
    """The generator of ``benches/common``: the same seed makes the same grasps in both languages."""
    state = (seed * 0x9E37_79B9_7F4A_7C15) & MASK | 1
    while True:
        state ^= state >> 12
        state ^= (state << 25) & MASK
        state ^= state >> 27
        yield (((state * 0x2545_F491_4F6C_DD1D) & MASK) >> 11) / 2**53


def closed_grasps(seed: int, number: int, contacts: int, edges: int) -> list[gf.Grasp]:
    numbers = random_numbers(seed)
    axes = np.array([1.0, 0.8, 1.3])

    def direction() -> np.ndarray:
        while True:
            v = np.array([2 * next(numbers) - 1 for _ in range(3)])
            if 0.01 <= np.linalg.norm(v) < 1:
                return v / np.linalg.norm(v)

    grasps: list[gf.Grasp] = []
    while len(grasps) < number:
        u = np.array([direction() for _ in range(contacts)])
        grasp = gf.Grasp(u * axes, -u / axes, friction=0.5, edges=edges)
        if grasp.quality("sum").rho < 0:
            grasps.append(grasp)
    return grasps


def tetrahedron(edges: int) -> gf.Grasp:
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / np.sqrt(3)
    return gf.Grasp(corners, -corners, friction=0.5, edges=edges)


def seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def core_medians() -> dict[tuple[int, int, str], float]:
    """Medians in microseconds from the Rust benchmark, by contacts, edges and criterion."""
    command = ["cargo", "bench", "--quiet", "--bench", "quality"]
    text = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    print(text)
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if " edges, " in line]
    return {(int(row[0]), int(row[1].split()[0]), row[2].lower()): float(row[3]) for row in rows}


def inner_radius(points: np.ndarray) -> float:
    return -ConvexHull(points).equations[:, -1].max()


def main() -> None:
    core = core_medians()
    print("The same grasps through Python, medians:\n")
    print("| contacts | edges | criterion | core us | Python us | difference us |")
    print("|---|---|---|---|---|---|")
    for contacts, edges in [(4, 8), (4, 10), (8, 16)]:
        grasps = closed_grasps(7, 200, contacts, edges)
        for criterion in ("max", "sum"):
            times = [seconds(lambda g=g: g.quality(criterion)) for _ in range(5) for g in grasps]
            here, alone = 1e6 * statistics.median(times), core[contacts, edges, criterion]
            print(f"| {contacts} | {edges} | {criterion} | {alone:.1f} | {here:.1f} | {here - alone:.1f} |")

    print("\nrho_sum beside Qhull on the same primitive wrenches (4 contacts, 8 edges, 100 grasps):\n")
    ours, theirs = [], []
    for grasp in closed_grasps(7, 100, 4, 8):
        ours.append(seconds(lambda g=grasp: g.quality("sum")))
        wrenches = grasp.primitive_wrenches
        theirs.append(seconds(lambda w=wrenches: inner_radius(w)))
        assert abs(grasp.quality("sum").epsilon - inner_radius(wrenches)) < 1e-8
    ratio = statistics.median(t / o for t, o in zip(theirs, ours, strict=True))
    print(f"ours {1e6 * statistics.median(ours):.0f} us, Qhull {1e6 * statistics.median(theirs):.0f} us: ", end="")
    print(f"{ratio:.0f} times faster (median of pairs)")

    print("\nrho_max beside enumeration and Qhull (tetrahedron, 8 edges, 6,560 points):\n")
    grasp = tetrahedron(8)
    ours = [seconds(lambda: grasp.quality("max")) for _ in range(50)]
    radius = 0.0

    def enumerate_and_hull() -> None:
        nonlocal radius
        radius = inner_radius(grasp.minkowski_sum().wrenches)

    theirs = [seconds(enumerate_and_hull)]
    assert abs(grasp.quality("max").epsilon - radius) < 1e-8
    best = statistics.median(ours)
    print(f"ours {1e3 * best:.2f} ms, enumeration and Qhull {theirs[0]:.2f} s: {theirs[0] / best:.0f} times faster")


if __name__ == "__main__":
    main()
