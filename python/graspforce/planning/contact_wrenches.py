"""Wrenches of many placements of single contacts, and how far they reach along many directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.vectors import unit
from graspforce.errors import GraspForceError, InvalidGraspError, InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .problem import SearchProblem

    Array = NDArray[np.float64]

__all__ = ["ContactWrenches"]

_ON_ONE_CORE = (
    250_000  # multiplications of one product of matrices: OpenBLAS shares larger ones among threads,
)
# which costs more than it gains
_RTOL = 1e-3  # of the qualities whose critical directions are asked for
_CONE_SAMPLES = 16  # forces that stand for a true cone in second differences, as in the core's box bound


class ContactWrenches:
    """The wrenches of a search problem's contacts, in the coordinates where its metric is Euclidean."""

    def __init__(self, problem: SearchProblem, params: Array) -> None:
        self._problem = problem
        grasp = problem.source.grasp(params)
        self.dim = grasp.wrench_dim
        metric = problem.quality_options["metric"]
        if metric is None:
            forces = grasp.positions.shape[1]
            scale = np.r_[np.ones(forces), np.full(self.dim - forces, 1 / grasp.length_scale)]
            self._map = np.diag(scale)
        else:
            self._map = np.linalg.cholesky(np.asarray(metric, float)).T
        center = problem.quality_options["external_wrench"]
        self.center = None if center is None else self._map @ np.asarray(center, float)
        self._origin = grasp.origin
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
        self._force_dim = grasp.force_dim
        self.longest = 0.0 if self.center is None else float(np.linalg.norm(self.center))

    def _columns(self, params: Array, contacts: NDArray[np.int64]) -> Array:
        """Wrenches of unit forces in the contact frames: (B, contacts, d, k)."""
        found = self._problem.source.contacts(params)
        r = found["positions"][:, contacts] - self._origin
        n = unit(found["normals"][:, contacts])
        if n.shape[-1] == 2:
            axes = [n, np.stack([-n[..., 1], n[..., 0]], axis=-1)]
            torques = [r[..., 0] * a[..., 1] - r[..., 1] * a[..., 0] for a in axes]
            columns = [
                np.concatenate([a, torque[..., None]], axis=-1)
                for a, torque in zip(axes, torques, strict=True)
            ]
        else:
            seed = found.get("tangents", self._problem.source.options.get("tangents"))
            if seed is None:
                along = np.where(np.abs(n[..., :1]) > 0.7, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
            else:
                along = np.broadcast_to(np.asarray(seed, float), found["positions"].shape)[:, contacts]
            o = unit(along - n * (along * n).sum(axis=-1, keepdims=True))
            columns = [np.concatenate([a, np.cross(r, a)], axis=-1) for a in (n, o, np.cross(n, o))]
            if self._force_dim == 4:
                columns.append(np.concatenate([np.zeros_like(n), n], axis=-1))
        wrenches: Array = np.einsum("ij,...jk->...ik", self._map, np.stack(columns, axis=-1))
        if not np.isfinite(wrenches).all():
            row = int(np.argwhere(~np.isfinite(wrenches))[0, 0])
            where = params[row].tolist()
            try:
                self._problem.source.grasp_of(found, row)
            except InvalidGraspError as error:
                raise InvalidGraspError(f"surface, parameters {where}: {error}") from error
            raise InvalidInputError(f"surface, parameters {where}: its wrenches are not finite")
        return wrenches

    def supports(
        self, params: Array, contacts: NDArray[np.int64], directions: Array, *, union: bool
    ) -> NDArray[np.float32]:
        """How far the contacts reach along directions (Z, d) at parameters (B, p): (Z, B), rounded.

        The largest of all contacts for the union; else their sum, without those that reach backward.
        """
        result = np.empty((len(directions), len(params)), np.float32)
        exact = self._columns(params, contacts)
        for at, contact in enumerate(contacts):
            sizes = np.linalg.norm(exact[:, at], axis=1) @ np.abs(self._samples(int(contact))).T
            self.longest = max(self.longest, len(contacts) * float(sizes.max(initial=0)))
        # Contact by contact: (contacts, d, B, k), so that products of matrices need no copies.
        columns = np.ascontiguousarray(np.moveaxis(exact, 0, 2), np.float32)
        along = directions.astype(np.float32)
        step = max(8, _ON_ONE_CORE // max(1, along.size))
        for begin in range(0, len(params), step):
            rows = slice(begin, begin + step)
            total: Any = None
            for at, contact in enumerate(contacts):
                reach = self._reach(int(contact), along, columns[at, :, rows])
                if not union:
                    np.maximum(reach, 0, out=reach)
                if total is None:
                    total = reach
                elif union:
                    np.maximum(total, reach, out=total)
                else:
                    total += reach
            result[:, rows] = total
        return result

    def _reach(
        self, contact: int, along: NDArray[np.float32], columns: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return (Z, B) how far a contact with wrenches (d, B, k) of unit forces reaches along (Z, d)."""
        forces = self._forces[contact]
        if forces is not None:
            wrenches = np.ascontiguousarray(np.moveaxis(columns @ forces.T.astype(np.float32), 2, 0))
            reach: NDArray[np.float32] = along @ wrenches[0]
            other = np.empty_like(reach)
            for edge in wrenches[1:]:
                np.matmul(along, edge, out=other)
                np.maximum(reach, other, out=reach)
            return reach
        limit, mu, gamma = self._cones[contact]
        h = [along @ np.ascontiguousarray(columns[:, :, axis]) for axis in range(columns.shape[2])]
        square = mu**2 * (h[1] ** 2 + h[2] ** 2)
        if self._force_dim == 4:
            square += gamma**2 * h[3] ** 2
        found: NDArray[np.float32] = (limit * (h[0] + np.sqrt(square))).astype(np.float32)
        return found

    def second_differences(self, params: Array, contacts: NDArray[np.int64], axes: int) -> Array:
        """Sum over the axes of the largest second difference of any wrench: (cells, contacts).

        Each cell has the parameters of its centre, then those at -1, -1/2, 1/2 and 1 half-widths along each
        axis: (cells, 1 + 4 axes, p).
        """
        cells = len(params)
        columns = self._columns(params.reshape(-1, params.shape[2]), contacts)
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
        if self._force_dim == 4:
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
