"""Writes grasp files that every command reads."""

from __future__ import annotations

import filecmp
import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce.errors import InvalidFileError

from .schema import GraspModel
from .yaml_document import MAX_TEXT_BYTES, Document

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from graspforce._core import Grasp

__all__ = ["save_grasp"]

_FIELDS = {
    "positions": "position",
    "normals": "normal",
    "tangents": "tangent",
    "extreme_forces": "extreme_forces",
}


def save_grasp(
    path: str | os.PathLike[str],
    grasp: Grasp,
    *,
    name: str | None = None,
    mesh: str | os.PathLike[str] | None = None,
    mesh_options: Mapping[str, Any] | None = None,
) -> None:
    """Write a grasp as a JSON grasp file, and make its folder.

    Safe to call from several threads for different files.

    Parameters
    ----------
    path : path-like
        File to write. Its suffix should be ``.json``, so that it is read as JSON.
    grasp : Grasp
        Grasp to write; `load_grasp` reads the same one.
    name : str, optional
        Title of tables and pictures; by default the name of the file that is read.
    mesh : path-like, optional
        File of the object's mesh. It is copied into the folder of `path` unless it lies there or below.
    mesh_options : mapping, optional
        Other fields of the mesh in the grasp file, such as ``unit``.

    Raises
    ------
    InvalidFileError
        The grasp is too large for a grasp file, or another file has the name of the copy of the mesh.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import graspforce as gf
    >>> from graspforce.files import load_grasp, save_grasp
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.4)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "pinch.json")
    ...     save_grasp(path, grasp, name="pinch")
    ...     load_grasp(path).grasp.quality().epsilon == grasp.quality().epsilon
    True
    """
    path = Path(path)
    content = {**({} if name is None else {"name": name}), **_fields(grasp)}
    # Before a mesh is copied: what cannot be read again is not written.
    Document(path, content, {}).parsed(GraspModel)
    path.parent.mkdir(parents=True, exist_ok=True)
    if mesh is not None:
        content["mesh"] = {"file": _beside(path, Path(mesh)), **(mesh_options or {})}
    text = json.dumps(content, indent=2) + "\n"
    if len(text) > MAX_TEXT_BYTES:
        raise InvalidFileError(path, f"the grasp takes {len(text)} bytes, more than {MAX_TEXT_BYTES}")
    path.write_text(text, encoding="utf-8")


def _fields(grasp: Grasp) -> dict[str, Any]:
    """Return the fields of a grasp file: what contacts have in common, and the rest contact by contact."""
    given = grasp.to_dict()
    shared = {name: given[name] for name in ("origin", "length_scale", "friction_margin")}
    own = {field: given[name] for name, field in _FIELDS.items() if given[name] is not None}
    numbers = ["friction", "max_normal_force"]
    if any(given["torsion"]):
        numbers.append("torsion")
    if given["edges"] is None:
        shared["edges"] = None
    elif grasp.wrench_dim == 6 and given["extreme_forces"] is None:
        # Planar cones, and forces that are listed, have edges of their own, whatever was asked for.
        numbers.append("edges")
    for name in numbers:
        alike = len(set(given[name])) == 1
        (shared if alike else own)[name] = given[name][0] if alike else given[name]
    contacts = [dict(zip(own, values, strict=True)) for values in zip(*own.values(), strict=True)]
    return {**shared, "contacts": contacts}


def _beside(path: Path, mesh: Path) -> str:
    """Name of a mesh relative to the folder of `path`, where it is or to which it is copied."""
    folder = path.parent.resolve()
    target = mesh.resolve()
    if target.is_relative_to(folder):
        return _spelled(target.relative_to(folder))
    copy = folder / mesh.name
    if copy.is_symlink():
        # A link out of the folder is not followed when the grasp is read; its own mesh can lie beside it.
        copy = folder / f"{path.stem}-{mesh.name}"
    if not copy.exists():
        shutil.copyfile(target, copy)
    elif copy.is_symlink() or not filecmp.cmp(target, copy, shallow=False):
        raise InvalidFileError(copy, f"in the way of a copy of {mesh}; move it, or save the grasp elsewhere")
    return _spelled(copy.relative_to(folder))


def _spelled(mesh: Path) -> str:
    # What begins with letters and a colon could be an address.
    return f"./{mesh.as_posix()}" if ":" in mesh.as_posix() else mesh.as_posix()
