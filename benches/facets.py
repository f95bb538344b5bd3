"""Print what the argument `max_facets` costs, and how narrow the bracket gets: `python benches/facets.py`.

The grasp has four soft contacts with true cones on a tetrahedron. Their friction differs: no symmetry helps.
`python benches/facets.py solids` prints the brackets of soft contacts on solids and rings: with true cones
and a torque origin off the centre, and with linearised cones that point anywhere.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Sequence


def row(max_facets: int) -> str:
    """Measure one call in this process."""
    outward = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    grasp = gf.Grasp(
        0.05 * outward,
        -outward,
        friction=[0.5, 0.501, 0.502, 0.503],
        torsion=0.02,
        edges=None,
        length_scale=0.1,
    )
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    q = grasp.quality("max", max_facets=max_facets)
    seconds = time.perf_counter() - start
    megabytes = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    return f"| {max_facets:,} | {seconds:.2f} | {megabytes:.0f} | {(q.upper - q.lower) / -q.lower:.1e} |"


TETRAHEDRON = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
CUBE = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
RING = [(np.cos(k), np.sin(k), 0) for k in 2 * np.pi * np.arange(5) / 5]
SHIFT = np.array([0.02, -0.01, 0.03])
"""From the torque origin to the centre, in m."""

SOLIDS: list[tuple[str, Sequence[tuple[float, float, float]], bool]] = [
    ("tetrahedron, true cones, shifted", TETRAHEDRON, False),
    ("cube, true cones, shifted", CUBE, False),
    ("ring of 5, true cones, shifted", RING, False),
    ("tetrahedron, 32 edges, turned", TETRAHEDRON, True),
    ("cube, 32 edges, turned", CUBE, True),
]
"""Name, directions of the contacts, whether they have linearised cones."""


def solids(limits: tuple[int, ...]) -> None:
    """Print the table of solids: contacts on the corners of the tetrahedron and the sides of the cube."""
    random = np.random.default_rng(5)
    print("| grasp | max_facets | time (s) | relative width, max | sum |")
    print("|---|---|---|---|---|")
    for name, directions, linearised in SOLIDS:
        outward = np.array(directions) / np.linalg.norm(directions, axis=1)[:, None]
        tangents = random.normal(size=outward.shape)
        options: dict[str, Any] = {"friction": 0.5, "torsion": 0.02, "edges": None, "length_scale": 1.0}
        if linearised:
            options |= {"edges": 32, "tangents": tangents, "length_scale": 0.1}
        else:
            options["origin"] = -SHIFT
        grasp = gf.Grasp(0.04 * outward, -outward, **options)
        for max_facets in limits:
            start = time.perf_counter()
            both = [grasp.quality(criterion, max_facets=max_facets) for criterion in ("max", "sum")]
            seconds = time.perf_counter() - start
            widths = " | ".join(f"{(q.upper - q.lower) / -q.lower:.1e}" for q in both)
            print(f"| {name} | {max_facets:,} | {seconds:.1f} | {widths} |", flush=True)


def main() -> None:
    """Print the table, each row from a process of its own."""
    if sys.argv[1:] == ["solids"]:
        solids((200_000, 1_000_000, 2_000_000))
        return
    if len(sys.argv) > 1:
        print(row(int(sys.argv[1])))
        return
    print("| max_facets | time (s) | memory (MB) | relative width of the bracket |")
    print("|---|---|---|---|")
    for max_facets in (200_000, 1_000_000, 2_000_000):
        command = [sys.executable, __file__, str(max_facets)]
        print(subprocess.run(command, check=True, capture_output=True, text=True).stdout, end="", flush=True)


if __name__ == "__main__":
    main()
