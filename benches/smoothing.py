"""How often a smooth minimum of supports jumps along a path of grasps, by edges of the friction cones.

Run by ``python benches/smoothing.py``. Four contacts on a ball move along random arcs of 200 steps. A step
jumps where the slope of the value changes by more than a tenth of the scale of smoothing.
"""

import time

import numpy as np

import graspforce as gf
from graspforce._internal.differentiable import smooth_minimum

SCALE, STEPS, PATHS = 0.01, 200, 12


def path(seed):
    """Return contacts (STEPS, 4, 3) on the unit ball."""
    rng = np.random.default_rng(seed)
    start, along = rng.normal(size=(2, 4, 3))
    start /= np.linalg.norm(start, axis=-1, keepdims=True)
    points = start + 0.5 * np.linspace(0, 0.3, STEPS)[:, None, None] * along
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


def jumps(values):
    """Return the share of steps at which the slope changes by more than a tenth of the scale."""
    return float((np.abs(np.diff(values, n=2)) > 0.1 * SCALE).mean())


def main():
    for edges in (8, 16, 32):
        for criterion in ("max", "sum"):
            smooth, plain, busy = [], [], 0.0
            for seed in range(PATHS):
                points = path(seed)
                options = {"criterion": criterion, "edges": edges, "friction": 0.6, "bundle": 16}
                tangents = np.broadcast_to([0.3, 0.5, 0.7], points.shape)
                began = time.process_time()
                batch = gf.quality_many(points, -points, tangents=tangents, **options)
                busy += time.process_time() - began
                if batch.epsilon.min() >= 0.02:
                    smooth.append(jumps(smooth_minimum(batch, SCALE, None)[0]))
                    plain.append(jumps(batch.epsilon))
            print(
                f"{edges} edges, {criterion}: {100 * np.mean(smooth):.1f}% of the steps jump, "
                f"{100 * np.mean(plain):.1f}% of epsilon's; {1e6 * busy / PATHS / STEPS:.0f} us a grasp",
                flush=True,
            )


if __name__ == "__main__":
    main()
