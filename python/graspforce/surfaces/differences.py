"""Directions of curves and surfaces by differences of their points, where no derivative was given.

A direction counts as known where both one-sided differences agree about it. At a cusp, where the derivative
vanishes and turns round, they do not: such a parameter is reported, not guessed at.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["curve_tangents", "surface_normals"]

_STEP = 6e-6  # near the cube root of the machine epsilon, where truncation and rounding balance
_AGREE = 0.5  # cosine of the largest angle between one-sided directions


def curve_tangents(point: Callable[[Array], Array], params: Array) -> Array:
    """Tangents (B, 2) at parameters (B,) by central differences."""
    step = _STEP * np.maximum(1.0, np.abs(params))
    after, before = (np.asarray(point(params + sign * step), dtype=np.float64) for sign in (1, -1))
    here = np.asarray(point(params), dtype=np.float64)
    _refuse_singular(after - here, here - before, params, "tangent")
    return after - before


def surface_normals(point: Callable[[Array], Array], params: Array) -> Array:
    """Return normals r_u x r_v (B, 3) at parameters (B, 2) by central differences, of any length."""
    offsets = _STEP * np.maximum(1.0, np.abs(params))[:, :, None] * np.eye(2)
    here = np.asarray(point(params), dtype=np.float64)
    after_u, after_v = (np.asarray(point(params + offsets[:, axis]), dtype=np.float64) for axis in (0, 1))
    before_u, before_v = (np.asarray(point(params - offsets[:, axis]), dtype=np.float64) for axis in (0, 1))
    forward = np.cross(after_u - here, after_v - here)
    backward = np.cross(here - before_u, here - before_v)
    _refuse_singular(forward, backward, params, "normal")
    return np.cross(after_u - before_u, after_v - before_v)


def _refuse_singular(forward: Array, backward: Array, params: Array, what: str) -> None:
    lengths = np.linalg.norm(forward, axis=-1) * np.linalg.norm(backward, axis=-1)
    agree = (forward * backward).sum(axis=-1)
    # Written so that values that are not finite pass: who checks them can say which point they belong to.
    singular = (agree <= _AGREE * lengths) & np.isfinite(lengths)
    if singular.any():
        where = params[int(np.argmax(singular))].tolist()
        raise InvalidInputError(
            f"surface: singular at parameters {where}: the {what} has no direction there that differences "
            "could "
            f"find; give the function of {what}s, with its limit at such points"
        )
