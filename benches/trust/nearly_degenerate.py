"""Supports that are degenerate but for rounding: feet on a floor, loads through the edge of what they span.

Two to eight contacts on regular polygons and on none, heights off by 1e-12 to 1e-5 m, positions as float32 or
with 6 to 12 decimals, hard and soft fingers, 4 to 12 edges, loads through the centre, a foot or the middle
of a side, upright and slightly tilted; boxes at any angle on their corners; two contacts on an edge.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from benches.trust.judge import cone_verdict, verdict
from benches.trust.row import Row

from graspforce._core import unwarned_grasp

if TYPE_CHECKING:
    import graspforce as gf

__all__ = ["case", "cone_case", "rows"]

CASES, CONE_CASES = 10_000, 2_000


def rounded(rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """Round the values as a sensor, a file or a simulator hands them on."""
    kind = rng.integers(3)
    if kind == 0:
        return values
    if kind == 1:
        return values.astype(np.float32).astype(float)
    return values.round(int(rng.integers(6, 13)))


def support(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feet, their normals, and a point of the floor that the load passes through."""
    family = rng.integers(4)
    noise = 10 ** rng.uniform(-12, -5)
    size = 10 ** rng.uniform(-2, 0)
    if family == 0:  # regular polygons
        count = int(rng.integers(3, 9))
        angles = 2 * np.pi * np.arange(count) / count + rng.choice([0, 0.1])
        flat = size * np.column_stack([np.cos(angles), np.sin(angles)])
    elif family == 1:  # irregular ones
        count = int(rng.integers(3, 9))
        angles = np.sort(rng.uniform(0, 2 * np.pi, count))
        flat = size * rng.uniform(0.5, 1, (count, 1)) * np.column_stack([np.cos(angles), np.sin(angles)])
    elif family == 2:  # boxes
        flat = size * rng.uniform(0.3, 1, 2) * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    else:  # two contacts on an edge
        flat = size * np.array([(1, 0), (-1, 0)])
    feet = np.column_stack([flat, noise * rng.standard_normal(len(flat)) * rng.integers(0, 2, len(flat))])
    where = rng.integers(4)
    if where == 0:
        load = feet.mean(axis=0)
    elif where == 1:
        load = feet[rng.integers(len(feet))]
    elif where == 2:
        start = int(rng.integers(len(feet)))
        load = (feet[start] + feet[(start + 1) % len(feet)]) / 2
    else:
        load = rng.dirichlet(np.ones(len(feet))) @ feet
    return feet, np.tile([0.0, 0.0, 1.0], (len(feet), 1)), load


def turn(rng: np.random.Generator) -> np.ndarray:
    """Draw a rotation, one in three the identity."""
    if rng.integers(3) == 0:
        return np.eye(3)
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    return q * np.sign(np.linalg.det(q))


def posed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contacts, normals and the wrench of a load, in a frame of any pose."""
    feet, normals, load = support(rng)
    rotation = turn(rng)
    weight = np.array([0, 0, -(10 ** rng.uniform(-1, 2))])
    if rng.integers(3) == 0:
        weight[:2] = np.abs(weight[2]) * 10 ** rng.uniform(-12, -1) * rng.standard_normal(2)
    feet, load, force = rounded(rng, feet @ rotation.T), load @ rotation.T, rotation @ weight
    if rng.integers(2):
        load = rounded(rng, load)
    return feet, normals @ rotation.T, np.hstack([force, np.cross(load, force)])


def case(seed: int) -> tuple[gf.Grasp, np.ndarray, str]:
    """Make a grasp over linearised cones, an external wrench and an objective."""
    rng = np.random.default_rng(seed)
    positions, normals, wrench = posed(rng)
    grasp = unwarned_grasp(
        positions,
        normals,
        friction=float(rng.choice([0.2, 0.5, 1.0])),
        torsion=0.02 * float(np.abs(positions).max()) if rng.integers(2) else None,
        max_normal_force=float(rng.choice([1, 20])),
        edges=int(rng.integers(4, 13)),
    )
    return grasp, wrench, str(rng.choice(["max", "sum"]))


def cone_case(seed: int) -> tuple[gf.Grasp, np.ndarray, str]:
    """Make the same with true cones."""
    rng = np.random.default_rng([7, seed])
    positions, normals, wrench = posed(rng)
    torsion = 0.02 * float(np.abs(positions).max()) if rng.integers(2) else None
    friction = float(rng.choice([0.2, 0.5, 1.0]))
    grasp = unwarned_grasp(
        positions, normals, friction=friction, torsion=torsion, max_normal_force=20.0, edges=None
    )
    return grasp, wrench, str(rng.choice(["max", "sum"]))


def count(verdicts) -> tuple[int, int]:
    """How many were missed and how many wrong."""
    ends = [end for end, _ in verdicts]
    return ends.count("missed"), ends.count("wrong")


def rows(share: float) -> list[Row]:
    """Linearised cones beside HiGHS, true ones beside Clarabel."""
    linear, cones = round(CASES * share), round(CONE_CASES * share)
    missed, wrong = count(verdict(*case(seed)) for seed in range(linear))
    lost, false = count(cone_verdict(*cone_case(seed)) for seed in range(cones))
    return [
        Row("nearly degenerate supports", linear, "HiGHS, rationals", missed, wrong),
        Row("nearly degenerate supports, true cones", cones, "Clarabel", lost, false),
    ]
