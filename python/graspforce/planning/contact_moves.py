"""Derivatives of contacts by parameters of a surface, from differences that meet no edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.vectors import unit

from .frame_spins import frame_spins

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from graspforce.gradients import BundleBatch

    from .scoring import Contacts

    Array = NDArray[np.float64]

__all__ = ["ContactMoves"]


@dataclass(frozen=True, slots=True)
class ContactMoves:
    """Derivatives of positions and unit normals (n, p, m, dim), and of the spins (n, p, m) of frames."""

    positions: Array
    normals: Array
    spins: Array | None

    @classmethod
    def of(
        cls,
        here: Contacts,
        sides: tuple[Contacts, Contacts],
        spans: tuple[Array, Array],
        jump: float,
        frames: Callable[[Contacts], Array] | None,
    ) -> ContactMoves:
        """Return derivatives at n places, from both `sides` (n p, m, dim) at distances (n, p) of the parameters.

        A side where the normal of a contact turns by more than `jump` does not count for it. Where neither
        counts, the normal has no derivative, and neither has the frame. `frames` tells whether spins are wanted.
        """
        shape = (*spans[0].shape, *here["positions"].shape[1:])
        lengths = [span[:, :, None] for span in spans]
        normal = unit(here["normals"])[:, None]
        turns = [unit(side["normals"]).reshape(shape) - normal for side in sides]
        places = [side["positions"].reshape(shape) - here["positions"][:, None] for side in sides]
        smooth = [np.linalg.norm(turn, axis=-1) <= jump for turn in turns]
        edge = smooth[0] * lengths[0] + smooth[1] * lengths[1] == 0

        def derivative(changes: list[Array], counted: list[NDArray[np.bool_]]) -> Array:
            span = counted[0] * lengths[0] + counted[1] * lengths[1]
            first, second = (np.where(ok[..., None], x, 0.0) for ok, x in zip(counted, changes, strict=True))
            return np.asarray((first - second) / np.where(span > 0, span, 1.0)[..., None])

        spins = None
        if frames is not None:
            from_frames = np.repeat(frames(here), shape[1], axis=0)
            found = [frame_spins(frames(side), from_frames).reshape(shape[:3]) for side in sides]
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
