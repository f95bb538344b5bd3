"""Optimal forces that are not unique but for rounding: feet in a line, soft and hard pinches, duplicated contacts.

Feet stand in a line but for 1e-8 to 1e-6 of its length, as sensors see them. Pinches are two or four opposite fingers,
moved by 1e-8 of their distance. Duplicates are contacts that a mesh or a simulator lists twice, with limits that are
spread over four orders of magnitude.
"""

from __future__ import annotations

import numpy as np
from benches.trust.judge import verdict
from benches.trust.nearly_degenerate import count, turn
from benches.trust.row import Row

import graspforce as gf

__all__ = ["FAMILIES", "rows"]

Case = tuple[gf.Grasp, np.ndarray, str]

CASES = 3_000


def feet_in_a_line(seed: int) -> Case:
    """Three to five feet, a load between them and a torque of rounding about the line."""
    rng = np.random.default_rng([1, seed])
    number = int(rng.integers(3, 6))
    length = 10 ** rng.uniform(-1.5, 0)
    noise = length * 10 ** rng.uniform(-8, -6)
    along = np.linspace(-1, 1, number) * length
    feet = np.column_stack([along, np.zeros(number), np.zeros(number)])
    feet += noise * rng.standard_normal(feet.shape)
    weights = rng.dirichlet(np.ones(number))
    force = np.array([0, 0, -9.81]) * 10 ** rng.uniform(-1, 0)
    torque = np.cross(weights @ feet, force)
    rotation = turn(rng)
    grasp = gf.Grasp(
        feet @ rotation.T,
        np.tile(rotation @ [0.0, 0.0, 1.0], (number, 1)),
        friction=float(rng.choice([0.3, 0.5, 1.0])),
        max_normal_force=20.0,
        edges=int(rng.choice([4, 6, 8])),
    )
    return grasp, np.hstack([rotation @ force, rotation @ torque]), str(rng.choice(["max", "sum"]))


def pinches(seed: int) -> Case:
    """Two or four opposite fingers, hard or soft, moved by 1e-8 of their distance."""
    rng = np.random.default_rng([2, seed])
    width = 10 ** rng.uniform(-2, -1)
    outward = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], float)[: int(rng.choice([2, 4]))]
    positions = width * (outward + 1e-8 * rng.standard_normal(outward.shape))
    torsion = 0.3 * width if rng.integers(2) else None
    edges = int(rng.choice([4, 6, 8]))
    grasp = gf.Grasp(
        positions,
        -outward,
        friction=float(rng.choice([0.5, 1.0])),
        torsion=torsion,
        max_normal_force=10.0,
        edges=edges,
    )
    shares = rng.integers(0, 3, len(grasp.primitive_wrenches)) * (
        rng.uniform(size=len(grasp.primitive_wrenches)) < 0.3
    )
    wrench = -0.2 * shares @ grasp.primitive_wrenches
    if not shares.any() or rng.integers(3) == 0:
        wrench = np.array([0, 0, -3.0, 0, 0, 0])
    return grasp, wrench, str(rng.choice(["max", "sum"]))


def duplicates(seed: int) -> Case:
    """Contacts that are listed twice or three times, whose limits are spread over four orders of magnitude."""
    rng = np.random.default_rng([3, seed])
    number = int(rng.integers(2, 6))
    outward = rng.standard_normal((number, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    if rng.integers(2):
        outward = np.vstack([np.eye(3), -np.eye(3)])[rng.permutation(6)[:number]]
    size = 10 ** rng.uniform(-2, 0)
    again = np.repeat(np.arange(number), rng.integers(1, 4, number))
    limits = 10 ** rng.uniform(-2, 2, len(again))
    torsion = 0.1 * size if rng.integers(3) == 0 else None
    grasp = gf.Grasp(
        size * outward[again],
        -outward[again],
        friction=float(rng.choice([0.3, 0.5, 1.0])),
        torsion=torsion,
        max_normal_force=limits,
        edges=int(rng.choice([4, 6, 8])),
    )
    if rng.integers(2):
        shares = rng.uniform(0, 1, len(grasp.primitive_wrenches)) * (
            rng.uniform(size=len(grasp.primitive_wrenches)) < 0.4
        )
        wrench = -shares @ grasp.primitive_wrenches
        if shares.any():
            return grasp, wrench, str(rng.choice(["max", "sum"]))
    force = rng.standard_normal(3)
    return grasp, np.hstack([force, size * rng.standard_normal(3)]), str(rng.choice(["max", "sum"]))


FAMILIES = {
    "feet in a line but for rounding": feet_in_a_line,
    "pinches with noise of 1e-8": pinches,
    "duplicated contacts, limits over four orders": duplicates,
}


def rows(share: float) -> list[Row]:
    """Objectives and infeasible wrenches beside HiGHS and rational arithmetic."""
    found = []
    for family, case in FAMILIES.items():
        number = max(1, round(CASES * share))
        missed, wrong = count(verdict(*case(seed)) for seed in range(number))
        found.append(Row(family, number, "HiGHS, rationals", missed, wrong))
    return found
