"""Checks of a triangle mesh before contacts are placed on it, and the union of its parts."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_array, real_number
from graspforce.errors import InvalidInputError, MissingExtraError

from .mesh_parts import parts_of
from .mesh_union import boundary_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from .mesh_parts import Part
    from .mesh_union import Boundary

    Array = NDArray[np.float64]

_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
# In m. No hand holds a smaller or larger object, so the unit of such a mesh is wrong.
_SIZES = (1e-3, 5.0)


@dataclass(frozen=True, slots=True)
class CheckedMesh:
    """A mesh as given, in m, its parts, and the boundary of their union."""

    vertices: Array
    faces: NDArray[np.int64]
    parts: tuple[Part, ...]
    boundary: Boundary


def metres(unit: str | float) -> float:
    """Length of a unit in m, by name or as a number."""
    if isinstance(unit, str):
        if unit not in _UNITS:
            raise InvalidInputError(f"unit: {unit!r} is none of {', '.join(_UNITS)}")
        return _UNITS[unit]
    return real_number("unit", unit, positive=True)


def checked_mesh(mesh: Any, unit: float, check_watertight: bool, check_size: bool) -> CheckedMesh:
    """Return the mesh in m with its parts checked and united; raise an error if it is not solid."""
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
        wanted = "give a trimesh.Trimesh or what else has vertices and faces"
        wanted = "give scene.to_mesh()" if hasattr(mesh, "to_mesh") else wanted
        raise InvalidInputError(f"mesh: {reprlib.repr(mesh)} has no triangles; {wanted}")
    if len(mesh.faces) == 0:
        message = f"a {type(mesh).__name__} with {len(mesh.vertices)} vertices and 0 faces has no triangles"
        raise InvalidInputError(f"mesh: {message}")
    vertices, faces = _triangles(mesh)
    vertices = vertices * unit
    used = vertices[np.unique(faces)]
    extent = float(np.ptp(used, axis=0).max())
    if check_size and not _SIZES[0] <= extent <= _SIZES[1]:
        raise InvalidInputError(
            f"unit: the mesh would be {extent:.4g} m long, outside {_SIZES[0]:g} m to {_SIZES[1]:g} m; "
            "give the unit of its vertices, or pass check_size=False"
        )
    parts = parts_of(vertices, faces)
    if not parts:
        raise InvalidInputError("mesh: every face repeats a corner, so that none has an area")
    for part in parts:
        if part.open_edges and check_watertight:
            raise InvalidInputError(
                f"{part}: {part.fault}; repair it "
                "(trimesh.repair), take its convex hull, or pass check_watertight=False"
            )
        if part.fault is not None and not part.open_edges:
            raise InvalidInputError(f"{part}: {part.fault}")
    if len(parts) == 1 and not parts[0].open_edges and parts[0].volume < 0:
        raise InvalidInputError(
            f"mesh: inside out: its normals point inward (volume {parts[0].volume:.3g} m^3); "
            "call mesh.invert() first"
        )
    return CheckedMesh(vertices, faces, tuple(parts), boundary_of(vertices, faces, parts))


def outer_surface(vertices: ArrayLike, faces: ArrayLike) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices and faces of the union of a mesh's parts; those given if some part is not solid.

    Drawings use it, and contacts that are dragged: both also work on a mesh that is not solid.
    """
    points, triangles = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    try:
        parts = parts_of(points, triangles)
        if not parts or any(part.fault is not None for part in parts):
            return points, triangles
        surface = boundary_of(points, triangles, parts)
    except (InvalidInputError, MissingExtraError):
        return points, triangles
    return surface.vertices, surface.faces


def _triangles(mesh: Any) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (V, 3), and faces (F, 3) by the rows of their vertices."""
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
            f"mesh: face {row}: {faces[row].tolist()} must be whole numbers from 0 to {len(vertices) - 1}"
        )
    return vertices.astype(np.float64), faces.astype(np.int64)
