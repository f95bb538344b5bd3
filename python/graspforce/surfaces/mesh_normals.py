"""Normals of a triangle mesh at faces and corners, and a check of given normals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import TriangleTree
from graspforce._internal.checks import finite_array
from graspforce._internal.vectors import cross, unit
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from .mesh_parts import Part

    Array = NDArray[np.float64]

_TIE = (
    1e-6  # faces within this share of the extent are equally near; also the cosine of a normal along a face
)


def unit_normals(triangles: Array) -> Array:
    """(F, 3) outward unit normals of triangles (F, 3, 3); zero where they have no area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    longest = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2).max(axis=1, keepdims=True)
    normals: Array = np.divide(across, length, out=np.zeros_like(across), where=length > 1e-14 * longest**2)
    return normals


def center_of_mass(triangles: Array) -> Array:
    """(3,) centre of the volume that triangles (F, 3, 3) enclose, at uniform density."""
    start = triangles[0, 0]
    a, b, c = np.moveaxis(triangles - start, 1, 0)
    volumes = (a * np.cross(b, c)).sum(axis=1) / 6
    center: Array = start + (volumes[:, None] * (a + b + c) / 4).sum(axis=0) / volumes.sum()
    return center


def corner_normals(parts: Iterable[Part], flat: Array) -> Array:
    """(F, 3, 3) outward unit normals at the corners of each face: means over adjacent faces, by angle."""
    normals = np.repeat(flat[:, None], 3, axis=1)
    for part in parts:
        corners = part.triangles
        sides = [
            unit(part.vertices[np.roll(corners, turn, axis=1)] - part.vertices[corners]) for turn in (1, -1)
        ]
        cosines = np.nan_to_num((sides[0] * sides[1]).sum(axis=2))
        angles = np.arccos(np.clip(cosines, -1.0, 1.0))
        means = np.zeros_like(part.vertices)
        np.add.at(means, corners.ravel(), (angles[:, :, None] * flat[part.faces][:, None]).reshape(-1, 3))
        lengths = np.linalg.norm(means, axis=1, keepdims=True)
        means = np.divide(means, lengths, out=np.zeros_like(means), where=lengths > 1e-12)
        normals[part.faces] = means[corners]
    return normals


def barycentric(triangles: Array, points: Array) -> Array:
    """(B, 3) barycentric coordinates of points (B, 3) in triangles (B, 3, 3)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    across = cross(b - a, c - a)
    area = np.maximum((across * across).sum(axis=1), np.finfo(float).tiny)
    second = (cross(points - a, c - a) * across).sum(axis=1) / area
    third = (cross(b - a, points - a) * across).sum(axis=1) / area
    weights = np.clip(np.stack([1 - second - third, second, third], axis=1), 0.0, None)
    shares: Array = weights / np.maximum(weights.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return shares


def refuse_outward(
    vertices: Array, faces: NDArray[np.int64], outward: Array, positions: ArrayLike, normals: ArrayLike
) -> None:
    """Refuse normals (m, 3) at positions (m, 3) that point out of all faces nearest to them."""
    places, given = finite_array("positions", positions), finite_array("normals", normals)
    if places.ndim != 2 or places.shape[1] != 3 or given.shape != places.shape:
        raise InvalidInputError(
            f"positions and normals: shapes {places.shape} and {given.shape}, expected both to be (m, 3)"
        )
    real = np.flatnonzero(outward.any(axis=1))
    tree = TriangleTree(vertices, faces[real])
    tie = _TIE * float(np.ptp(vertices, axis=0).max())
    nearest, rows, _ = tree.closest(places)
    # A contact on an edge is near to several faces: each is looked up around the nearest point.
    steps = tie * np.vstack([np.eye(3), -np.eye(3)])
    around = tree.closest((nearest[:, None] + steps).reshape(-1, 3))[1].reshape(-1, len(steps))
    beside = outward[real[np.column_stack([rows, around])]]
    cosines = np.einsum("mkd,md->mk", beside, unit(given))
    # At an edge, the inward normal of one face points into its own face more than out of the other.
    # Normals of zero length give NaN here; the grasp refuses them.
    wrong = cosines.max(axis=1) + cosines.min(axis=1) > _TIE
    for contact in np.flatnonzero(wrong):
        nearest_normal = (outward[real[rows[contact]]] + 0.0).round(6).tolist()
        raise InvalidInputError(
            f"normals, contact {contact}: {given[contact].tolist()} points out of the mesh: the outward "
            f"normal at the nearest point is {nearest_normal}; turn it round, or pass check_normals=False"
        )
