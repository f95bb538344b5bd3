"""Meshes given as triangles, or as the path of a file."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce.errors import InvalidInputError

from .mesh_file import few_parts

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def triangles_of(mesh: Any) -> Iterator[Any]:
    """Give a mesh as it is, or read it if it is the path of a file; what is wrong with it names the file."""
    if not isinstance(mesh, str | os.PathLike):
        yield mesh
        return
    path = Path(mesh)
    read = few_parts(path)
    try:
        yield read
    except InvalidInputError as error:
        raise InvalidInputError(f"{error}, in {path}") from error
