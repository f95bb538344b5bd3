"""What a triangle mesh must be before contacts go on it, and which of its faces they can touch."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._checks import finite_array, real_number
from graspforce._optional import optional
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["checked_mesh", "curvature", "hidden_faces", "metres"]

_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
# A hand holds nothing smaller or larger: such a mesh is in other units than it says.
_SIZES = (1e-3, 5.0)
_FLAT = 1e-12  # of the cube of the largest extent: a volume that is all rounding


def metres(unit: str | float) -> float:
    """Length of a unit in m, by name or as a number."""
    if isinstance(unit, str):
        if unit not in _UNITS:
            raise InvalidInputError(f"unit: {unit!r} is none of {', '.join(_UNITS)}")
        return _UNITS[unit]
    return real_number("unit", unit, positive=True)


def checked_mesh(mesh: Any, unit: float, check_watertight: bool, check_size: bool) -> Any:
    """Return the mesh in m, triangles and orientation checked, or raise what is wrong with it."""
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")) or len(mesh.faces) == 0:
        raise InvalidInputError(f"mesh: {mesh!r} has no triangles")
    vertices, faces = _triangles(mesh)
    # Always a copy: what is cached and checked must not change with the caller's mesh.
    own = optional("trimesh", "mesh").Trimesh(vertices * unit, faces, process=False)
    extent = float(own.extents.max())
    if check_size and not _SIZES[0] <= extent <= _SIZES[1]:
        raise InvalidInputError(
            f"unit: the mesh would be {extent:.4g} m long, outside {_SIZES[0]:g} m to {_SIZES[1]:g} m; "
            "say which unit its vertices are in, or pass check_size=False"
        )
    if check_watertight and not own.is_watertight:
        edges = np.sort(own.edges, axis=1)
        uses = np.unique(edges, axis=0, return_counts=True)[1]
        raise InvalidInputError(
            f"mesh: not watertight: {int((uses != 2).sum())} of {len(uses)} edges do not have two faces; "
            "repair it "
            "(trimesh.repair), take its convex hull, or pass check_watertight=False"
        )
    if not own.is_winding_consistent:
        raise InvalidInputError("mesh: faces are not oriented alike, so normals have no side; "
                                "see trimesh.repair.fix_winding")  # fmt: skip
    if own.is_watertight:
        volume = _volume(np.asarray(own.triangles))
        # A sheet with two sides is closed by its edges and holds nothing.
        if abs(volume) <= _FLAT * extent**3:
            raise InvalidInputError(f"mesh: flat: it encloses no volume ({volume:.3g} m^3)")
        if volume < 0:
            raise InvalidInputError(
                f"mesh: inside out: its normals point inward (volume {volume:.3g} m^3); call mesh.invert() "
                "first"
            )
    return own


def _triangles(mesh: Any) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (V, 3) and faces (F, 3) that name vertices."""
    vertices = np.asarray(mesh.vertices)
    if vertices.dtype.kind not in "iuf" or vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InvalidInputError(
            f"mesh: vertices {vertices.dtype} of shape {vertices.shape}, expected numbers (V, 3)"
        )
    if not np.isfinite(vertices).all():
        row = int(np.argwhere(~np.isfinite(vertices))[0, 0])
        raise InvalidInputError(f"mesh: vertex {row} is not finite: {vertices[row].tolist()}")
    faces = finite_array("mesh: faces", mesh.faces)
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise InvalidInputError(f"mesh: faces of shape {faces.shape}, expected (F, 3)")
    bad = (faces != np.floor(faces)) | (faces < 0) | (faces >= len(vertices))
    if bad.any():
        row = int(np.argwhere(bad)[0, 0])
        raise InvalidInputError(
            f"mesh: face {row}: {faces[row].tolist()} are not numbers of {len(vertices)} vertices"
        )
    return vertices.astype(np.float64), faces.astype(np.int64)


def _volume(triangles: Array) -> float:
    """Volume in m^3 that closed triangles (F, 3, 3) enclose, negative where they face inward."""
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def curvature(mesh: Any) -> Array:
    """(F,) largest angle to a neighbour in rad, by the distance in m between the two centres."""
    pairs, angles = np.asarray(mesh.face_adjacency), np.asarray(mesh.face_adjacency_angles)
    centres = np.asarray(mesh.triangles_center)
    apart = np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    bend = angles / np.maximum(apart, 1e-12)
    worst = np.zeros(len(mesh.faces))
    np.maximum.at(worst, pairs.ravel(), np.repeat(bend, 2))
    return worst


def hidden_faces(mesh: Any) -> NDArray[np.bool_]:
    """(F,) whether a face lies inside another closed part, by winding numbers of points just outside it."""
    groups = importlib.import_module("trimesh.graph").connected_components(
        mesh.face_adjacency, nodes=np.arange(len(mesh.faces)), min_len=1
    )
    hidden = np.zeros(len(mesh.faces), dtype=bool)
    if len(groups) < 2:
        return hidden
    triangles = np.asarray(mesh.triangles)
    # Parts often share a plane where they touch: there a face is hidden by its neighbour on the other side.
    outside = np.asarray(mesh.triangles_center) + 1e-4 * mesh.extents.max() * np.asarray(mesh.face_normals)
    part = np.empty(len(triangles), dtype=np.int64)
    for number, group in enumerate(groups):
        part[group] = number
    for number, group in enumerate(groups):
        corners = triangles[group]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        near = ((outside >= low) & (outside <= high)).all(axis=1) & (part != number)
        for rows in np.array_split(np.flatnonzero(near), max(1, near.sum() * len(group) // 2_000_000)):
            hidden[rows] |= _winding_number(outside[rows], corners) > 0.5
    return hidden


def _winding_number(points: Array, triangles: Array) -> Array:
    """How often closed triangles (F, 3, 3) wind around points (B, 3), by van Oosterom and Strackee."""
    a, b, c = np.moveaxis(triangles[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=-1)
    rest = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    angles: Array = np.arctan2(volume, rest).sum(axis=1) / (2 * np.pi)
    return angles
