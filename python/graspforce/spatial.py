"""Parametric surfaces in space, with normals given or computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from ._differences import surface_normals
from .errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["ParametricSurface"]


@dataclass(frozen=True, slots=True)
class ParametricSurface:
    """A spatial surface with two parameters and a side on which the object is.

    Attributes
    ----------
    point : callable
        Parameters (B, 2) to points (B, 3) in m.
    normal : callable, optional
        Parameters (B, 2) to normals (B, 3) of any length, on either side. By default ``r_u x r_v`` is
        computed from `point` by differences; parameters where it has no direction are reported as singular.
    object_side : {"along", "against"}
        Whether the object lies where those normals point, or on the other side.
    friction, max_normal_force : float, optional
        Of a contact on this surface; see `graspforce.surfaces.contacts_on`.

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
        if self.object_side not in ("along", "against"):
            raise InvalidInputError(f"object_side: {self.object_side!r} is neither 'along' nor 'against'")

    def normals(self, params: Array) -> Array:
        """Return unit normals (B, 3) into the object; not finite where a given normal has no direction."""
        normals = surface_normals(self.point, params) if self.normal is None else self.normal(params)
        with np.errstate(invalid="ignore"):
            unit: Array = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
        return (unit if self.object_side == "along" else -unit) + 0.0

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals (B, 3) at parameters (B, 2)."""
        return np.asarray(self.point(params), dtype=np.float64), self.normals(params)
