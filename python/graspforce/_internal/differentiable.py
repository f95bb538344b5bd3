"""Values of many grasps with their derivatives by arrays of any leading dimensions: what torch and JAX call.

A row without an answer does not stop the others: its value is `unsolved`, and its derivatives are zero.
Derivatives by normals are those by the vectors as given, of any length, with the turn of the contact frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._core import quality_many
from graspforce.grasp_forces import forces_many

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["FORCE_GRADIENTS", "QUALITY_GRADIENTS", "ROWS", "Differentiated", "forces", "quality", "row_shape"]

ROWS = ("friction", "max_normal_force", "torsion", "tangents", "origin", "length_scale")
"""Options that may differ from grasp to grasp."""

QUALITY_GRADIENTS = ("positions", "normals", "friction", "max_normal_force")
"""What a quality has derivatives by."""

FORCE_GRADIENTS = ("positions", "normals", "external_wrenches")
"""What least forces and residuals have derivatives by."""


def row_shape(name: str, contacts: int, dim: int) -> tuple[int, ...]:
    """Return the shape of an option for one grasp."""
    shapes = {"tangents": (contacts, 3), "origin": (dim,), "length_scale": ()}
    return shapes.get(name, (contacts,))


@dataclass(frozen=True, slots=True)
class Differentiated:
    """Values, which of them are answers, and the derivatives by each named argument."""

    values: Array
    solved: NDArray[np.bool_]
    derivatives: tuple[Array, ...]


def quality(
    positions: Array, normals: Array, rows: Mapping[str, Array], options: Mapping[str, Any]
) -> Differentiated:
    """Compute epsilon (...,) of positions (..., m, dim), with derivatives by `QUALITY_GRADIENTS`."""
    leading = positions.shape[:-2]
    kept, unsolved = _without_fill(options)
    positions, normals, per_row = _flattened(positions, normals, rows, leading)
    batch = quality_many(positions, normals, **per_row, **kept, gradient=True)
    gradient = batch.gradient
    assert gradient is not None  # noqa: S101 - it was asked for
    solved = np.asarray(batch.status) != 2
    by_normals = _by_given_normals(gradient.normals, gradient.spins, normals, per_row.get("tangents"))
    derivatives = (gradient.positions, by_normals, gradient.friction, gradient.max_normal_force)
    return Differentiated(
        np.where(solved, batch.epsilon, unsolved).reshape(leading),
        solved.reshape(leading),
        tuple(_known(by, solved).reshape(leading + by.shape[1:]) for by in derivatives),
    )


def forces(
    positions: Array,
    normals: Array,
    external_wrenches: Array,
    rows: Mapping[str, Array],
    options: Mapping[str, Any],
    *,
    nearest: bool,
) -> Differentiated:
    """Compute least objectives or, if nearest, residuals (..., K), with derivatives by `FORCE_GRADIENTS`."""
    leading = positions.shape[:-2]
    kept, unsolved = _without_fill(options)
    positions, normals, per_row = _flattened(positions, normals, rows, leading)
    wrenches = external_wrenches.reshape(len(positions), *external_wrenches.shape[-2:])
    answer: Literal["nearest", "status"] = "nearest" if nearest else "status"
    found = forces_many(positions, normals, wrenches, **per_row, **kept, infeasible=answer, gradient=True)
    gradient = found.distance_gradient if nearest else found.gradient
    assert gradient is not None  # noqa: S101 - it was asked for
    solved = np.asarray(found.status) == 0
    values = found.distance if nearest else found.sigma
    tangents = per_row.get("tangents")
    by_normals = _by_given_normals(
        gradient.normals,
        gradient.spins,
        normals[:, None],
        None if tangents is None else np.broadcast_to(tangents, normals.shape)[:, None],
    )
    derivatives = (gradient.positions, by_normals, gradient.external_wrench)
    return Differentiated(
        np.where(solved, values, unsolved).reshape(leading + solved.shape[1:]),
        solved.reshape(leading + solved.shape[1:]),
        tuple(_known(by, solved).reshape(leading + by.shape[1:]) for by in derivatives),
    )


def _without_fill(options: Mapping[str, Any]) -> tuple[dict[str, Any], float]:
    kept = dict(options)
    return kept, float(kept.pop("unsolved"))


def _flattened(
    positions: Array, normals: Array, rows: Mapping[str, Array], leading: tuple[int, ...]
) -> tuple[Array, Array, dict[str, Any]]:
    """Join the leading dimensions; an option without them belongs to all grasps."""
    count = int(np.prod(leading))
    contacts, dim = positions.shape[-2:]
    per_row = {}
    for name, array in rows.items():
        shape = row_shape(name, contacts, dim)
        full = array.ndim == len(leading) + len(shape)
        per_row[name] = array.reshape(count, *shape) if full else array
    shape = (count, contacts, dim)
    return positions.reshape(shape), normals.reshape(shape), per_row


def _by_given_normals(by_turn: Array, spins: Array, normals: Array, tangents: Array | None) -> Array:
    """Return derivatives by normals of any length, in frames that turn as those of `Grasp` do.

    `by_turn` holds for frames that turn by the smallest rotation. A frame made from the axis a by projection,
    with o = p / |p| and p = a - (a . n) n, also spins: by -(a . n) (t . dn) / |p| rad.
    """
    with np.errstate(all="ignore"):  # rows that are no grasps
        size = np.abs(normals).max(-1, keepdims=True, initial=0.0)
        unit = normals / size
        length = np.linalg.norm(unit, axis=-1, keepdims=True)
        unit = unit / length
        if normals.shape[-1] == 3:
            if tangents is None:
                axis = np.where(np.abs(unit[..., :1]) > 0.7, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
            else:
                axis = tangents / np.linalg.norm(tangents, axis=-1, keepdims=True)
            along = (axis * unit).sum(-1, keepdims=True)
            projected = axis - along * unit
            # t / |p| = n x p / |p|^2
            across = np.cross(unit, projected) / (projected * projected).sum(-1, keepdims=True)
            by_turn = by_turn - spins[..., None] * along * across
        by_normals: Array = by_turn / length / size
    return by_normals


def _known(derivative: Array, solved: NDArray[np.bool_]) -> Array:
    """Zero where there is no answer."""
    return np.where(solved.reshape(solved.shape + (1,) * (derivative.ndim - solved.ndim)), derivative, 0.0)
