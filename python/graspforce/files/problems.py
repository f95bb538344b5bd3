"""Plan files: a planar planning problem, a curve for each contact."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce import planning
from graspforce.errors import InvalidFileError, InvalidGraspError, InvalidInputError
from graspforce.surfaces import PlanarCurve, contacts_on, ellipse, line

from .document import read_document
from .schema import EllipseModel, LineModel, PlanModel

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from graspforce.planning import Criterion, Plan

__all__ = ["PlanFile", "load_problem"]


@dataclass(frozen=True, slots=True, eq=False)
class PlanFile:
    """A planning problem from a file.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    name : str
        Its title, or the file's name.
    curves : tuple of PlanarCurve
        Where each contact may lie.
    search : dict
        ``initial``, ``step``, ``tolerance`` and ``bounds`` of `graspforce.plan`.
    grasp_options : dict
        What the contacts have beside their places.
    outline : numpy.ndarray or None
        (n, 2) corners of the object in m.
    """

    path: Path
    name: str
    curves: tuple[PlanarCurve, ...]
    search: dict[str, Any]
    grasp_options: dict[str, Any]
    outline: NDArray[np.float64] | None = None

    def plan(self, criterion: Criterion = "max") -> Plan:
        """Search for the best grasp, as `graspforce.plan` does."""
        surface = contacts_on(*self.curves)
        try:
            return planning.plan(surface, criterion=criterion, **self.search, **self.grasp_options)
        except (InvalidInputError, InvalidGraspError) as error:
            raise InvalidFileError(self.path, str(error)) from error


def load_problem(path: str | os.PathLike[str]) -> PlanFile:
    """Read a planning problem from a YAML or JSON file.

    Parameters
    ----------
    path : path-like
        ``.json``, or text of any other suffix, as the schema of ``graspforce info --schema plan`` describes.

    Returns
    -------
    PlanFile
        The problem; its ``plan`` solves it.

    Raises
    ------
    InvalidFileError
        The file cannot be read or is not a planning problem; the message names line and field.
    """
    document = read_document(Path(path))
    model = document.parsed(PlanModel)
    for i, contact in enumerate(model.contacts):
        low, high = contact.bounds
        if low > high:
            raise document.error(("contacts", i, "bounds"), f"{low} is above {high}")
        if not low <= contact.initial <= high:
            message = f"{contact.initial} is outside the bounds [{low}, {high}]"
            raise document.error(("contacts", i, "initial"), message)
    return PlanFile(
        document.path,
        model.name or document.path.name,
        tuple(_curve(contact.curve) for contact in model.contacts),
        {
            field: [getattr(contact, field) for contact in model.contacts]
            for field in ("initial", "step", "tolerance", "bounds")
        },
        {
            "friction": [_own(contact.friction, model.friction) for contact in model.contacts],
            "max_normal_force": [
                _own(contact.max_normal_force, model.max_normal_force) for contact in model.contacts
            ],
            "length_scale": model.length_scale,
            "friction_margin": model.friction_margin,
            "origin": model.origin,
        },
        None if model.outline is None else np.array(model.outline),
    )


def _curve(model: EllipseModel | LineModel) -> PlanarCurve:
    if isinstance(model, EllipseModel):
        return ellipse(model.semi_x, model.semi_y, pressed_from=model.pressed_from)
    return line(model.start, model.direction, object_side=model.object_side)


def _own(value: float | None, shared: float) -> float:
    return shared if value is None else value
