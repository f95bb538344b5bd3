"""Grasp files written: where a plan ended, as every other command reads it."""

from __future__ import annotations

import filecmp
import json
import shutil
from typing import TYPE_CHECKING, Any

from graspforce.errors import InvalidFileError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from graspforce._core import Grasp

__all__ = ["save_grasp"]

_OF_CONTACTS = ("friction", "max_normal_force")


def save_grasp(
    path: Path,
    grasp: Grasp,
    options: Mapping[str, Any],
    *,
    name: str,
    mesh: Path | None = None,
    mesh_options: Mapping[str, Any] | None = None,
) -> None:
    """Write a grasp as a JSON grasp file, making its folder.

    Threads may call this at once for different files.

    Parameters
    ----------
    path : pathlib.Path
        Where to.
    grasp : Grasp
        Whose contacts are written.
    options : mapping
        What the contacts have beside their places, named as arguments of `graspforce.Grasp`; friction and
        limits may be one for each contact.
    name : str
        Title of tables and pictures.
    mesh : pathlib.Path, optional
        File of the object's mesh. One that is not in the folder of `path`, or below it, is copied there,
        where the grasp file is read from.
    mesh_options : mapping, optional
        What else the grasp file says of it.

    Raises
    ------
    InvalidFileError
        Another file of the mesh's name is where it would be copied to.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import graspforce as gf
    >>> from graspforce.files import load_grasp, save_grasp
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.4)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "pinch.json")
    ...     save_grasp(path, grasp, {"friction": 0.4}, name="pinch")
    ...     load_grasp(path).grasp.quality().epsilon == grasp.quality().epsilon
    True
    """
    shared = {name: value for name, value in options.items() if value is not None or name == "edges"}
    own = {name: shared.pop(name) for name in _OF_CONTACTS if isinstance(shared.get(name), list | tuple)}
    contacts = [
        {"position": position, "normal": normal, **{name: values[i] for name, values in own.items()}}
        for i, (position, normal) in enumerate(
            zip(grasp.positions.tolist(), grasp.normals.tolist(), strict=True)
        )
    ]
    content: dict[str, Any] = {"name": name, **shared, "contacts": contacts}
    if mesh is not None:
        content["mesh"] = {"file": _beside(path, mesh).as_posix(), **(mesh_options or {})}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def _beside(path: Path, mesh: Path) -> Path:
    """Name of a mesh relative to the folder of `path`, where it is or to which it is copied."""
    folder, mesh = path.parent.resolve(), mesh.resolve()
    if mesh.is_relative_to(folder):
        return mesh.relative_to(folder)
    copy = folder / mesh.name
    if not copy.exists():
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(mesh, copy)
    elif not filecmp.cmp(mesh, copy, shallow=False):
        raise InvalidFileError(copy, f"in the way of a copy of {mesh}, which the grasp needs beside it")
    return copy.relative_to(folder)
