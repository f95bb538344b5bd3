"""Grasps of small integers with a contact at the torque origin: torques that are all rounding."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from benches.trust.judge import verdict
from benches.trust.row import Row

from graspforce._core import unwarned_grasp

if TYPE_CHECKING:
    import graspforce as gf

__all__ = ["case", "rows"]

CASES = 15_057


def case(seed: int) -> tuple[gf.Grasp, np.ndarray, str]:
    """Make a grasp, an external wrench and an objective."""
    rng = np.random.default_rng([3, seed])
    dim = 2 + seed % 2
    count = int(rng.integers(1, 5))
    positions = rng.integers(-3, 4, (count + 1, dim)) * rng.choice([0.05, 0.1, 1.0])
    positions[0] = 0
    normals = rng.integers(-2, 3, (count + 1, dim)).astype(float)
    normals[(normals == 0).all(axis=1), 0] = 1
    grasp = unwarned_grasp(positions, normals, friction=float(rng.choice([0.25, 0.5, 1.0])))
    wrench = np.zeros(3 if dim == 2 else 6)
    # Half of the wrenches are what a few of the contacts exert, so that many can be balanced.
    if rng.integers(2):
        wrench[:dim] = rng.integers(-3, 4, dim)
    else:
        chosen = rng.integers(0, 3, len(grasp.primitive_wrenches)) * (
            rng.random(len(grasp.primitive_wrenches)) < 0.2
        )
        wrench = -chosen @ grasp.primitive_wrenches
    if not wrench.any():
        wrench[0] = 1
    return grasp, wrench, str(rng.choice(["max", "sum"]))


def rows(share: float) -> list[Row]:
    """Least forces beside HiGHS."""
    cases = round(CASES * share)
    ends = [verdict(*case(seed))[0] for seed in range(cases)]
    row = Row(
        "a contact at the torque origin", cases, "HiGHS, rationals", ends.count("missed"), ends.count("wrong")
    )
    return [row]
