"""Pictures of spatial grasps: the object, contacts, and friction cones outside of it.

Needs matplotlib (the ``plot`` extra).
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["CONE", "draw_mesh", "draw_spatial_grasp", "frame_view"]

CONE = "#2f79b5"
_OBJECT, _INK = np.array([0.80, 0.78, 0.73]), "#30343b"
_LIGHT = np.array([0.3, -0.5, 0.8])
_SIDES = 24


def draw_mesh(axes: Axes3D, vertices: ArrayLike, faces: ArrayLike, *, alpha: float = 1.0) -> None:
    """Draw triangles (F, 3) of vertices (V, 3) in m, shaded by their direction."""
    triangles = np.asarray(vertices, dtype=float)[np.asarray(faces)]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    shade = 0.65 + 0.35 * (normals @ _LIGHT) / (lengths * np.linalg.norm(_LIGHT))
    colours = np.column_stack([np.clip(shade[:, None] * _OBJECT, 0, 1), np.full(len(shade), alpha)])
    axes.add_collection3d(Poly3DCollection(triangles, facecolors=colours, edgecolors="none", zorder=1))


def draw_spatial_grasp(
    axes: Axes3D,
    positions: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    *,
    length: float,
    labels: bool = True,
    color: str = CONE,
) -> None:
    """Draw contacts as fingers see them: each friction cone outside the object with its tip at the contact.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.Axes3D
        Where to draw, in m.
    positions, normals : array_like
        (m, 3) contacts and unit normals into the object.
    friction : array_like
        (m,) or scalar friction coefficients.
    length : float
        Height of the cones in m.
    labels : bool
        Whether to number the contacts from 1.
    color : str
        Of the cones.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from graspforce.spatial_plotting import draw_spatial_grasp
    >>> axes = Figure().add_subplot(projection="3d")
    >>> draw_spatial_grasp(axes, [(-1, 0, 0), (1, 0, 0)], [(1, 0, 0), (-1, 0, 0)], 0.5, length=0.5)
    >>> len(axes.collections) > 0
    True
    """
    where, inward = np.asarray(positions, dtype=float), np.asarray(normals, dtype=float)
    slopes = np.broadcast_to(np.asarray(friction, dtype=float), len(where))
    angles = np.linspace(0, 2 * np.pi, _SIDES + 1)
    for number, (point, n, slope) in enumerate(zip(where, inward, slopes, strict=True), start=1):
        o = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        o /= np.linalg.norm(o)
        ring = np.cos(angles)[:, None] * o + np.sin(angles)[:, None] * np.cross(n, o)
        rim = point - length * (n + slope * ring)
        sides = [np.array([point, a, b]) for a, b in itertools.pairwise(rim)]
        cone = Poly3DCollection(sides, facecolor=color, edgecolor="none", alpha=0.45, zorder=3)
        axes.add_collection3d(cone)
        axes.plot(*point[:, None], "o", ms=3, color=_INK, zorder=4)
        if labels:
            axes.text(
                *(point - 1.25 * length * n), str(number), fontsize=8, color=_INK, ha="center", zorder=5
            )


def frame_view(
    axes: Axes3D, low: ArrayLike, high: ArrayLike, *, elevation: float, azimuth: float, zoom: float = 1.25
) -> None:
    """Show the box from `low` to `high` (3,) in m with equal scales and without axes."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    extent = np.maximum(high - low, 1e-9)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(extent / extent.max()), zoom=zoom)
    axes.view_init(elev=elevation, azim=azimuth)
    axes.set_axis_off()
