"""Planar parametric curves, with normals given or computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from graspforce._internal.checks import chosen, finite_array, real_number, strength
from graspforce._internal.taylor_intervals import formula, is_formula
from graspforce._internal.vectors import unit
from graspforce.errors import InvalidInputError

from .finite_differences import curve_tangents

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlanarCurve:
    """A planar parametric curve with a side on which the object is.

    Threads may share it if its functions are safe to share. With functions of a module it can be pickled.

    Attributes
    ----------
    point : callable
        Parameters (B,) to points (B, 2) in m.
    tangent : callable, optional
        Parameters (B,) to tangents (B, 2) of any length. Where the derivative vanishes, give the limit of
        its direction. By default tangents are computed from `point` by differences. Parameters where the
        tangent has no direction raise an error.
    object_side : {"left", "right"}
        Side of the tangent on which the object lies; normals point there.
    friction, max_normal_force : float, optional
        Friction coefficient, and limit in N, of a contact on this curve.

    Examples
    --------
    A cubic whose derivative (2.04 s^2, 1.6 s) vanishes at s = 0; divided by s it has the limit (0, 1.6).

    >>> import numpy as np
    >>> from graspforce.surfaces import PlanarCurve
    >>> throat = PlanarCurve(
    ...     point=lambda s: np.stack([0.68 * s**3, 0.8 * s**2], axis=-1),
    ...     tangent=lambda s: np.stack([2.04 * s, np.full_like(s, 1.6)], axis=-1),
    ...     object_side="left",
    ... )
    >>> throat.normals(np.array([0.0])).tolist()
    [[-1.0, 0.0]]
    """

    point: Callable[[Array], Array]
    tangent: Callable[[Array], Array] | None = None
    object_side: Literal["left", "right"] = "left"
    friction: float | None = None
    max_normal_force: float | None = None
    num_params: ClassVar[int] = 1

    def __post_init__(self) -> None:
        chosen("object_side", self.object_side, ("left", "right"))
        strength(self.friction, self.max_normal_force)
        for name in ("point", "tangent"):
            value = getattr(self, name)
            if not callable(value) and (value is not None or name == "point"):
                raise InvalidInputError(f"{name}: {value!r} is not callable")

    @property
    def has_formulas(self) -> bool:
        """Whether its curvature follows from formulas, as that of `ellipse` and `line` does."""
        return is_formula(self.point) and is_formula(self.tangent)

    def normals(self, params: Array) -> Array:
        """Return unit normals (B, 2) into the object; not finite where a given tangent has no direction."""
        tangents = curve_tangents(self.point, params) if self.tangent is None else self.tangent(params)
        x, y = np.moveaxis(tangents, -1, 0)
        left = np.stack([-y, x], axis=-1)
        inward: Array = unit(left) if self.object_side == "left" else -unit(left)
        # Adding zero turns -0.0 into 0.0, so that axis-parallel normals print as what they are.
        return inward + 0.0

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals (B, 2) at parameters (B, 1)."""
        return self.point(params[:, 0]), self.normals(params[:, 0])


def ellipse(
    semi_x: float, semi_y: float, *, pressed_from: Literal["outside", "inside"] = "outside"
) -> PlanarCurve:
    """Ellipse about the origin, `semi_x` cos, `semi_y` sin of the parameter in rad.

    A finger presses on it from outside (the object is the disc) or from inside (the object surrounds the
    hole).

    Threads may share the curve.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.surfaces import ellipse
    >>> ellipse(2.0, 1.0).normals(np.array([0.0])).tolist()
    [[-1.0, 0.0]]
    >>> ellipse(2.0, 1.0, pressed_from="inside").normals(np.array([0.0])).tolist()
    [[1.0, 0.0]]
    """
    chosen("pressed_from", pressed_from, ("outside", "inside"))
    semi_x = real_number("semi_x", semi_x, positive=True)
    semi_y = real_number("semi_y", semi_y, positive=True)
    return PlanarCurve(
        point=partial(_ellipse_points, semi_x, semi_y),
        tangent=partial(_ellipse_tangents, semi_x, semi_y),
        object_side="left" if pressed_from == "outside" else "right",
    )


def line(start: ArrayLike, direction: ArrayLike, *, object_side: Literal["left", "right"]) -> PlanarCurve:
    """Straight edge `start + s direction`, both (2,); the parameter counts multiples of the direction.

    Threads may share the curve.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.surfaces import line
    >>> edge = line((-0.5, 0), (0, 1), object_side="right")
    >>> edge.point(np.array([0.2])).tolist(), edge.normals(np.array([0.2])).tolist()
    ([[-0.5, 0.2]], [[1.0, 0.0]])
    """
    origin, along = finite_array("start", start), finite_array("direction", direction)
    if origin.shape != (2,) or along.shape != (2,):
        raise InvalidInputError(
            f"start and direction: shapes {origin.shape} and {along.shape}, expected (2,)"
        )
    if not along.any():
        raise InvalidInputError(f"direction: {along.tolist()} has no direction")
    return PlanarCurve(
        point=partial(_line_points, origin, along),
        tangent=partial(_line_tangents, along),
        object_side=object_side,
    )


# Functions of the module, not of a call, so that curves can be copied and pickled.
@formula
def _ellipse_points(semi_x: float, semi_y: float, s: Array) -> Array:
    return np.stack([semi_x * np.cos(s), semi_y * np.sin(s)], axis=-1)


@formula
def _ellipse_tangents(semi_x: float, semi_y: float, s: Array) -> Array:
    return np.stack([-semi_x * np.sin(s), semi_y * np.cos(s)], axis=-1)


@formula
def _line_points(start: Array, direction: Array, s: Array) -> Array:
    points: Array = start + s[..., None] * direction
    return points


@formula
def _line_tangents(direction: Array, s: Array) -> Array:
    return np.broadcast_to(direction, (*s.shape, 2))
