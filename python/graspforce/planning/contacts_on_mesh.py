"""A planning problem of several contacts anywhere on one mesh, with lengths that fit its size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from graspforce._internal.checks import finite_array, whole_number
from graspforce.errors import InvalidInputError
from graspforce.surfaces import MeshSurface, contacts_on

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce.typing import GraspOptions, Surface


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


def with_lengths(
    surface: Any,
    contacts: int | None,
    bounds: ArrayLike | None,
    step: ArrayLike | None,
    tolerance: ArrayLike | None,
    min_distance: float | None,
    grasp_options: GraspOptions,
) -> tuple[Surface, ArrayLike, ArrayLike, ArrayLike, float, GraspOptions]:
    """Complete the arguments of a search: on a mesh, where `contacts` says how many, all have defaults."""
    if contacts is None:
        for name, value in (("bounds", bounds), ("step", step), ("tolerance", tolerance)):
            if value is None:
                raise InvalidInputError(f"{name}: missing; only a mesh with `contacts` has a default")
        given = (surface, bounds, step, tolerance, min_distance or 0.0, grasp_options)
        return cast("tuple[Surface, ArrayLike, ArrayLike, ArrayLike, float, GraspOptions]", given)
    contacts = whole_number("contacts", contacts, least=1)
    if not isinstance(surface, MeshSurface):
        if callable(surface):
            raise InvalidInputError("contacts: only with a mesh; this surface says itself how many there are")
        surface = MeshSurface(surface)
    lengths = MeshLengths.of(surface, contacts)
    step = lengths.step if step is None else step
    return (
        contacts_on(*[surface] * contacts),
        lengths.bounds if bounds is None else bounds,
        step,
        finite_array("step", step) / 10 if tolerance is None else tolerance,
        lengths.min_distance if min_distance is None else min_distance,
        cast("GraspOptions", {**lengths.grasp_options, **grasp_options}),
    )
