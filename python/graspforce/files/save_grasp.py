"""Writes grasp files that every command reads."""

from __future__ import annotations

import filecmp
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce._core import Grasp
from graspforce.errors import InvalidFileError, InvalidInputError

from .grasp_file import CONTACT_FIELDS, from_document
from .yaml_document import MAX_TEXT_BYTES, document_of

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping


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
        File to write. Its suffix should be ``.json``, so that it is read as JSON. ``.npz`` is refused.
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
        `load_grasp` would refuse the file, for example because it is too large, or because of the mesh or its
        options; nothing is written then. Also if a file cannot be written, or another file has the name of
        the copy of the mesh.
    InvalidInputError
        `grasp` is not a `Grasp`.

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
    if not isinstance(grasp, Grasp):
        raise InvalidInputError(f"grasp: {grasp!r} is not a graspforce.Grasp")
    path, given = Path(path), None if mesh is None else Path(mesh)
    if path.suffix.lower() == ".npz":
        raise InvalidFileError(path, "grasps are written as JSON; give the file the suffix .json")
    content = {**({} if name is None else {"name": name}), **_fields(grasp)}
    copy = None
    if given is not None:
        copy = _beside(path, given)
        content["mesh"] = {**(mesh_options or {}), "file": _spelled(copy.relative_to(path.parent.resolve()))}
    try:
        text = json.dumps(content, indent=2) + "\n"
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"name or mesh_options: {error}") from None
    if len(text) > MAX_TEXT_BYTES:
        raise InvalidFileError(path, f"the grasp takes {len(text)} bytes, more than {MAX_TEXT_BYTES}")
    # What cannot be read again is not written. No line of a file that is not there is named.
    from_document(replace(document_of(path, text), mesh=given, lines={}))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if given is not None and copy is not None and not copy.exists():
            shutil.copyfile(given.resolve(), copy)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidFileError(Path(error.filename or path), error.strerror or str(error)) from None


def _fields(grasp: Grasp) -> dict[str, Any]:
    """Return the fields of a grasp file: what contacts have in common, and the rest contact by contact."""
    given = grasp.to_dict()
    shared = {name: given[name] for name in ("origin", "length_scale", "friction_margin")}
    own = {field: given[name] for name, field in CONTACT_FIELDS.items() if given[name] is not None}
    numbers = ["friction", "max_normal_force"]
    if any(given["torsion"]):
        numbers.append("torsion")
    if grasp.wrench_dim == 3:
        # Planar cones have no number of edges.
        pass
    elif given["edges"] is None:
        shared["edges"] = None
    elif given["extreme_forces"] is None:
        # Forces that are listed have edges of their own, whatever was asked for.
        numbers.append("edges")
    for name in numbers:
        alike = len(set(given[name])) == 1
        (shared if alike else own)[name] = given[name][0] if alike else given[name]
    contacts = [dict(zip(own, values, strict=True)) for values in zip(*own.values(), strict=True)]
    return {**shared, "contacts": contacts}


def _beside(path: Path, mesh: Path) -> Path:
    """Where a mesh is in the folder of `path` or below, or where its copy in the folder will be."""
    folder = path.parent.resolve()
    target = mesh.resolve()
    if not target.is_file():
        raise InvalidFileError(mesh, "no such mesh, or not a file")
    if target.is_relative_to(folder):
        return target
    copy = folder / mesh.name
    if copy.is_symlink():
        # A link out of the folder is not followed when the grasp is read; its own mesh can lie beside it.
        copy = folder / f"{path.stem}-{mesh.name}"
    if copy.is_symlink() or (copy.exists() and not filecmp.cmp(target, copy, shallow=False)):
        raise InvalidFileError(copy, f"in the way of a copy of {mesh}; move it, or save the grasp elsewhere")
    return copy


def _spelled(mesh: Path) -> str:
    # What begins with letters and a colon could be an address.
    return f"./{mesh.as_posix()}" if ":" in mesh.as_posix() else mesh.as_posix()
