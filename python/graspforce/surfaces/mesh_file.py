"""Meshes of objects, read as plain triangles."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce._internal.safe_read import limited_bytes
from graspforce.errors import InvalidFileError

from .mesh_parts import components
from .scene_file import SCENES, scene_triangles
from .triangles import READERS, checked_faces

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

MAX_MESH_BYTES = 64 * 1024 * 1024
MAX_PARTS = 256
"""Largest number of closed parts of a surface. Each pair of them is checked for overlap, which takes time."""

FORMATS = ("obj", "off", "ply", "stl", *SCENES)
_MAX_PLY_HEADER_BYTES = 64 * 1024
_MAX_PLY_ELEMENTS = 64
_PLY_COMMENT = re.compile(rb"^comment\b.*\n", re.MULTILINE)
_PLY_ELEMENT = re.compile(rb"^element[ \t]+(\w+)[ \t]+(\S+)[ \t]*\r?$", re.MULTILINE)


class Triangles(NamedTuple):
    """Vertices (V, 3) and faces (F, 3) of a mesh."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


def few_parts(path: Path) -> Triangles:
    """Read the mesh of a surface: one of at most `MAX_PARTS` separate parts."""
    read = Triangles(*load_mesh(path))
    labels = components(int(read.faces.max()) + 1, np.concatenate([read.faces[:, :2], read.faces[:, 1:]]))
    if (parts := len(np.unique(labels[read.faces[:, 0]]))) > MAX_PARTS:
        raise InvalidFileError(
            path, f"{parts} separate parts, more than {MAX_PARTS}; join them into one surface first"
        )
    return read


def load_mesh(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read vertices (v, 3) in m and triangles (t, 3) from an OBJ, OFF, PLY, STL, GLB, GLTF, 3MF or XAML file.

    Safe to call from several threads. Triangles come in the order of the file, polygons as fans around their
    first corner. Vertices in one place are merged; materials and groups are left out.
    The parts of a GLB, GLTF, 3MF or XAML scene stand where the scene puts them.

    Raises
    ------
    InvalidFileError
        The file cannot be read, is larger than 64 MiB, holds no finite triangles or other numbers of them
        than it claims, or names vertices that are not there. Indices of OBJ that count from the end (-1) are
        not read.
    MissingExtraError
        trimesh, or lxml or networkx for a 3MF or XAML file, is not installed.
    """
    trimesh = optional("trimesh", "mesh")
    path = Path(path)
    content = limited_bytes(path, MAX_MESH_BYTES)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InvalidFileError(path, unreadable_kind(kind))
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


def unreadable_kind(kind: str) -> str:
    """Say which meshes can be read in place of one of another kind."""
    given = f"a mesh of the kind {kind!r}" if kind else "a mesh without a suffix"
    return f"{given} cannot be read; these can: {', '.join(FORMATS)}"


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
