"""Grasp files: YAML and JSON by their schema, NPZ by the names of `graspforce.Grasp`'s arguments."""

from __future__ import annotations

import io
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp, unwarned_grasp
from graspforce._internal.checks import real_number
from graspforce._internal.safe_read import limited_bytes
from graspforce._internal.to_dict import ReadOnly
from graspforce.errors import InvalidFileError, InvalidGraspError, InvalidInputError
from graspforce.surfaces.mesh_checks import metres
from graspforce.surfaces.mesh_file import load_mesh
from graspforce.typing import GRASP_ARGUMENTS

from .contacts_on_mesh import contact_places, mesh_path
from .schema import GraspArgumentsModel, GraspModel, of_each_contact
from .yaml_document import Document, is_plan, read_document

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from graspforce.surfaces import MeshSurface

MAX_ARRAY_BYTES = 256 * 1024 * 1024
"""Limit of NumPy files, before and after decompression."""

_NPY = b"\x93NUMPY"
_ARRAYS = [name for name in GRASP_ARGUMENTS if name != "extreme_forces"]
CONTACT_FIELDS = {
    "positions": "position", "normals": "normal", "tangents": "tangent", "extreme_forces": "extreme_forces",
}  # fmt: skip
"""Fields of a contact, by the arguments of `graspforce.Grasp` that hold them for all contacts."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspFile(ReadOnly):
    """A grasp and its object, from a file.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    name : str
        Its title, or the name of the file.
    grasp : Grasp
        The grasp.
    outline : numpy.ndarray or None
        (n, 2) corners of a planar object in m.
    mesh : pathlib.Path or None
        File of the object's mesh.
    mesh_unit : float
        Unit of its vertices in m.
    surface : MeshSurface or None
        Surface of the mesh, if contacts took their normals from it.
    """

    path: Path
    name: str
    grasp: Grasp
    outline: NDArray[np.float64] | None = None
    mesh: Path | None = None
    mesh_unit: float = 1.0
    surface: MeshSurface | None = None

    def object_mesh(self) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
        """Vertices (V, 3) in m and triangles (F, 3) of the object, read now; None where no mesh is named.

        Raises
        ------
        InvalidFileError, MissingExtraError
            As for `load_mesh`.
        """
        if self.mesh is None:
            return None
        vertices, faces = load_mesh(self.mesh)
        return self.mesh_unit * vertices, faces


def load_grasp(path: str | os.PathLike[str]) -> GraspFile:
    """Read a grasp from a YAML, JSON or NPZ file.

    Safe to call from several threads.

    Parameters
    ----------
    path : path-like
        ``.npz`` holds arrays named as the arguments of `Grasp`. ``.json``, and YAML of any other suffix, is
        described by the schema of ``graspforce info --schema grasp``, or is the dictionary of
        `Grasp.to_dict`.

    Returns
    -------
    GraspFile
        The grasp, its title and its object.

    Raises
    ------
    InvalidFileError
        The file cannot be read or is not a grasp; the message names line and field.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from graspforce.files import load_grasp
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "pinch.yaml")
    ...     _ = path.write_text('''
    ... contacts:
    ...   - {position: [-1, 0], normal: [1, 0]}
    ...   - {position: [1, 0], normal: [-1, 0]}
    ... max_normal_force: 20
    ... ''')
    ...     load_grasp(path).grasp
    Grasp(planar, 2 contacts, 4 extreme forces)
    """
    path = Path(path)
    return _from_npz(path) if path.suffix.lower() == ".npz" else from_document(read_document(path))


def from_document(document: Document) -> GraspFile:
    """Check a document and build the grasp that it describes."""
    if is_plan(document.data):
        raise document.error((), "a plan file, not a grasp file: `graspforce plan` reads it")
    if isinstance(document.data, dict) and "positions" in document.data:
        return _from_arguments(document, document.parsed(GraspArgumentsModel))
    return grasp_of(document, document.parsed(GraspModel))


def _from_arguments(document: Document, model: GraspArgumentsModel) -> GraspFile:
    """Build the grasp whose dictionary the document is."""
    try:
        grasp = Grasp.from_dict(model.model_dump(exclude_unset=True, exclude={"name"}))
    except InvalidGraspError as error:
        raise _located(document, error) from None
    return GraspFile(document.path, model.name or document.path.name, grasp)


def grasp_of(document: Document, model: GraspModel) -> GraspFile:
    """Build the grasp that a checked document describes."""
    positions, normals, surface, known = contact_places(document, model)
    dim = len(positions[0])
    for i, place in enumerate(zip(positions, normals, strict=True)):
        for field, value in zip(("position", "normal"), place, strict=True):
            if len(value) != dim:
                message = f"{len(value)} numbers, where the first contact's position has {dim}"
                raise document.error(("contacts", i, field), message)
    try:
        made = unwarned_grasp if known else Grasp
        grasp: Grasp = made(positions, normals, **_arguments(document, model))
    except InvalidGraspError as error:
        raise _located(document, error) from None
    outline = None if model.outline is None else np.array(model.outline)
    name = model.name or document.path.name
    if model.mesh is None:
        return GraspFile(document.path, name, grasp, outline)
    return GraspFile(
        document.path, name, grasp, outline, mesh_path(document, model.mesh), metres(model.mesh.unit), surface
    )


def _arguments(document: Document, model: GraspModel) -> dict[str, Any]:
    contacts = model.contacts
    edges = [contact.edges if "edges" in contact.model_fields_set else model.edges for contact in contacts]
    if None in edges and any(edges):
        at = next(i for i, contact in enumerate(contacts) if "edges" in contact.model_fields_set)
        message = f"{edges[at] or 'null'} here: all contacts of a grasp have true cones (null), or none"
        raise document.error(("contacts", at, "edges"), message)
    arguments: dict[str, Any] = {
        "friction": of_each_contact(model, "friction"),
        "max_normal_force": of_each_contact(model, "max_normal_force"),
        "edges": edges if any(edges) else None,
        "origin": model.origin,
        "length_scale": model.length_scale,
        "friction_margin": model.friction_margin,
    }
    torsion = of_each_contact(model, "torsion")
    if any(torsion):
        arguments["torsion"] = torsion
    for field, argument in (("tangent", "tangents"), ("extreme_forces", "extreme_forces")):
        given = [getattr(contact, field) for contact in contacts]
        if any(value is not None for value in given):
            if None in given:
                message = f"missing here and given elsewhere: all contacts give {field}, or none"
                raise document.error(("contacts", given.index(None), field), message)
            arguments[argument] = given
    return arguments


def _located(document: Document, error: InvalidGraspError) -> InvalidFileError:
    """Find the line of the argument and contact that an error of `Grasp` names."""
    message = str(error)
    found = re.match(r"(\w+)(?:, contact (\d+))?", message)
    if found is None:
        return document.error((), message)
    if found[2] is None:
        return document.error((found[1],), message.removeprefix(f"{found[1]}: "))
    contact = int(found[2])
    by_arguments = found[1] in document.data
    field = (
        (found[1], contact) if by_arguments else ("contacts", contact, CONTACT_FIELDS.get(found[1], found[1]))
    )
    return document.error(field, message.partition(": ")[2])


def _from_npz(path: Path) -> GraspFile:
    content = io.BytesIO(limited_bytes(path, MAX_ARRAY_BYTES))
    try:
        # What is read of a member is no more than it declares, so the sum bounds the memory.
        with zipfile.ZipFile(content) as archive:
            members = archive.infolist()
            _check_members(path, members)
            given = {
                member.filename.removesuffix(".npy"): _array(path, archive, member) for member in members
            }
    except InvalidFileError:
        raise
    except ValueError as error:
        raise InvalidFileError(path, f"not plain arrays: {error}") from None
    except Exception as error:  # noqa: BLE001 - zipfile and zlib raise a dozen kinds over broken archives
        raise InvalidFileError(path, f"not an NPZ file: {error}") from None
    for name in ("positions", "normals"):
        if name not in given:
            raise InvalidFileError(path, f"{name}: missing")
    numbers: dict[str, Any] = {name: array[()] if array.ndim == 0 else array for name, array in given.items()}
    try:
        if "friction_margin" in numbers:
            # The one argument of Grasp that is no array: what else it is given, only Python would say.
            numbers["friction_margin"] = real_number("friction_margin", numbers["friction_margin"])
        return GraspFile(path, path.name, Grasp(**numbers))
    except (InvalidGraspError, InvalidInputError) as error:
        raise InvalidFileError(path, str(error)) from None


def _array(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    name = member.filename.removesuffix(".npy")
    with archive.open(member) as stream:
        if stream.read(len(_NPY)) != _NPY:
            raise InvalidFileError(path, f"{name}: not an array")
        stream.seek(0)
        array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
        if stream.read(1):
            raise InvalidFileError(path, f"{name}: holds more numbers than its shape {array.shape} claims")
    return array


def _check_members(path: Path, members: list[zipfile.ZipInfo]) -> None:
    if sum(member.file_size for member in members) > MAX_ARRAY_BYTES:
        raise InvalidFileError(path, f"its arrays are larger than {MAX_ARRAY_BYTES} bytes")
    names = [member.filename.removesuffix(".npy") for member in members]
    for name in names:
        if name not in _ARRAYS:
            raise InvalidFileError(path, f"{name}: unknown array; known are {', '.join(_ARRAYS)}")
        if names.count(name) > 1:
            raise InvalidFileError(path, f"{name}: there are {names.count(name)} arrays of this name")
