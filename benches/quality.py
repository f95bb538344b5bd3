"""Certified quality beside Qhull, from Python: ``python benches/quality.py``.

Prints medians and ratios of one run: the core alone (``cargo bench --bench quality``), the same grasps asked
through Python, the union's hull by SciPy's Qhull, and the Minkowski sum's hull by enumeration and Qhull.
"""

from __future__ import annotations

import statistics
import subprocess
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull, QhullError

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT = Path(__file__).parents[1]
MASK = (1 << 64) - 1


def random_numbers(seed: int) -> Iterator[float]:
    """Repeat the generator of ``benches/common``: the same seed makes the same grasps in both languages."""
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
    lines = [line for line in text.splitlines() if " edges, " in line]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    return {(int(row[0]), int(row[1].split()[0]), row[2].lower()): float(row[3]) for row in rows}


def inner_radius(points: np.ndarray) -> float:
    return -ConvexHull(points).equations[:, -1].max()


def through_python(core: dict[tuple[int, int, str], float]) -> None:
    print("The same grasps through Python, medians:\n")
    print("| contacts | edges | criterion | core us | Python us | difference us |")
    print("|---|---|---|---|---|---|")
    for (contacts, edges, criterion), alone in core.items():
        grasps = closed_grasps(7, 200, contacts, edges)
        times = [seconds(partial(grasp.quality, criterion)) for _ in range(5) for grasp in grasps]
        here = 1e6 * statistics.median(times)
        print(f"| {contacts} | {edges} | {criterion} | {alone:.1f} | {here:.1f} | {here - alone:.1f} |")


def union_beside_qhull() -> None:
    print("\nrho_sum beside Qhull on the same primitive wrenches (4 contacts, 8 edges, 100 grasps):\n")
    ours, theirs = [], []
    for grasp in closed_grasps(7, 100, 4, 8):
        ours.append(seconds(partial(grasp.quality, "sum")))
        wrenches = grasp.primitive_wrenches
        theirs.append(seconds(partial(inner_radius, wrenches)))
        assert abs(grasp.quality("sum").epsilon - inner_radius(wrenches)) < 1e-8
    ratio = statistics.median(t / o for t, o in zip(theirs, ours, strict=True))
    medians = [1e6 * statistics.median(times) for times in (ours, theirs)]
    print(f"ours {medians[0]:.0f} us, Qhull {medians[1]:.0f} us: {ratio:.0f} times faster (median of pairs)")


def sum_beside_qhull(name: str, grasp: gf.Grasp) -> None:
    ours = statistics.median(seconds(partial(grasp.quality, "max")) for _ in range(50))
    start = time.perf_counter()
    try:
        radius = inner_radius(grasp.minkowski_sum().wrenches)
    except QhullError as error:
        print(f"{name}: ours {1e3 * ours:.2f} ms; Qhull fails with {str(error)[:6]}")
        return
    theirs = time.perf_counter() - start
    assert abs(grasp.quality("max").epsilon - radius) < 1e-8
    times = f"ours {1e3 * ours:.2f} ms, enumeration and Qhull {theirs:.2f} s"
    print(f"{name}: {times}: {theirs / ours:.0f} times faster")


def main() -> None:
    through_python(core_medians())
    union_beside_qhull()
    print("\nrho_max beside enumeration and Qhull (4 contacts, 8 edges, 6,560 points):\n")
    sum_beside_qhull("tetrahedron", tetrahedron(8))
    for number, grasp in enumerate(closed_grasps(7, 3, 4, 8)):
        sum_beside_qhull(f"random grasp {number}", grasp)


if __name__ == "__main__":
    main()
