"""Parametric surfaces in space, with normals given or computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from graspforce._internal.checks import chosen, finite_vector, real_number, strength
from graspforce._internal.taylor_intervals import formula, is_formula, real_numbers
from graspforce._internal.vectors import unit
from graspforce.errors import InvalidInputError

from .finite_differences import surface_normals

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ParametricSurface:
    """A spatial surface with two parameters and a side on which the object is.

    Threads may share it if its functions are safe to share. With functions of a module it can be pickled.

    Attributes
    ----------
    point : callable
        Parameters (B, 2) to points (B, 3) in m.
    normal : callable, optional
        Parameters (B, 2) to normals (B, 3) of any length, on either side. By default ``r_u x r_v`` is
        computed from `point` by differences. Parameters where it has no direction raise an error.
    object_side : {"along", "against"}
        Side of the object: where those normals point, or the opposite side.
    friction, max_normal_force : float, optional
        Friction coefficient, and limit in N, of a contact on this surface.

    Examples
    --------
    A sphere pressed from outside; its poles, where all meridians meet, are singular.

    >>> import numpy as np
    >>> import graspforce as gf
    >>> from graspforce.surfaces import ParametricSurface
    >>> def point(params):
    ...     u, v = params.T
    ...     return np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)
    >>> sphere = ParametricSurface(point, object_side="along")
    >>> bool(np.allclose(sphere.normals(np.array([[0.0, np.pi / 2]])), [[-1, 0, 0]]))
    True
    >>> sphere.normals(np.array([[0.0, 0.0]]))
    Traceback (most recent call last):
    ...
    graspforce.errors.InvalidInputError: surface: singular at parameters [0.0, 0.0]: the normal has no
    direction there that differences could find; give the function of normals, with its limit at such points
    """

    point: Callable[[Array], Array]
    normal: Callable[[Array], Array] | None = None
    object_side: Literal["along", "against"] = "along"
    friction: float | None = None
    max_normal_force: float | None = None
    num_params: ClassVar[int] = 2

    def __post_init__(self) -> None:
        chosen("object_side", self.object_side, ("along", "against"))
        strength(self.friction, self.max_normal_force)
        for name in ("point", "normal"):
            value = getattr(self, name)
            if not callable(value) and (value is not None or name == "point"):
                raise InvalidInputError(f"{name}: {value!r} is not callable")

    @property
    def has_formulas(self) -> bool:
        """Whether its curvature follows from formulas, as that of the surfaces of this module does."""
        return is_formula(self.point) and is_formula(self.normal)

    def normals(self, params: Array) -> Array:
        """Return unit normals (B, 3) into the object; not finite where a given normal has no direction."""
        normals = surface_normals(self.point, params) if self.normal is None else self.normal(params)
        inward: Array = unit(normals) if self.object_side == "along" else -unit(normals)
        return inward + 0.0

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals (B, 3) at parameters (B, 2)."""
        return real_numbers(self.point(params)), self.normals(params)


def plane(
    start: ArrayLike, u: ArrayLike, v: ArrayLike, *, object_side: Literal["along", "against"]
) -> ParametricSurface:
    """Flat face ``start + p u + q v``, all (3,) in m; the parameters count multiples of `u` and `v`.

    The object lies on the side to which ``u x v`` points, or on the other.

    Threads may share the surface.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.surfaces import plane
    >>> top = plane((0, 0, 0.1), (1, 0, 0), (0, 1, 0), object_side="against")
    >>> points, normals = top.contacts(np.array([[0.02, 0.03]]))
    >>> points.tolist(), normals.tolist()
    ([[0.02, 0.03, 0.1]], [[0.0, 0.0, -1.0]])
    """
    corner = finite_vector("start", start, 3)
    first, second = finite_vector("u", u, 3), finite_vector("v", v, 3)
    across = np.cross(first, second)
    if not np.linalg.norm(across) > 0:
        raise InvalidInputError(f"u and v: {first.tolist()} and {second.tolist()} span no plane")
    return ParametricSurface(
        point=partial(_plane_points, corner, np.stack([first, second])),
        normal=partial(_plane_normals, across),
        object_side=object_side,
    )


def ellipsoid(
    semi_x: float, semi_y: float, semi_z: float, *, pressed_from: Literal["outside", "inside"] = "outside"
) -> ParametricSurface:
    """Ellipsoid about the origin, its semi-axes in m; the parameters are longitude and latitude in rad.

    A finger presses on it from outside (the object is the solid) or from inside (the object surrounds the
    cavity). Normals are exact, at the poles too.

    Threads may share the surface.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.surfaces import ellipsoid
    >>> egg = ellipsoid(0.03, 0.03, 0.05)
    >>> points, normals = egg.contacts(np.array([[0.0, np.pi / 2]]))
    >>> points.round(12).tolist(), (normals.round(12) + 0.0).tolist()
    ([[0.0, 0.0, 0.05]], [[0.0, 0.0, -1.0]])
    """
    chosen("pressed_from", pressed_from, ("outside", "inside"))
    lengths = {"semi_x": semi_x, "semi_y": semi_y, "semi_z": semi_z}
    axes = np.array([real_number(name, value, positive=True) for name, value in lengths.items()])
    return ParametricSurface(
        point=partial(_ellipsoid_points, axes),
        normal=partial(_ellipsoid_points, 1 / axes),
        object_side="against" if pressed_from == "outside" else "along",
    )


def cylinder(radius: float, *, pressed_from: Literal["outside", "inside"] = "outside") -> ParametricSurface:
    """Side of a round cylinder about the z axis; the parameters are the angle in rad and the height in m.

    Threads may share the surface.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.surfaces import cylinder
    >>> points, normals = cylinder(0.04).contacts(np.array([[0.0, 0.02]]))
    >>> points.tolist(), normals.tolist()
    ([[0.04, 0.0, 0.02]], [[-1.0, 0.0, 0.0]])
    """
    chosen("pressed_from", pressed_from, ("outside", "inside"))
    size = real_number("radius", radius, positive=True)
    return ParametricSurface(
        point=partial(_cylinder_points, size),
        normal=_cylinder_normals,
        object_side="against" if pressed_from == "outside" else "along",
    )


# Functions of the module, not of a call, so that surfaces can be copied and pickled.
@formula
def _plane_points(corner: Array, along: Array, params: Array) -> Array:
    points: Array = corner + params @ along
    return points


@formula
def _plane_normals(across: Array, params: Array) -> Array:
    return np.broadcast_to(across, (len(params), 3))


@formula
def _ellipsoid_points(axes: Array, params: Array) -> Array:
    longitude, latitude = params.T
    ring = np.cos(latitude)
    unit: Array = np.stack([ring * np.cos(longitude), ring * np.sin(longitude), np.sin(latitude)], axis=-1)
    return axes * unit


@formula
def _cylinder_points(radius: float, params: Array) -> Array:
    angle, height = params.T
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)


@formula
def _cylinder_normals(params: Array) -> Array:
    angle = params[:, 0]
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
