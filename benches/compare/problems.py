"""The problems that every peer gets, seeded: grasps, closed or not, and wrenches to balance."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

import graspforce as gf
from graspforce.paper import RACKET, TABLE_1, TILE, TILE_WRENCHES
from graspforce.paper.tile import INFERRED_FRICTION, tile_grasp

if TYPE_CHECKING:
    from collections.abc import Iterator

MASK = (1 << 64) - 1
AXES = np.array([1.0, 0.8, 1.3])


@dataclass
class Contacts:
    """Contacts, and the options that make a grasp of them."""

    positions: np.ndarray
    normals: np.ndarray
    options: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def grasp(self) -> gf.Grasp:
        """The grasp itself."""
        return gf.Grasp(self.positions, self.normals, **self.options)

    @cached_property
    def union(self) -> np.ndarray:
        """The primitive wrenches, whose hull ``rho_sum`` measures."""
        return self.grasp.primitive_wrenches

    @cached_property
    def minkowski_sum(self) -> np.ndarray:
        """The enumerated points, whose hull ``rho_max`` measures."""
        return self.grasp.minkowski_sum().wrenches


def random_numbers(seed: int) -> Iterator[float]:
    """Repeat the generator of ``benches/common``: the same seed makes the same grasps in both languages."""
    state = (seed * 0x9E37_79B9_7F4A_7C15) & MASK | 1
    while True:
        state ^= state >> 12
        state ^= (state << 25) & MASK
        state ^= state >> 27
        yield (((state * 0x2545_F491_4F6C_DD1D) & MASK) >> 11) / 2**53


def ellipsoid_contacts(numbers: Iterator[float], count: int, edges: int | None) -> Contacts:
    """Contacts at random points of an ellipsoid, friction 0.5, limits of 1 N."""

    def direction() -> np.ndarray:
        while True:
            v = np.array([2 * next(numbers) - 1 for _ in range(3)])
            if 0.01 <= np.linalg.norm(v) < 1:
                return v / np.linalg.norm(v)

    u = np.array([direction() for _ in range(count)])
    return Contacts(u * AXES, -u / AXES, {"friction": 0.5, "edges": edges})


def closed_grasps(seed: int, number: int, count: int, edges: int | None) -> list[Contacts]:
    """Find the first force-closure grasps of a seeded sequence."""
    numbers = random_numbers(seed)
    found: list[Contacts] = []
    while len(found) < number:
        contacts = ellipsoid_contacts(numbers, count, edges)
        if contacts.grasp.quality("sum").rho < 0:
            found.append(contacts)
    return found


def any_grasps(seed: int, number: int, edges: int) -> list[Contacts]:
    """Two to five contacts: some are force closure, some are not."""
    numbers = random_numbers(seed)
    return [ellipsoid_contacts(numbers, 2 + k % 4, edges) for k in range(number)]


def tetrahedron(edges: int) -> Contacts:
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / np.sqrt(3)
    return Contacts(corners, -corners, {"friction": 0.5, "edges": edges})


def racket() -> Contacts:
    """Return the four fingers of Table 1, row n: a planar grasp of eight primitive wrenches."""
    problem = RACKET["four fingers"]
    positions, normals = (x[0] for x in problem.surface(np.array([TABLE_1["n"].params])))
    return Contacts(
        positions, normals, {"friction": problem.friction, "max_normal_force": problem.max_normal_force}
    )


def tile(edges: int | None = TILE.edges) -> gf.Grasp:
    """Return the printed optimum of Example 2 for the maximum, with the inferred friction."""
    return tile_grasp(TILE.published["max"].params, INFERRED_FRICTION, edges)


def trajectory(count: int) -> list[np.ndarray]:
    """Sample the wrench of Fig. 6 at 1 kHz; 10,000 are one period."""
    return list(TILE_WRENCHES[6].at(np.arange(count) / 1000))


def jumps(seed: int, count: int) -> list[np.ndarray]:
    """Wrenches that have nothing to do with each other, each component uniform in [-1, 1]."""
    numbers = random_numbers(seed)
    return [np.array([2 * next(numbers) - 1 for _ in range(6)]) for _ in range(count)]
