"""Meshes of objects, read as plain triangles."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidFileError

from .safe_read import limited_bytes
from .scene_file import SCENES, scene_triangles
from .triangles import READERS, checked_faces

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

MAX_MESH_BYTES = 64 * 1024 * 1024
FORMATS = ("obj", "off", "ply", "stl", *SCENES)
_MAX_PLY_HEADER_BYTES = 64 * 1024
_MAX_PLY_ELEMENTS = 64
_PLY_COMMENT = re.compile(rb"^comment\b.*\n", re.MULTILINE)
_PLY_ELEMENT = re.compile(rb"^element[ \t]+(\w+)[ \t]+(\S+)[ \t]*\r?$", re.MULTILINE)


def load_mesh(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read vertices (v, 3) in m and triangles (t, 3) from an OBJ, OFF, PLY, STL, GLB, GLTF or 3MF file.

    Safe to call from several threads. Triangles come in the order of the file, polygons as fans around their
    first corner. Vertices in one place are merged; materials and groups are left out.
    The parts of a GLB, GLTF or 3MF scene stand where the scene puts them.

    Raises
    ------
    InvalidFileError
        The file cannot be read, is larger than 64 MiB, holds no finite triangles or other numbers of them
        than it claims, or names vertices that are not there. Indices of OBJ that count from the end (-1) are
        not read.
    MissingExtraError
        trimesh, or lxml or networkx for a 3MF file, is not installed.
    """
    trimesh = optional("trimesh", "mesh")
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InvalidFileError(path, f"not one of the known formats: {', '.join(FORMATS)}")
    content = limited_bytes(path, MAX_MESH_BYTES)
    if kind in SCENES:
        vertices, faces = scene_triangles(path, kind, content)
    else:
        vertices, faces = READERS[kind](path, content) if kind in READERS else _ply(path, content)
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise InvalidFileError(path, "no triangles, or vertices that are not finite")
    checked_faces(path, faces, len(vertices))
    try:
        mesh: Any = trimesh.Trimesh(vertices, faces, process=True)
        return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # noqa: BLE001 - whatever someone else's code makes of odd triangles
        raise InvalidFileError(path, f"not a mesh: {error}") from None


def _ply(path: Path, content: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    # A parser takes far longer for a byte of the header than for one of the rows.
    end = content.find(b"end_header", 0, _MAX_PLY_HEADER_BYTES)
    if end < 0:
        raise InvalidFileError(path, f"not a mesh: no end_header in the first {_MAX_PLY_HEADER_BYTES} bytes")
    elements = _PLY_ELEMENT.findall(content[:end])
    if len(elements) > _MAX_PLY_ELEMENTS:
        raise InvalidFileError(path, f"{len(elements)} elements, more than {_MAX_PLY_ELEMENTS}")
    claimed: dict[bytes, int] = {}
    for name, count in elements:
        # Each takes a byte at least; what claims more would be made room for.
        if not count.isdigit() or len(count) > 12 or int(count) > len(content):
            given = count[:60].decode("ascii", "replace")
            raise InvalidFileError(
                path, f"claims {given} of {name.decode('ascii', 'replace')}, in {len(content)} bytes"
            )
        claimed[name] = int(count)
    try:
        trimesh = optional("trimesh", "mesh")
        # trimesh looks for pictures that comments name, and reports to the terminal that they are missing.
        plain = _PLY_COMMENT.sub(b"", content[:end]) + content[end:]
        mesh: Any = trimesh.load(io.BytesIO(plain), file_type="ply", force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # noqa: BLE001 - whatever a parser of someone else's makes of a broken file
        raise InvalidFileError(path, f"not a mesh: {error}") from None
    if len(vertices) != claimed.get(b"vertex", 0) or len(faces) < claimed.get(b"face", 0):
        raise InvalidFileError(
            path,
            f"claims {claimed.get(b'vertex', 0)} vertices and {claimed.get(b'face', 0)} faces, but holds "
            f"{len(vertices)} and {len(faces)} triangles",
        )
    return vertices, faces
