"""Optimal forces that are not unique but for rounding: feet in a line, pinches, duplicated contacts.

Feet stand in a line but for 1e-8 to 1e-6 of its length, as sensors see them. Pinches are two or four
opposite fingers, hard or soft, moved by 1e-8 of their distance. Duplicates are contacts that a mesh or a
simulator lists twice, some of them moved by up to 1e-9 of their size; their limits are spread over four
orders of magnitude.
"""

from __future__ import annotations

import warnings

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
    """Contacts listed up to four times, in the plane or in space, with limits from 0.01 to 100 N."""
    rng = np.random.default_rng([3, seed])
    dim = 2 if rng.integers(3) == 0 else 3
    number = int(rng.integers(1, 5))
    outward = rng.standard_normal((number, dim))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    kind = rng.integers(3)
    if kind == 1:
        outward = np.vstack([np.eye(dim), -np.eye(dim)])[rng.permutation(2 * dim)[:number]]
    size = 10 ** rng.uniform(-2, 0)
    again = np.repeat(np.arange(len(outward)), rng.integers(1, 5, len(outward)))
    positions, normals = size * outward[again], -outward[again]
    if kind == 2:
        positions[:, -1] = 0
        normals = np.tile(np.eye(dim)[-1], (len(again), 1))
    positions += size * rng.choice([0, 0, 1e-16, 1e-12, 1e-9]) * rng.standard_normal(positions.shape)
    spread = [
        10 ** rng.uniform(-2, 2, len(again)),
        10.0 ** rng.integers(-2, 3, len(again)),
        rng.choice([0.01, 100.0], len(again)),
    ]
    options = {} if dim == 2 else {"edges": int(rng.choice([3, 4, 6, 8, 12]))}
    if dim == 3 and rng.integers(3) == 0:
        options["torsion"] = 0.1 * size
    with warnings.catch_warnings():
        # Duplicates are near each other, and feet have no side.
        warnings.simplefilter("ignore", gf.GraspWarning)
        grasp = gf.Grasp(
            positions,
            normals,
            friction=float(rng.choice([0.2, 0.5, 1.0])),
            max_normal_force=spread[rng.integers(3)],
            **options,
        )
    wrenches = grasp.primitive_wrenches
    used = rng.uniform(size=len(wrenches)) < rng.choice([0.1, 0.3, 0.6, 1.0])
    shares = rng.uniform(0, 1, len(wrenches)) * used
    if rng.integers(2):
        shares = np.round(4 * shares) / 4
    wrench = -shares @ wrenches if shares.any() else -wrenches[0]
    if rng.integers(8) == 0:
        wrench = rng.standard_normal(len(wrench)) * np.abs(wrenches).max(axis=0)
    return grasp, wrench, str(rng.choice(["max", "sum"]))


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
