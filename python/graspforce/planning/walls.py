"""Edges that a step must not take a contact across: the planes of faces beside its own.

At an edge of a mesh the normal turns at once, and epsilon jumps. Where it falls, the best grasp has its
contact on the edge, and no linear piece tells so. The planes of both faces do: the contact stays on its side
of the other one, and slides along the edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.vectors import unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .scoring import Contacts

    Array = NDArray[np.float64]

_TURN = 0.1  # rad: a normal that turns less is beyond no edge that matters
_ROUNDING = 1e-12  # of the positions: on an edge, no plane has a side
_ALONG = 1e-3  # a move that goes less against a plane, relative to its length, leads along it
_CORRECTIONS = 3
_SAME = 1e-6  # normals that differ by less are those of one face


@dataclass(frozen=True, slots=True)
class Walls:
    """Planes, each of one contact: its number and own normal, a point and the normal of the plane."""

    contacts: NDArray[np.int64]
    own: Array
    points: Array
    normals: Array

    @classmethod
    def none(cls, dim: int) -> Walls:
        """Return no planes in so many dimensions."""
        return cls(np.zeros(0, dtype=np.int64), *np.zeros((3, 0, dim)))

    def __len__(self) -> int:
        """Return the number of planes."""
        return len(self.contacts)

    def beside(self, here: Contacts) -> Walls:
        """Return the planes beside the faces that the contacts (1, m, dim) are on."""
        turned = np.abs(unit(here["normals"][0])[self.contacts] - self.own).max(axis=1, initial=0.0)
        return self._rows(turned <= _SAME)

    def with_crossed(self, here: Contacts, flat: NDArray[np.bool_], there: Contacts) -> Walls:
        """Return these planes, and those on which contacts are after steps (n, m, dim) across an edge.

        Only contacts on a `flat` face (m,) have edges.
        """
        own, normals = unit(here["normals"]), unit(there["normals"])
        steps, contacts = np.nonzero(flat & (np.linalg.norm(normals - own, axis=-1) > _TURN))
        if not len(steps):
            return self
        places, beside = there["positions"][steps, contacts], normals[steps, contacts]
        off = places - here["positions"][0, contacts]
        # Both faces of a convex edge lie inside the plane of the other one, those of a concave edge outside.
        inside = np.stack([(off * own[0, contacts]).sum(axis=1), -(off * beside).sum(axis=1)])
        inside = inside[np.abs(inside).argmax(axis=0), np.arange(len(steps))]
        beside *= np.sign(inside)[:, None]
        size = max(float(np.abs(there["positions"]).max()), 1e-300)
        known = np.abs(inside) > _ROUNDING * size
        found = Walls(
            np.concatenate([self.contacts, contacts[known]]),
            np.concatenate([self.own, own[0, contacts[known]]]),
            np.concatenate([self.points, places[known]]),
            np.concatenate([self.normals, beside[known]]),
        )
        # Of the same plane the first counts.
        heights = (found.normals * found.points).sum(axis=1) / size
        keys = np.column_stack(
            [found.contacts, *(np.round(x, 5) for x in (found.own, found.normals, heights))]
        )
        return found._rows(np.sort(np.unique(keys, axis=0, return_index=True)[1]))

    def limits(self, here: Contacts, moves: Array, margin: float) -> tuple[Array, Array]:
        """Return unit slopes (k, p) of the distances from the planes, and how far (k,) steps may go back.

        `moves` (p, m, dim) are derivatives of the positions. Steps keep a margin from the planes, or go
        back to it.
        """
        off = here["positions"][0, self.contacts] - self.points
        height = (off * self.normals).sum(axis=1)
        slopes = np.einsum("pkd,kd->kp", moves[:, self.contacts], self.normals)
        lengths = np.maximum(np.linalg.norm(slopes, axis=1), 1e-300)
        return slopes / lengths[:, None], height / lengths - margin

    def _rows(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Walls:
        return Walls(self.contacts[rows], self.own[rows], self.points[rows], self.normals[rows])


def within(limits: tuple[Array, Array], moves: Array) -> Array:
    """Shorten moves (n, p) that go further against unit slopes than they may, and lead them to the margin."""
    slopes, slacks = limits
    for _ in range(_CORRECTIONS):
        beyond = np.maximum(moves @ -slopes.T - np.maximum(slacks, 0.0), 0.0)
        far = beyond > _ALONG * np.linalg.norm(moves, axis=1, keepdims=True)
        shares = np.where(far, 1.0 - beyond / np.maximum(moves @ -slopes.T, 1e-300), 1.0)
        moves = moves * shares.min(axis=1, keepdims=True, initial=1.0)
        moves = moves + np.maximum(moves @ -slopes.T - slacks, 0.0) @ slopes
    return moves
