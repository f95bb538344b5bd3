"""Directions of curves and surfaces by differences of their points, where no derivative was given.

Central and both one-sided differences are computed at two step sizes. A direction is accepted if all agree
within 2.5 degrees. They disagree at a cusp or a kink, and where the points turn faster than the steps. Such a
parameter raises an error. At the end of a function's domain one side suffices.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.vectors import unit
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_STEP = 6e-6  # near the cube root of the machine epsilon, where truncation and rounding balance
_SECOND = 0.382  # the other step as a share of it: no simple ratio, which a periodic curve could hide behind
_AGREE = 0.999  # cosine of the largest angle between two directions that are the same


def curve_tangents(point: Callable[[Array], Array], params: Array) -> Array:
    """Tangents (B, 2) at parameters (B,), of any length."""
    return _directions(lambda at: point(at[:, 0]), params[:, None], lambda slopes: slopes[0], "tangent")


def surface_normals(point: Callable[[Array], Array], params: Array) -> Array:
    """Return normals r_u x r_v (B, 3) at parameters (B, 2), of any length."""
    return _directions(point, params, lambda slopes: np.cross(slopes[0], slopes[1]), "normal")


def _directions(
    point: Callable[[Array], Array],
    params: Array,
    combine: Callable[[Sequence[Array]], Array],
    what: str,
) -> Array:
    here = np.asarray(point(params), dtype=np.float64)
    # What rounding leaves of a parameter grows with it: the balance moves with its cube root.
    steps = _STEP * np.cbrt(np.maximum(1.0, np.abs(params)))
    found = []
    for share in (1.0, _SECOND):
        slopes = [_slopes(point, params, here, share * steps, axis) for axis in range(params.shape[1])]
        found += [combine(kind) for kind in zip(*slopes, strict=True)]
    ways = unit(found)
    agree = ((ways[0] * ways[1:]).sum(axis=-1) >= _AGREE).all(axis=0)
    # Points that are not finite pass here: a later check names the contact that they belong to.
    singular = ~agree & np.isfinite(here).all(axis=-1)
    if singular.any():
        at = params[int(np.argmax(singular))]
        where = at.tolist() if len(at) > 1 else float(at[0])
        raise InvalidInputError(
            f"surface: singular at parameters {where}: the {what} has no direction there that differences "
            f"could find; give the function of {what}s, with its limit at such points"
        )
    return found[0]


def _slopes(
    point: Callable[[Array], Array], params: Array, here: Array, steps: Array, axis: int
) -> tuple[Array, Array, Array]:
    """Central, forward and backward differences along one parameter; one for all where the others miss."""
    move = np.zeros_like(params)
    move[:, axis] = steps[:, axis]
    # A function may end at its bounds; NaN beyond them is an answer.
    with np.errstate(all="ignore"):
        after, before = (np.asarray(point(params + sign * move), dtype=np.float64) for sign in (1, -1))
        forward, backward = after - here, here - before
    has_after, has_before = (np.isfinite(side).all(axis=-1, keepdims=True) for side in (after, before))
    forward, backward = (
        np.where(has_after, forward, backward),
        np.where(has_before, backward, forward),
    )
    return forward + backward, forward, backward
