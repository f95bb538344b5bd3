"""Triangles of GLB, GLTF, 3MF and XAML files: scenes of meshes, read by trimesh.

Their claims are checked before. A scene can name one mesh many times, promise more numbers than it holds, and
point to other files.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
from functools import cache
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce._internal.safe_read import beside, limited_bytes
from graspforce.errors import InvalidFileError, MissingExtraError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

SCENES = ("3mf", "glb", "gltf", "xaml")
_MAX_BYTES = 256 * 1024 * 1024
_MAX_TRIANGLES = 5_000_000
_MAX_PLACES = 10_000
_MAX_ROWS = 6 * _MAX_TRIANGLES
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def scene_triangles(path: Path, kind: str, content: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices (V, 3) and faces (F, 3) of all meshes of a scene, each where the scene puts it."""
    trimesh = optional("trimesh", "mesh")
    beside_it = _Beside(path)
    try:
        if kind in ("3mf", "xaml"):
            _need_xml()
        if kind == "3mf":
            _check_3mf(path, content)
        elif kind != "xaml":
            _check_gltf(path, _header(content), len(content), beside_it)
        options: dict[str, Any] = {"skip_materials": True} if kind in ("glb", "gltf") else {}
        scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, resolver=beside_it, **options)
        _check_size(path, scene)
        mesh = scene.to_mesh()
        return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except (InvalidFileError, MissingExtraError):
        raise
    except Exception as error:  # noqa: BLE001 - whatever a parser of someone else's makes of a broken file
        raise InvalidFileError(path, f"not a mesh: {error}") from None


def _check_size(path: Path, scene: Any) -> None:
    """Refuse a scene that repeats its meshes without bound."""
    count = sum(len(scene.geometry[scene.graph[node][1]].faces) for node in scene.graph.nodes_geometry)
    if count > _MAX_TRIANGLES:
        raise InvalidFileError(path, f"{count} triangles, more than {_MAX_TRIANGLES}")


class _Beside:
    """Reads the files that a GLTF file names: they lie beside it or below, and are limited together."""

    def __init__(self, path: Path) -> None:
        self._path, self._left = path, _MAX_BYTES
        self.get = cache(self._get)

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)

    def _get(self, name: str) -> bytes:
        try:
            other = beside(self._path, unquote(name))
        except (ValueError, OSError) as error:
            raise InvalidFileError(self._path, str(error)) from None
        content = limited_bytes(other, self._left)
        self._left -= len(content)
        return content


def _header(content: bytes) -> dict[str, Any]:
    if content[:4] == b"glTF":
        if len(content) < 20:
            raise ValueError(f"its header has 20 bytes, the file {len(content)}")
        (length,) = struct.unpack_from("<I", content, 12)
        content = content[20 : 20 + length]
    header = json.loads(content)
    if not isinstance(header, dict):
        raise TypeError("no scene in it")
    return header


def _check_gltf(path: Path, header: dict[str, Any], size: int, beside_it: _Beside) -> None:
    """Refuse a file whose numbers would take more room than its bytes."""
    names = [b["uri"] for b in header.get("buffers", []) if not b.get("uri", "data:").startswith("data:")]
    held = size + sum(len(beside_it.get(name)) for name in names)
    claimed = sum(max(0, int(a["count"])) * _COMPONENTS[a["type"]] for a in header.get("accessors", []))
    if claimed > held:
        raise InvalidFileError(path, f"claims {claimed} numbers, in {held} bytes")
    # Parts may share their numbers; trimesh makes a mesh of each part.
    parts = [part for mesh in header.get("meshes", []) for part in mesh["primitives"]]
    if len(parts) > _MAX_PLACES:
        raise InvalidFileError(path, f"{len(parts)} parts of meshes, more than {_MAX_PLACES}")
    used = [at for part in parts for at in (*part["attributes"].values(), part.get("indices"))]
    rows = sum(int(header["accessors"][at]["count"]) for at in used if at is not None)
    if rows > _MAX_ROWS:
        raise InvalidFileError(path, f"{rows} vertices and indices of all parts, more than {_MAX_ROWS}")


def _need_xml() -> None:
    try:
        optional("lxml.etree", "mesh")
        optional("networkx", "mesh")
    except MissingExtraError as error:
        error.add_note("3MF and XAML files need the packages lxml and networkx.")
        raise


def _check_3mf(path: Path, content: bytes) -> None:
    """Refuse an archive that unpacks without bound, and objects that contain each other many times over."""
    etree = optional("lxml.etree", "mesh")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(member.file_size for member in archive.infolist()) > _MAX_BYTES:
            raise InvalidFileError(path, f"larger than {_MAX_BYTES} bytes when unpacked")
        name = next(n for n in archive.namelist() if "3d/3dmodel.model" in n.lower())
        model = archive.read(name)
    inside: dict[str, list[str]] = {}
    items: list[str] = []
    safe = {"resolve_entities": False, "no_network": True, "huge_tree": False}
    for _, node in etree.iterparse(io.BytesIO(model), tag=("{*}object", "{*}item"), **safe):
        if node.tag.endswith("item"):
            items.append(node.attrib["objectid"])
        else:
            inside[node.attrib["id"]] = [c.attrib["objectid"] for c in node.iter("{*}component")]
            node.clear()
    known: dict[str, int] = {}

    def places(of: str, depth: int) -> int:
        if depth > 100:
            raise InvalidFileError(path, "objects within objects more than 100 deep")
        if of not in known:
            known[of] = 1 + sum(places(part, depth + 1) for part in inside.get(of, []))
        return known[of]

    if (count := sum(places(item, 0) for item in items)) > _MAX_PLACES:
        raise InvalidFileError(path, f"{count} places of objects, more than {_MAX_PLACES}")
