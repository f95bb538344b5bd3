"""What a quality and a surrogate cost, each with its gradient."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

import graspforce as gf

from .ranking import OPTIONS, random_grasps

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["LIMIT", "calls", "closed_grasps", "least_times", "table"]

LIMIT = 20.0


def closed_grasps(rng: np.random.Generator, count: int, contacts: int) -> tuple[Array, Array]:
    """Return positions and normals of force-closure grasps."""
    outward, axes = random_grasps(rng, 4 * count if contacts > 4 else 20 * count, contacts)
    positions, normals = outward * axes, -outward / axes
    closed = gf.quality_many(positions, normals, criterion="sum", **OPTIONS).closure == 1
    return positions[closed][:count], normals[closed][:count]


def calls(positions: Array, normals: Array, edges: int) -> dict[str, Callable[[], object]]:
    """Return what is timed."""
    options = {"edges": edges, **OPTIONS}

    def quality(criterion: str) -> object:
        return gf.quality_many(positions, normals, criterion=criterion, gradient=True, **options)

    return {
        "epsilon (sum)": lambda: quality("sum"),
        "epsilon (max)": lambda: quality("max"),
        "minimum weight": lambda: gf.surrogates.min_weight(positions, normals, **options),
        "differentiable force closure": lambda: gf.surrogates.differentiable_force_closure(
            positions, normals, **options
        ),
        "span residual": lambda: gf.surrogates.span_residual(positions, normals, limit=LIMIT, **options),
    }


def least_times(
    timed: dict[str, Callable[[], object]], repeats: int, seconds: float = 60.0
) -> dict[str, tuple[float, float]]:
    """Return the least time of each call in s, and its least processor time.

    The calls take turns of at least 0.1 s. After so many seconds no turn begins, but each call has one.
    """
    least = dict.fromkeys(timed, (np.inf, np.inf))
    ends = time.perf_counter() + seconds
    for turn in range(repeats):
        for name, call in timed.items():
            if turn and time.perf_counter() > ends:
                return least
            end = time.perf_counter() + 0.1
            while (start := time.perf_counter()) < end:
                busy = time.process_time()
                call()
                wall, processor = least[name]
                busy, passed = time.process_time() - busy, time.perf_counter() - start
                least[name] = min(wall, passed), min(processor, busy)
    return least


def table(seed: int = 6) -> str:
    """Return what each number costs with its gradient."""
    rng = np.random.default_rng(seed)
    few, many = closed_grasps(rng, 1000, 4), closed_grasps(rng, 32, 12)
    times = [
        {
            name: 1e6 * wall / len(grasps[0])
            for name, (wall, _) in least_times(calls(*grasps, edges), 7).items()
        }
        for grasps, edges in ((few, 8), (many, 4))
    ]
    lines = [
        "| us a grasp, with gradient | 1,000 of 4 contacts, 8 edges | 32 of 12 contacts, 4 edges |",
        "|---|---|---|",
    ]
    lines += [f"| {name} | {times[0][name]:.1f} | {times[1][name]:.1f} |" for name in times[0]]
    return "\n".join(lines) + "\n"
