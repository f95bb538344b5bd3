"""Print what the argument `max_facets` costs, and how narrow the bracket gets: `python benches/facets.py`.

The grasp has four soft contacts with true cones on a tetrahedron. Their friction differs, so no symmetry helps.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time

import numpy as np

import graspforce as gf


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


def main() -> None:
    """Print the table, each row from a process of its own."""
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
