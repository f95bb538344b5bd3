"""The object's mesh as grasp and plan files name it: a surface to put contacts on."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.safe_read import beside
from graspforce.errors import InvalidFileError, InvalidInputError, MissingExtraError
from graspforce.surfaces import MeshSurface
from graspforce.surfaces.mesh_file import few_parts

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from .schema import ContactModel, GraspModel, MeshModel
    from .yaml_document import Document


def mesh_path(document: Document, model: MeshModel) -> Path:
    """Where the mesh is: its name is relative to the file that names it, beside it or below."""
    if document.mesh is not None:
        return document.mesh
    try:
        return beside(document.path, model.file)
    except (ValueError, OSError) as error:
        raise document.error(("mesh", "file"), str(error)) from None


def load_surface(document: Document, model: MeshModel, *, closed: bool = True) -> MeshSurface:
    """Read and check the mesh that a file names; whatever is wrong with it names the file's field.

    Where it need not be `closed`, holes are no fault.
    """
    path = mesh_path(document, model)
    try:
        mesh = few_parts(path)
    except InvalidFileError as error:
        if document.mesh is not None:
            raise
        raise document.error(("mesh", "file"), str(error)) from None
    try:
        return MeshSurface(
            mesh,
            unit=model.unit,
            normals=model.normals,
            max_curvature=model.max_curvature,
            check_watertight=model.check_watertight and closed,
        )
    except InvalidInputError as error:
        argument, _, message = str(error).partition(": ")
        field = argument if argument in ("unit", "max_curvature") else "file"
        message = message.replace(", or pass check_size=False", "").replace(
            "pass check_watertight=False", "set `check_watertight: false` in a file"
        )
        raise document.error(("mesh", field), message) from None


def contact_places(
    document: Document, model: GraspModel
) -> tuple[list[list[float]], list[list[float]], MeshSurface | None, bool]:
    """Positions and normals of all contacts, the surface that gave some, and whether all normals are known.

    Normals that the file gives are checked against its mesh, and known then; without the packages that read
    meshes they are not.
    """
    positions, normals = [], []
    surface = None
    for i, contact in enumerate(model.contacts):
        if contact.position is not None and contact.normal is not None:
            position, normal = contact.position, contact.normal
        elif model.mesh is None:
            message = "no normal, and the file names no `mesh` that would give it"
            raise document.error(("contacts", i), message)
        else:
            surface = surface or load_surface(document, model.mesh)
            position, normal = (row.tolist() for row in _on_mesh(document, i, contact, surface))
        positions.append(position)
        normals.append(normal)
    given = [i for i, contact in enumerate(model.contacts) if contact.normal is not None]
    known = not given or (model.mesh is not None and not model.mesh.check_normals)
    if model.mesh is not None and not known and all(len(row) == 3 for row in (*positions, *normals)):
        known = _checked(document, model.mesh, surface, given, [positions[i] for i in given], normals)
    return positions, normals, surface, known


def _checked(
    document: Document,
    mesh: MeshModel,
    surface: MeshSurface | None,
    given: list[int],
    positions: list[list[float]],
    normals: list[list[float]],
) -> bool:
    """Refuse normals that point out of the mesh; False where no package reads it."""
    keep = "set `check_normals: false` in a file"
    try:
        surface = surface or load_surface(document, mesh, closed=False)
    except MissingExtraError:
        return False
    except InvalidFileError as error:
        error.add_note(f"The mesh is read to check the normals that the file gives; to keep them, {keep}.")
        raise
    try:
        surface.check_normals(positions, [normals[i] for i in given])
    except InvalidInputError as error:
        message = str(error).partition(": ")[2].replace("pass check_normals=False", keep)
        at = re.match(r"normals, contact (\d+)", str(error))
        field = ("contacts", given[int(at[1])], "normal") if at else ("contacts",)
        raise document.error(field, message) from None
    return True


def _on_mesh(
    document: Document, i: int, contact: ContactModel, surface: MeshSurface
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if contact.face is not None:
        try:
            points, normals = surface.on_faces([contact.face], [contact.barycentric or ()])
        except InvalidInputError as error:
            argument, _, message = str(error).partition(": ")
            field = "face" if argument.startswith("faces") else "barycentric"
            raise document.error(("contacts", i, field), message) from None
        return points[0], normals[0]
    field = "point" if contact.point is not None else "position"
    given = np.array(contact.point if contact.point is not None else contact.position)
    if given.shape != (3,):
        raise document.error(("contacts", i, field), f"{len(given)} numbers, where a mesh has 3")
    try:
        points, normals = surface.nearest(given[None])
    except InvalidInputError as error:
        raise document.error(("contacts", i, field), str(error).partition(": ")[2]) from None
    return (points[0] if contact.point is not None else given), normals[0]
