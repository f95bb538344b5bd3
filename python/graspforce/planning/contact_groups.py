"""Groups of contacts with parameters of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce.typing import Surface

__all__ = ["contact_groups"]


def contact_groups(
    surface: Surface, num_contacts: int, num_params: int
) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Return the contacts and the parameters of each group, as the surface's ``depends`` tells.

    Contacts that share a parameter, directly or through others, belong together. Contacts that no parameter
    moves join the first group, and so do parameters that move no contact. Everything is one group if nothing
    is known.
    """
    depends = getattr(surface, "depends", None)
    if not isinstance(depends, np.ndarray) or depends.shape != (num_contacts, num_params):
        return [(np.arange(num_contacts), np.arange(num_params))]
    shared = (depends.T.astype(int) @ depends.astype(int)) > 0
    group = np.arange(num_params)
    for _ in range(num_params):
        group = np.where(shared | np.eye(num_params, dtype=bool), group, num_params).min(axis=1)
    groups: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    idle = np.flatnonzero(~depends.any(axis=0))
    for first in np.unique(group).tolist():
        axes = np.flatnonzero(group == first)
        contacts = np.flatnonzero(depends[:, axes].any(axis=1))
        if len(contacts):
            groups.append((contacts, axes))
    if not groups:
        return [(np.arange(num_contacts), np.arange(num_params))]
    fixed = np.flatnonzero(~depends.any(axis=1))
    contacts, axes = groups[0]
    groups[0] = (np.concatenate([contacts, fixed]), np.sort(np.concatenate([axes, idle])))
    return groups
