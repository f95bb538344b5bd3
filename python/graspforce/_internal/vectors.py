"""Directions of vectors of any length, and arrays that cannot be written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .taylor_intervals import TaylorIntervals

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a view that cannot be written; the array itself stays as it is."""
    view = array.view()
    view.flags.writeable = False
    return view


def cross(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return cross products (..., 3), without the checks that take most of the time of `numpy.cross`."""
    product: NDArray[np.float64] = (
        first[..., _NEXT] * second[..., _LAST] - first[..., _LAST] * second[..., _NEXT]
    )
    return product


def unit(vectors: ArrayLike) -> NDArray[np.float64]:
    """Vectors of length 1 along the last axis; NaN where there is no direction."""
    if isinstance(vectors, TaylorIntervals):
        return vectors.unit()  # type: ignore[return-value]
    given = np.asarray(vectors, dtype=np.float64)
    # Squares of 1e200 overflow and those of 1e-200 vanish; a power of two scales without rounding.
    _, exponent = np.frexp(np.abs(given).max(axis=-1, keepdims=True))
    with np.errstate(invalid="ignore"):
        scaled = np.ldexp(given, -exponent)
        directions: NDArray[np.float64] = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    return directions
