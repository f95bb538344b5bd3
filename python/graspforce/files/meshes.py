"""Meshes of objects, read as plain triangles."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._optional import optional
from graspforce.errors import InvalidFileError

from .limits import limited_bytes

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

__all__ = ["FORMATS", "MAX_MESH_BYTES", "load_mesh"]

MAX_MESH_BYTES = 64 * 1024 * 1024
FORMATS = ("obj", "off", "ply", "stl")


def load_mesh(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read vertices (v, 3) in m and triangles (t, 3) from an OBJ, OFF, PLY or STL file.

    Threads may call this at once.

    Raises
    ------
    InvalidFileError
        The file cannot be read, is larger than 64 MiB, or holds no finite triangles.
    MissingExtraError
        trimesh is not installed.
    """
    trimesh = optional("trimesh", "mesh")
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InvalidFileError(path, f"not one of the known formats: {', '.join(FORMATS)}")
    content = limited_bytes(path, MAX_MESH_BYTES)
    try:
        mesh: Any = trimesh.load(io.BytesIO(content), file_type=kind, force="mesh")
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # noqa: BLE001 - whatever a parser of someone else's makes of a broken file
        raise InvalidFileError(path, f"not a mesh: {error}") from None
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise InvalidFileError(path, "no triangles, or vertices that are not finite")
    return vertices, faces
