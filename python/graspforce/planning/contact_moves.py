"""Derivatives of contacts by parameters of a surface, from differences that meet no edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.vectors import unit

from .frame_spins import frame_spins

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce.gradients import BundleBatch

    from .scoring import Contacts

    Array = NDArray[np.float64]

__all__ = ["ContactArrays", "ContactMoves"]


@dataclass(frozen=True, slots=True)
class ContactArrays:
    """Positions and unit normals (..., m, dim) of contacts, and frames (..., m, 3, 3) where they matter."""

    positions: Array
    normals: Array
    frames: Array | None

    @classmethod
    def of(cls, contacts: Contacts, frames: Array | None) -> ContactArrays:
        """Return the arrays of contacts (n, m, dim)."""
        return cls(contacts["positions"], unit(contacts["normals"]), frames)

    def rows(self, rows: slice, shape: tuple[int, ...]) -> ContactArrays:
        """Return some of the rows, in this shape."""
        arrays = (self.positions, self.normals, self.frames)
        parts = (None if x is None else x[rows].reshape(*shape, *x.shape[1:]) for x in arrays)
        return ContactArrays(*parts)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class ContactMoves:
    """Derivatives of positions and unit normals (n, p, m, dim), and of the spins (n, p, m) of frames."""

    positions: Array
    normals: Array
    spins: Array | None

    @classmethod
    def of(
        cls, here: ContactArrays, sides: tuple[ContactArrays, ContactArrays], spans: list[Array], jump: float
    ) -> ContactMoves:
        """Return derivatives at places (n, 1, m, ...), from `sides` (n, p, m, ...) at distances (n, p).

        A side where the normal of a contact turns by more than `jump` does not count for it. Where neither
        counts, the normal has no derivative, and neither has the frame.
        """
        lengths = [span[:, :, None] for span in spans]
        turns = [side.normals - here.normals for side in sides]
        places = [side.positions - here.positions for side in sides]
        smooth = [(turn * turn).sum(axis=-1) <= jump**2 for turn in turns]
        edge = smooth[0] * lengths[0] + smooth[1] * lengths[1] == 0

        def derivative(changes: list[Array], counted: list[NDArray[np.bool_]]) -> Array:
            span = counted[0] * lengths[0] + counted[1] * lengths[1]
            first, second = (np.where(ok[..., None], x, 0.0) for ok, x in zip(counted, changes, strict=True))
            return np.asarray((first - second) / np.where(span > 0, span, 1.0)[..., None])

        spins = None
        if here.frames is not None:
            found = [frame_spins(side.frames, here.frames) for side in sides if side.frames is not None]
            steady = [ok & (np.abs(spin) <= jump) for ok, spin in zip(smooth, found, strict=True)]
            spins = derivative([spin[..., None] for spin in found], steady)[..., 0]
        # Both sides of an edge move the contact.
        both = [ok | edge for ok in smooth]
        return cls(derivative(places, both), derivative(turns, smooth), spins)

    def rise(self, bundle: BundleBatch) -> Array:
        """Return the slopes (n, k, p) of supports along critical directions at the n places."""
        rise = np.einsum("npmi,nkmi->nkp", self.positions, bundle.positions)
        rise += np.einsum("npmi,nkmi->nkp", self.normals, bundle.normals)
        if self.spins is not None:
            rise += np.einsum("npm,nkm->nkp", self.spins, bundle.spins)
        return np.asarray(rise)
