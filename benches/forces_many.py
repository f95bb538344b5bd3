"""What least forces of many grasps, their gradients, and surrogates of quality cost.

1,000 force-closure grasps of 4 contacts on ellipsoids, 6 random wrenches each; and 32 grasps of 12 contacts
with 4 edges, as GraspQP has them. Prints the least time of several calls, on all cores.
"""

import time
from collections.abc import Callable

import numpy as np

import graspforce as gf


def grasps(rng: np.random.Generator, count: int, contacts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return contacts spread over ellipsoids, with friction 0.7 force closure."""
    positions, normals = [], []
    while sum(map(len, positions)) < count:
        outward = rng.normal(size=(2 * count, contacts, 3))
        outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
        axes = rng.uniform(0.5, 1.0, size=(2 * count, 1, 3))
        closed = gf.quality_many(outward * axes, -outward / axes, friction=0.7).closure == 1
        positions.append((outward * axes)[closed])
        normals.append((-outward / axes)[closed])
    return np.concatenate(positions)[:count], np.concatenate(normals)[:count]


def least_time(call: Callable[[], object], calls: int) -> float:
    """Return the least time of a call in ms."""
    times = []
    for _ in range(calls):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def main() -> None:
    """Print one line for each computation."""
    rng = np.random.default_rng(1)
    positions, normals = grasps(rng, 1000, 4)
    wrenches = rng.normal(size=(6, 6))
    print("| forces of 1,000 grasps for 6 wrenches each | cones | ms | ms with gradients |")
    print("|---|---|---|---|")
    for objective in ("max", "sum", "squares"):
        for cones, edges in (("8 edges", 8), ("true", None)):
            times = [
                least_time(
                    lambda gradient=gradient, objective=objective, edges=edges: gf.forces_many(
                        positions,
                        normals,
                        wrenches,
                        objective=objective,
                        friction=0.7,
                        edges=edges,
                        gradient=gradient,
                    ),
                    7,
                )
                for gradient in (False, True)
            ]
            print(f"| {objective} | {cones} | {times[0]:.0f} | {times[1]:.0f} |")
    twelve = grasps(rng, 32, 12)
    print()
    print(
        "| surrogate, with gradient | us a grasp (4 contacts, 8 edges) | us a grasp (12 contacts, 4 edges) |"
    )
    print("|---|---|---|")
    for name in ("min_weight", "differentiable_force_closure", "span_residual"):
        surrogate = getattr(gf.surrogates, name)
        four = least_time(lambda surrogate=surrogate: surrogate(positions, normals, friction=0.7), 7)
        many = least_time(lambda surrogate=surrogate: surrogate(*twelve, friction=0.7, edges=4), 7)
        print(f"| {name} | {four:.1f} | {many / 32 * 1e3:.1f} |")


if __name__ == "__main__":
    main()
