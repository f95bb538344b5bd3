"""Rectangular patches of contact, as their four corners."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.checks import finite_array
from graspforce._internal.vectors import unit
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["patch"]

_CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))
_PARALLEL = 1e-9  # sine of the angle below which two directions are parallel


def patch(
    position: ArrayLike,
    normal: ArrayLike,
    half_x: ArrayLike,
    half_y: ArrayLike,
    *,
    heading: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    max_normal_force: ArrayLike = 1.0,
) -> dict[str, Array]:
    """Return the four corners of rectangular feet or pads, as arguments of `graspforce.Grasp`.

    Forces at the corners exert every wrench that a pressure over the rectangle exerts. So the limits of
    tilting (the centre of pressure stays within the rectangle) and of yaw (the torsion that friction allows)
    follow from friction cones at the corners.

    Safe to call from several threads.

    Parameters
    ----------
    position : array_like
        (3,) centre of the rectangle in m, or (k, 3) the centres of k patches. All other arguments hold for
        every patch, or have a row for each.
    normal : array_like
        (3,) or (k, 3) normal into the body, of any length: upward under a foot.
    half_x, half_y : array_like
        Half of the length along the heading and half of the width across it, in m; not negative. With zero
        the patch is a line or a point, and corners coincide.
    heading : array_like, optional
        (3,) or (k, 3) direction along which `half_x` counts, such as the way a foot points. It is projected
        onto the plane of the patch. By default it is the x axis of the world, or the y axis if the normal is
        within 45 degrees of the x axis.
    friction : array_like
        Coulomb friction coefficient of the patch.
    max_normal_force : array_like
        Largest normal force of a patch in N. Each corner bears a quarter of it, so that the patch bears all
        of it at its centre only, and less near its rim: the pressure is limited.

    Returns
    -------
    dict of str to numpy.ndarray
        ``positions``, ``normals`` and ``tangents`` (4 k, 3), ``friction`` and ``max_normal_force`` (4 k,).
        The corners of a patch are counterclockwise about its normal and begin at ``(half_x, half_y)``. The
        tangents are the headings.

    Raises
    ------
    InvalidInputError
        A shape or a value is unusable, or a heading is parallel to its normal.

    Examples
    --------
    A humanoid of 500 N on two feet of 22 by 10 cm:

    >>> import graspforce as gf
    >>> feet = gf.patch([(0, -0.1, 0), (0, 0.1, 0)], (0, 0, 1), 0.11, 0.05, max_normal_force=2000.0)
    >>> region = gf.support_region(gf.Grasp(**feet, edges=None), weight=500.0)
    >>> region.inner.min(axis=0).round(6).tolist(), region.inner.max(axis=0).round(6).tolist()
    ([-0.11, -0.15], [0.11, 0.15])
    """
    centers = np.atleast_2d(finite_array("position", position))
    if centers.ndim != 2 or centers.shape[1] != 3 or not len(centers):
        raise InvalidInputError(f"position: shape {np.shape(position)}, expected (3,) or (k, 3)")
    number = len(centers)
    n = _directions("normal", normal, number)
    if heading is None:
        along = np.where(np.abs(n[:, :1]) > np.sqrt(0.5), [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    else:
        along = _directions("heading", heading, number)
    x = along - n * (n * along).sum(axis=1, keepdims=True)
    lengths = np.linalg.norm(x, axis=1, keepdims=True)
    if (lengths < _PARALLEL).any():
        at = int(np.argmin(lengths))
        raise InvalidInputError(
            f"heading, row {at}: {along[at].tolist()} is parallel to the normal {n[at].tolist()}"
        )
    x /= lengths
    y = np.cross(n, x)
    halves = [_each("half_x", half_x, number), _each("half_y", half_y, number)]
    limits = _each("max_normal_force", max_normal_force, number)
    if (limits == 0).any():
        raise InvalidInputError(f"max_normal_force, row {int(np.argmin(limits))}: 0.0 must be positive")
    corners = [a * halves[0][:, None] * x + b * halves[1][:, None] * y for a, b in _CORNERS]
    return {
        "positions": np.stack([centers + corner for corner in corners], axis=1).reshape(-1, 3),
        "normals": np.repeat(n, 4, axis=0),
        "tangents": np.repeat(x, 4, axis=0),
        "friction": np.repeat(_each("friction", friction, number), 4),
        "max_normal_force": np.repeat(limits / 4, 4),
    }


def _each(name: str, value: ArrayLike, number: int) -> Array:
    """One number that is not negative for each patch."""
    given = finite_array(name, value)
    if given.shape not in ((), (number,)):
        raise InvalidInputError(f"{name}: shape {given.shape}, expected one number or ({number},)")
    each = np.broadcast_to(given, number)
    if (each < 0).any():
        at = int(np.argmin(each))
        raise InvalidInputError(f"{name}, row {at}: {each[at]} must be at least 0")
    return each


def _directions(name: str, value: ArrayLike, number: int) -> Array:
    """One unit vector for each patch."""
    given = finite_array(name, value)
    if given.shape not in ((3,), (number, 3)):
        raise InvalidInputError(f"{name}: shape {given.shape}, expected (3,) or ({number}, 3)")
    each = np.broadcast_to(given, (number, 3))
    largest = np.abs(each).max(axis=1, keepdims=True)
    if not largest.all():
        raise InvalidInputError(f"{name}, row {int(np.argmin(largest))}: no direction")
    return unit(each / largest)
