"""Plan files: a planning problem, with a curve or a surface for each contact or a mesh for all of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce import planning
from graspforce._internal.grid import patch_triangles
from graspforce._internal.to_dict import ReadOnly
from graspforce.errors import InvalidGraspError, InvalidInputError
from graspforce.surfaces import (
    ParametricSurface,
    PlanarCurve,
    contacts_on,
    cylinder,
    ellipse,
    ellipsoid,
    line,
    plane,
)

from .mesh_plan_file import MeshPlanFile, mesh_problem, of_file
from .schema import (
    CylinderModel,
    EllipseModel,
    EllipsoidModel,
    LineModel,
    PlanContactModel,
    PlaneModel,
    PlanModel,
    of_each_contact,
)
from .yaml_document import Document, is_grasp, read_document

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from graspforce.planning import Plan
    from graspforce.typing import Criterion

_DRAWN = 200
_CELLS = 24
"""Points of a drawn curve, and cells along each parameter of a drawn surface."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanFile(ReadOnly):
    """A planning problem from a file.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    name : str
        Its title, or the name of the file.
    places : tuple of PlanarCurve or ParametricSurface
        Curve or surface of each contact.
    search : dict
        ``initial``, ``step``, ``tolerance`` and ``bounds`` of `graspforce.plan`.
    grasp_options : dict
        Other options of the contacts, as for `graspforce.Grasp`.
    outline : numpy.ndarray or None
        (n, 2) corners of the object in m: those of the file, or of the ellipse on which all contacts lie.
    """

    path: Path
    name: str
    places: tuple[PlanarCurve | ParametricSurface, ...]
    search: dict[str, Any]
    grasp_options: dict[str, Any]
    outline: NDArray[np.float64] | None = None

    def drawing(self) -> dict[str, Any]:
        """Return the object as `graspforce.plotting.history_figure` draws it: outline, curves and mesh."""
        bounds = np.array(self.search["bounds"], dtype=np.float64)
        if self.places[0].num_params == 1:
            pieces = zip(self.places, bounds.tolist(), strict=True)
            curves = [place.point(np.linspace(low, high, _DRAWN)) for place, (low, high) in pieces]
            return {"outline": self.outline, "curves": curves}
        boxes = bounds.reshape(-1, 2, 2)
        patches = [
            patch_triangles(place.point, box, _CELLS) for place, box in zip(self.places, boxes, strict=True)
        ]
        first = np.cumsum([0, *(len(vertices) for vertices, _ in patches)])
        faces = [triangles + k for (_, triangles), k in zip(patches, first, strict=False)]
        return {"mesh": (np.vstack([vertices for vertices, _ in patches]), np.vstack(faces))}

    def plan(self, criterion: Criterion = "max") -> Plan:
        """Search for the best grasp, as `graspforce.plan` does."""
        surface = contacts_on(*self.places)
        try:
            return planning.plan(surface, criterion=criterion, **self.search, **self.grasp_options)
        except (InvalidInputError, InvalidGraspError) as error:
            raise of_file(self.path, error) from error


def load_problem(path: str | os.PathLike[str]) -> PlanFile | MeshPlanFile:
    """Read a planning problem from a YAML or JSON file.

    Safe to call from several threads.

    Parameters
    ----------
    path : path-like
        ``.json``, or text of any other suffix, as the schemas of ``graspforce info --schema plan`` and, where
        the file names a ``mesh``, ``--schema mesh-plan`` describe.

    Returns
    -------
    PlanFile or MeshPlanFile
        The problem; its ``plan`` solves it.

    Raises
    ------
    InvalidFileError
        The file cannot be read or is not a planning problem; the message names line and field.
    """
    document = read_document(Path(path))
    if is_grasp(document.data):
        raise document.error((), "a grasp file, not a plan file: `graspforce quality` and `forces` read it")
    if isinstance(document.data, dict) and "mesh" in document.data:
        return mesh_problem(document)
    return _place_problem(document, document.parsed(PlanModel))


def _place_problem(document: Document, model: PlanModel) -> PlanFile:
    places: list[PlanarCurve | ParametricSurface] = []
    search: dict[str, list[Any]] = {"initial": [], "step": [], "tolerance": [], "bounds": []}
    for i, contact in enumerate(model.contacts):
        if (contact.curve is None) == (contact.surface is None):
            raise document.error(("contacts", i), "give either `curve` or `surface`")
        place = _place(document, i, contact)
        if places and place.num_params != places[0].num_params:
            message = "curves are planar and surfaces spatial; all contacts lie on one kind"
            raise document.error(("contacts", i), message)
        places.append(place)
        for field, values in _search_of(document, i, contact, place.num_params).items():
            search[field].extend(values)
    return PlanFile(
        document.path,
        model.name or document.path.name,
        tuple(places),
        search,
        {
            "friction": of_each_contact(model, "friction"),
            "max_normal_force": of_each_contact(model, "max_normal_force"),
            "edges": model.edges,
            "length_scale": model.length_scale,
            "friction_margin": model.friction_margin,
            "origin": model.origin,
        },
        _outline(model),
    )


def _outline(model: PlanModel) -> NDArray[np.float64] | None:
    """Return the corners that the file gives, or the disc on whose rim all contacts lie."""
    if model.outline is not None:
        return np.array(model.outline)
    rims = {(rim.semi_x, rim.semi_y, rim.pressed_from) for rim in _ellipses(model)}
    if len(rims) != 1 or len(_ellipses(model)) < len(model.contacts):
        return None
    ((semi_x, semi_y, side),) = rims
    turn = np.linspace(0, 2 * np.pi, _DRAWN, endpoint=False)
    return ellipse(semi_x, semi_y).point(turn) if side == "outside" else None


def _ellipses(model: PlanModel) -> list[EllipseModel]:
    return [contact.curve for contact in model.contacts if isinstance(contact.curve, EllipseModel)]


def _search_of(document: Document, i: int, contact: PlanContactModel, size: int) -> dict[str, list[Any]]:
    """List what one contact adds to each argument of the search."""
    found: dict[str, list[Any]] = {}
    for field in ("initial", "step", "tolerance", "bounds"):
        values = getattr(contact, field)
        if field in ("step", "tolerance") and len(values) == 1:
            values = values * size
        if len(values) != size:
            message = f"{len(values)} given, expected {size}: one for each parameter of the curve or surface"
            raise document.error(("contacts", i, field), message)
        found[field] = values
    for start, (low, high) in zip(found["initial"], found["bounds"], strict=True):
        if low > high:
            raise document.error(("contacts", i, "bounds"), f"{low} is above {high}")
        if not low <= start <= high:
            raise document.error(("contacts", i, "initial"), f"{start} is outside the bounds [{low}, {high}]")
    return found


def _place(document: Document, i: int, contact: PlanContactModel) -> PlanarCurve | ParametricSurface:
    model = contact.curve or contact.surface
    field = "curve" if contact.curve else "surface"
    try:
        match model:
            case EllipseModel():
                return ellipse(model.semi_x, model.semi_y, pressed_from=model.pressed_from)
            case LineModel():
                return line(model.start, model.direction, object_side=model.object_side)
            case PlaneModel():
                return plane(model.start, model.u, model.v, object_side=model.object_side)
            case EllipsoidModel():
                return ellipsoid(model.semi_x, model.semi_y, model.semi_z, pressed_from=model.pressed_from)
            case CylinderModel():
                return cylinder(model.radius, pressed_from=model.pressed_from)
    except InvalidInputError as error:
        raise document.error(("contacts", i, field), str(error)) from None
    raise AssertionError(field)
