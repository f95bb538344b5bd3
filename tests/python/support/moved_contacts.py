"""Grasps on ellipsoids, and central differences by their contacts and wrenches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

STEP = 1e-5


def ellipsoid_grasps(
    rng: np.random.Generator, rows: int, dim: int, contacts: int | None = None
) -> tuple[Array, Array]:
    """Contacts on ellipsoids, with normals that are not quite theirs."""
    contacts = contacts or dim + 2
    outward = rng.normal(size=(rows, contacts, dim))
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    axes = rng.uniform(0.5, 1.5, size=(rows, 1, dim))
    normals = -outward / axes + 0.1 * rng.normal(size=outward.shape)
    return outward * axes, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def ragged_grasps(rng: np.random.Generator) -> tuple[Array, Array, list[int]]:
    """Contacts of grasps with 4, 5, 0, 3 and 4 contacts, and where each grasp begins."""
    counts = [4, 5, 0, 3, 4]
    grasps = [ellipsoid_grasps(rng, 1, 3, count) for count in counts if count]
    positions, normals = (np.concatenate([grasp[part][0] for grasp in grasps]) for part in (0, 1))
    return positions, normals, np.cumsum([0, *counts]).tolist()


def tangents_of(normals: Array) -> Array:
    """Return the first tangents that contacts have by default."""
    axis = np.where(np.abs(normals[..., :1]) > 0.7, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    tangents = axis - normals * (axis * normals).sum(-1, keepdims=True)
    return tangents / np.linalg.norm(tangents, axis=-1, keepdims=True)


def turned(
    rng: np.random.Generator, normals: Array
) -> Callable[[float], tuple[Array, dict[str, Array], Array]]:
    """Turn normals by a step along random directions, and tangents by the same smallest rotation."""
    dim = normals.shape[-1]
    slope = rng.normal(size=normals.shape)
    slope -= normals * (slope * normals).sum(-1, keepdims=True)
    length = np.linalg.norm(slope, axis=-1, keepdims=True)

    def at(step: float) -> tuple[Array, dict[str, Array], Array]:
        angle = step * length
        moved = normals * np.cos(angle) + slope / length * np.sin(angle)
        if dim == 2:
            return moved, {}, slope
        tangents, axis = tangents_of(normals), np.cross(normals, slope / length)
        along = axis * (axis * tangents).sum(-1, keepdims=True) * (1.0 - np.cos(angle))
        rotated = tangents * np.cos(angle) + np.cross(axis, tangents) * np.sin(angle) + along
        return moved, {"tangents": rotated}, slope

    return at


def slopes(
    rng: np.random.Generator,
    value: Callable[..., Array],
    positions: Array,
    normals: Array,
    wrenches: Array,
    gradient: Any,
) -> Iterator[tuple[Array, Array]]:
    """Central differences by positions, normals and wrenches, beside what a gradient says."""
    tangents = {"tangents": tangents_of(normals)} if normals.shape[-1] == 3 else {}
    along = rng.normal(size=positions.shape)
    sides = [value(positions + s * STEP * along, normals, wrenches, **tangents) for s in (1, -1)]
    yield (sides[0] - sides[1]) / (2 * STEP), (gradient.positions * along[:, None]).sum((-2, -1))
    at = turned(rng, normals)
    sides = []
    for step in (STEP, -STEP):
        moved, frames, slope = at(step)
        sides.append(value(positions, moved, wrenches, **frames))
    yield (sides[0] - sides[1]) / (2 * STEP), (gradient.normals * slope[:, None]).sum((-2, -1))
    along = rng.normal(size=wrenches.shape)
    sides = [value(positions, normals, wrenches + s * STEP * along, **tangents) for s in (1, -1)]
    yield (sides[0] - sides[1]) / (2 * STEP), (gradient.external_wrench * along).sum(-1)
