"""A planning problem of several contacts anywhere on one mesh, with lengths that fit its size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import whole_number
from graspforce.errors import InvalidInputError
from graspforce.surfaces import MeshSurface, contacts_on

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce.surfaces.contact_layouts import Arrangement


@dataclass(frozen=True, slots=True)
class MeshLengths:
    """Bounds (3 m, 2) in m, first step, least distance between contacts, and options of the grasp."""

    bounds: NDArray[np.float64]
    step: float
    min_distance: float
    grasp_options: dict[str, Any]

    @classmethod
    def of(cls, mesh: MeshSurface, contacts: int) -> MeshLengths:
        """Return the lengths that fit a mesh."""
        extent = 2 * mesh.length_scale
        options = {"length_scale": mesh.length_scale, "origin": mesh.center.tolist()}
        return cls(np.tile(mesh.bounds, (contacts, 1)), extent / 5, extent / 20, options)


def on_mesh(mesh: Any, contacts: int) -> tuple[Arrangement, MeshLengths]:
    """Put so many contacts on a mesh, or on what `MeshSurface` takes."""
    contacts = whole_number("contacts", contacts, least=1)
    if not isinstance(mesh, MeshSurface):
        if callable(mesh):
            raise InvalidInputError("contacts: only with a mesh; this surface says itself how many there are")
        mesh = MeshSurface(mesh)
    return contacts_on(*[mesh] * contacts), MeshLengths.of(mesh, contacts)
