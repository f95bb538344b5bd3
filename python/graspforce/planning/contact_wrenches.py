"""Wrenches of many placements of single contacts, and how far they reach along many directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.vectors import unit
from graspforce.errors import GraspForceError, InvalidGraspError, InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce._internal.taylor_intervals import TaylorIntervals
    from graspforce.typing import Criterion

    from .problem import SearchProblem
    from .scoring import Contacts

    Array = NDArray[np.float64]

__all__ = ["SEEDS", "SWITCH", "ContactWrenches", "default_seeds", "unit_columns"]

_RTOL = 1e-3  # of the qualities whose critical directions are asked for
_CONE_SAMPLES = 16  # forces that stand for a true cone in second differences, as in the core's box bound
_ROUNDED_SUM = 1e-15  # of the terms of a sum of four products


SEEDS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The first tangents of contacts are projections of these by default: of the second one where ..."""
SWITCH = 0.7
"""... ``|n_x|`` is larger than this."""


class ContactWrenches:
    """The wrenches of a search problem's contacts, in the coordinates where its metric is Euclidean."""

    def __init__(self, problem: SearchProblem, params: Array) -> None:
        self._problem = problem
        grasp = problem.source.grasp(params)
        self.dim = grasp.wrench_dim
        self.criterion: Criterion = problem.quality_options["criterion"]
        metric = problem.quality_options["metric"]
        if metric is None:
            forces = grasp.positions.shape[1]
            scale = np.r_[np.ones(forces), np.full(self.dim - forces, 1 / grasp.length_scale)]
            self._map = np.diag(scale)
        else:
            self._map = np.linalg.cholesky(np.asarray(metric, float)).T
        center = problem.quality_options["external_wrench"]
        self.center = None if center is None else self._map @ np.asarray(center, float)
        self.origin = grasp.origin
        counts = np.asarray(grasp.num_edges)
        ends = np.cumsum(counts)
        listed = grasp.extreme_forces if counts.any() else np.zeros((0, grasp.force_dim))
        self._forces = [
            listed[end - count : end] if count else None for count, end in zip(counts, ends, strict=True)
        ]
        limits, margin = np.asarray(grasp.max_normal_force), grasp.friction_margin
        self._cones = [
            (limit, mu / margin, gamma / margin)
            for limit, mu, gamma in zip(
                limits, grasp.friction, np.broadcast_to(grasp.torsion, limits.shape), strict=True
            )
        ]
        self.force_dim = grasp.force_dim

    @property
    def is_spatial(self) -> bool:
        """Whether contacts have frames to choose."""
        return self.dim == 6

    @property
    def num_contacts(self) -> int:
        """Number of contacts of a grasp."""
        return len(self._forces)

    def is_cone(self, contact: int) -> bool:
        """Whether a contact has a true friction cone."""
        return self._forces[contact] is None

    def tangents(self, contacts: NDArray[np.int64]) -> Array | None:
        """Return first tangents (contacts, 3) of the caller; None for the default ones."""
        seed = self._problem.source.options.get("tangents")
        if seed is None or not self.is_spatial:
            return None
        return np.broadcast_to(np.asarray(seed, float), (self.num_contacts, 3))[contacts]

    def force_sets(self, contacts: NDArray[np.int64]) -> list[Array]:
        """Return the forces of contacts as `ProductBound` takes them."""
        return [
            np.array(self._cones[at]) if self._forces[at] is None else self._forces[at]
            for at in contacts.tolist()
        ]

    def columns(self, params: Array, contacts: NDArray[np.int64], seeds: Array | None = None) -> Array:
        """Wrenches of unit forces in the contact frames: (B, contacts, d, k).

        First tangents are `seeds` (contacts, 3), if they are given.
        """
        found = self._problem.source.contacts(params)
        positions, normals = found["positions"][:, contacts], unit(found["normals"][:, contacts])
        seed = found["tangents"][:, contacts] if "tangents" in found else self.tangents(contacts)
        if seeds is not None:
            seed = seeds
        elif seed is None and self.is_spatial:
            seed = default_seeds(normals)
        return self.checked_columns(positions, normals, seed, params, found)

    def checked_columns(
        self,
        positions: Array,
        normals: Array,
        seed: Array | None,
        params: Array,
        found: Contacts | None = None,
    ) -> Array:
        """Return wrenches of unit forces (B, contacts, d, k) of contacts at given parameters (B, p)."""
        columns = unit_columns(positions, normals, seed, self.origin, self.force_dim)
        wrenches: Array = np.einsum("ij,...jk->...ik", self._map, np.stack(columns, axis=-1))
        if not np.isfinite(wrenches).all():
            row = int(np.argwhere(~np.isfinite(wrenches))[0, 0])
            where = params[row].tolist()
            try:
                self._problem.source.grasp_of(found or self._problem.source.contacts(params), row)
            except InvalidGraspError as error:
                raise InvalidGraspError(f"surface, parameters {where}: {error}") from error
            raise InvalidInputError(f"surface, parameters {where}: its wrenches are not finite")
        return wrenches

    def largest_bend(self, columns: list[TaylorIntervals], at: int, contact: int) -> Array:
        """Bound the second derivatives of a contact's wrenches, by those of unit forces (B, contacts, d)."""
        bends = [(column[:, at] @ self._map.T).second for column in columns]
        forces = self._forces[contact]
        if forces is None:
            limit, mu, gamma = self._cones[contact]
            sizes = [np.linalg.norm(np.maximum(abs(low), abs(high)), axis=-1) for low, high in bends]
            square = mu**2 * (sizes[1] ** 2 + sizes[2] ** 2)
            if len(sizes) == 4:
                square = square + gamma**2 * sizes[3] ** 2
            found: Array = limit * (sizes[0] + np.sqrt(square))
        else:
            found = np.zeros(len(bends[0][0]))
            for force in forces:
                low = sum(np.where(f >= 0, f * a, f * b) for f, (a, b) in zip(force, bends, strict=True))
                high = sum(np.where(f >= 0, f * b, f * a) for f, (a, b) in zip(force, bends, strict=True))
                terms = sum(
                    np.maximum(abs(f * a), abs(f * b)) for f, (a, b) in zip(force, bends, strict=True)
                )
                largest = np.maximum(abs(low), abs(high)) + _ROUNDED_SUM * terms
                found = np.maximum(found, np.linalg.norm(largest, axis=-1))
        return np.where(np.isnan(found), np.inf, found)

    def second_differences(self, params: Array, contacts: NDArray[np.int64], axes: int) -> Array:
        """Sum over the axes of the largest second difference of any wrench: (cells, contacts).

        Each cell has the parameters of its centre, then those at -1, -1/2, 1/2 and 1 half-widths along each
        axis: (cells, 1 + 4 axes, p).
        """
        cells = len(params)
        columns = self.columns(params.reshape(-1, params.shape[2]), contacts)
        columns = columns.reshape(cells, -1, *columns.shape[1:])
        total = np.zeros((cells, len(contacts)))
        for axis in range(axes):
            low, left, right, high = (columns[:, 1 + 4 * axis + place] for place in range(4))
            bends = np.stack([low - 2 * left + columns[:, 0], high - 2 * right + columns[:, 0]])
            for at, contact in enumerate(contacts):
                bent = np.linalg.norm(bends[:, :, at] @ self._samples(int(contact)).T, axis=2)
                total[:, at] += bent.max(axis=(0, 2))
        return total

    def _samples(self, contact: int) -> Array:
        forces = self._forces[contact]
        if forces is not None:
            return forces
        limit, mu, gamma = self._cones[contact]
        turn = 2 * np.pi * np.arange(_CONE_SAMPLES) / _CONE_SAMPLES
        ring = np.stack([np.ones_like(turn), mu * np.cos(turn), mu * np.sin(turn)], axis=-1)
        if self.force_dim == 4:
            ring = np.hstack([ring, np.zeros((len(ring), 1))])
            ring = np.vstack([ring, [(1, 0, 0, gamma), (1, 0, 0, -gamma)]])
        samples: Array = limit * ring
        return samples

    def critical_directions(self, params: Array) -> Array:
        """Return unit directions (k, d) along which the grasps at parameters (B, p) are weakest."""
        contacts = self._problem.source.contacts(params)
        options: dict[str, Any] = {**self._problem.quality_options, "rtol": _RTOL}
        found = []
        for row in range(len(params)):
            try:
                quality = self._problem.source.grasp_of(contacts, row).quality(**options)
            except GraspForceError:
                continue
            z = self._map @ quality.direction
            if np.isfinite(z).all() and z.any():
                found.append(z / np.linalg.norm(z))
        return np.array(found).reshape(-1, self.dim)


def default_seeds(normals: Array) -> Array:
    """Return what the first tangents are projections of, for normals (..., 3)."""
    seeds: Array = np.where(np.abs(normals[..., :1]) > SWITCH, SEEDS[1], SEEDS[0])
    return seeds


def unit_columns(positions: Any, normals: Any, seed: Any, origin: Array, force_dim: int) -> list[Any]:
    """Return wrenches (..., d) of unit forces along the axes of contact frames; the torsion's comes last.

    Positions and unit normals (..., dim) are arrays or Taylor intervals. First tangents are projections of
    `seed` (..., 3), which is not used in the plane.
    """
    arms = positions - origin
    if normals.shape[-1] == 2:
        axes = [normals, np.stack([-1.0 * normals[..., 1], normals[..., 0]], axis=-1)]
        torques = [arms[..., 0] * a[..., 1] - arms[..., 1] * a[..., 0] for a in axes]
        return [
            np.concatenate([a, torque[..., None]], axis=-1) for a, torque in zip(axes, torques, strict=True)
        ]
    along = _dot(seed, normals)
    first = unit(seed - normals * along[..., None])
    axes = [normals, first, _cross(normals, first)]
    columns = [np.concatenate([a, _cross(arms, a)], axis=-1) for a in axes]
    if force_dim == 4:
        columns.append(np.concatenate([0.0 * normals, normals], axis=-1))
    return columns


def _dot(a: Any, b: Any) -> Any:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _cross(a: Any, b: Any) -> Any:
    parts = [a[..., i] * b[..., j] - a[..., j] * b[..., i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return np.stack(parts, axis=-1)
