"""How contact frames spin about their normals between two sets of contacts, beyond the smallest rotation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import unwarned_grasp
from graspforce._internal.vectors import cross

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .scoring import Contacts

    Array = NDArray[np.float64]

__all__ = ["contact_frames", "frame_spins"]


def frame_spins(new: Array, old: Array) -> Array:
    """Return angles (..., m) from old frames (..., m, 3, 3) to new ones."""
    n_new, n_old, o_old = new[..., 0, :], old[..., 0, :], old[..., 1, :]
    # The smallest rotation from n_old to n_new, applied to o_old.
    axis = cross(n_old, n_new)
    cosine = (n_old * n_new).sum(axis=-1, keepdims=True)
    along = (axis * o_old).sum(axis=-1, keepdims=True)
    # Of two opposite normals no rotation is the smallest.
    carried = o_old * cosine + cross(axis, o_old) + axis * along / np.maximum(1 + cosine, 1e-300)
    sine = (cross(carried, new[..., 1, :]) * n_new).sum(axis=-1)
    angles: Array = np.arctan2(sine, (carried * new[..., 1, :]).sum(axis=-1))
    return angles


def contact_frames(contacts: Contacts, tangents: Any) -> Array:
    """Return frames (B, m, 3, 3) of all rows, as one grasp of many contacts: true cones cost least.

    The tangents belong to contacts without their own.
    """
    shape = contacts["positions"].shape
    tangents = contacts.get("tangents", tangents)
    if tangents is not None:
        tangents = np.broadcast_to(np.asarray(tangents, dtype=np.float64), shape).reshape(-1, 3)
    places, normals = (contacts[name].reshape(-1, 3) for name in ("positions", "normals"))
    return unwarned_grasp(places, normals, edges=None, tangents=tangents).frames.reshape(*shape, 3)
