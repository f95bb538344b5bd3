"""How long does a support region take, beside linear programs? ``python benches/support_regions.py``.

Four feet on uneven ground, linearised cones of 8 edges and true cones, with the default gap of 1e-6. The
linear programs (HiGHS, through SciPy) ask along as many directions.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benches.trust.support_regions import furthest

import graspforce as gf

REPEATS = 200


def main() -> None:
    """Print the medians of one interleaved run."""
    rng = np.random.default_rng(0)
    places = np.array([(0.2, 0.1, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0), (0.2, -0.1, 0)])
    places += 0.05 * rng.standard_normal((4, 3))
    normals = 0.3 * rng.standard_normal((4, 3)) + [0, 0, 1]
    for name, edges in (("8 edges", 8), ("true cones", None)):
        feet = gf.Grasp(places, normals, friction=0.6, max_normal_force=80.0, edges=edges)
        region = gf.support_region(feet, 100.0)
        ours, theirs = [], []
        for _ in range(REPEATS):
            began = time.perf_counter()
            gf.support_region(feet, 100.0)
            ours.append(time.perf_counter() - began)
            if edges is not None and len(theirs) < 5:
                began = time.perf_counter()
                for angle in np.linspace(0, 2 * np.pi, region.directions):
                    direction = np.array([np.cos(angle), np.sin(angle)])
                    furthest(feet, 100.0, "max", {}, direction, cones=False)
                theirs.append(time.perf_counter() - began)
        beside = f"; HiGHS {1e3 * np.median(theirs):.0f} ms" if theirs else ""
        print(
            f"{name}: {1e3 * np.median(ours):.3f} ms, {region.directions} directions, area gap "
            f"{region.area_gap:.1e}{beside}"
        )


if __name__ == "__main__":
    main()
