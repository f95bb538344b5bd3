"""Triangles of a piece of a parametric surface, for drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


def patch_triangles(
    point: Callable[[Array], Array], bounds: ArrayLike, cells: int
) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (V, 3) in m and triangles (F, 3) of the surface `point` within bounds (2, 2)."""
    (u_low, u_high), (v_low, v_high) = np.asarray(bounds, dtype=np.float64)
    u, v = np.meshgrid(
        np.linspace(u_low, u_high, cells + 1), np.linspace(v_low, v_high, cells + 1), indexing="ij"
    )
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (
        part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return point(np.column_stack([u.ravel(), v.ravel()])), faces
