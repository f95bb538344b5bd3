"""Meshes from files of any kind that trimesh reads."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def triangles_of(mesh: Any) -> Iterator[Any]:
    """Give a mesh as it is, or read it if it is the path of a file; what is wrong with it names the file."""
    if not isinstance(mesh, str | os.PathLike):
        yield mesh
        return
    path = Path(mesh)
    read = _read(path)
    try:
        yield read
    except InvalidInputError as error:
        raise InvalidInputError(f"{error}, in {path}") from error


def _read(path: Path) -> Any:
    trimesh = optional("trimesh", "mesh")
    if not path.is_file():
        raise InvalidInputError(f"mesh: {path} {'is not a file' if path.exists() else 'does not exist'}")
    known = trimesh.exchange.load.mesh_formats() - {"stl_ascii", "xyz"}
    if (kind := path.suffix.lower().removeprefix(".")) not in known:
        raise InvalidInputError(
            f"mesh: {path}: files of the kind {kind!r} cannot be read; kinds that can are "
            f"{', '.join(sorted(known))}"
        )
    try:
        mesh = trimesh.load_mesh(path, process=True)
        if isinstance(mesh, trimesh.Scene):
            mesh = mesh.to_mesh()
        # Corners that differ only in texture or stored normals are one corner of the surface.
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
    except Exception as error:  # parsers of other packages raise any kind on a broken file
        raise InvalidInputError(f"mesh: {path} cannot be read as a mesh: {error}") from error
    return mesh
