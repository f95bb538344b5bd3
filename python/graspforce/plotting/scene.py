"""The mesh of the object and the view of a spatial drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._internal.checks import finite_vector, triangles

from .style import INK, MUTED, OBJECT

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

_LIGHT = np.array([0.3, -0.5, 0.8])


def draw_mesh(axes: Axes3D, vertices: ArrayLike, faces: ArrayLike, *, alpha: float = 1.0) -> Artist:
    """Draw triangles (F, 3) of vertices (V, 3) in m, shaded by their direction.

    For one thread at a time, as all of matplotlib.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from graspforce.plotting import draw_mesh
    >>> axes = Figure().add_subplot(projection="3d")
    >>> skin = draw_mesh(axes, [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> skin in axes.collections
    True
    """
    places, numbers = triangles("mesh", (vertices, faces))
    corners = places[numbers]
    rgba = shaded(corners, OBJECT, alpha)
    skin: Artist = Poly3DCollection(corners, facecolors=rgba, edgecolors="none", zorder=1)
    axes.add_collection3d(skin)
    return skin


def shaded(corners: NDArray[np.float64], color: str, alpha: float) -> NDArray[np.float64]:
    """(F, 4) colours of triangles (F, 3, 3), darker away from the light."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    shade = 0.75 + 0.25 * (normals @ _LIGHT) / (lengths * np.linalg.norm(_LIGHT))
    colours = np.clip(shade[:, None] * np.array(to_rgb(color)), 0, 1)
    return np.column_stack([colours, np.full(len(shade), alpha)])


def frame_view(
    axes: Axes3D, low: ArrayLike, high: ArrayLike, *, elevation: float, azimuth: float, zoom: float = 1.25
) -> None:
    """Show the box from `low` to `high` (3,) in m with equal scales and without axes.

    For one thread at a time, as all of matplotlib.
    """
    low, high = finite_vector("low", low, 3), finite_vector("high", high, 3)
    extent = np.maximum(high - low, 1e-9)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(extent / extent.max()), zoom=zoom)
    axes.view_init(elev=elevation, azim=azimuth)
    axes.set_axis_off()


def equal_box(axes: Axes3D, points: NDArray[np.float64]) -> None:
    """Show a box about points with one scale on all axes, and few ticks."""
    low, high = points.min(axis=0), points.max(axis=0)
    # Points in one plane still need a box.
    half = np.maximum((high - low) / 2, 0.05 * float((high - low).max()) + 1e-12) * 1.05
    middle = (low + high) / 2
    for name, at, reach in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(at - reach, at + reach)
        axis = getattr(axes, f"{name}axis")
        axis.set_pane_color((1, 1, 1, 0))
        axis.line.set_color(MUTED)
        axis.set_ticks(_few_ticks(float(at), float(reach), float(reach / half.max())))
    # Less than the whole, so that the labels of the axes stay inside the figure.
    axes.set_box_aspect(tuple(half), zoom=0.78)
    axes.tick_params(labelsize=7, colors=INK)
    axes.zaxis.set_tick_params(pad=6)
    axes.grid(visible=False)


def _few_ticks(middle: float, reach: float, share: float) -> NDArray[np.float64]:
    locator = MaxNLocator(4 if share > 0.5 else 2)
    ticks = np.asarray(locator.tick_values(middle - reach, middle + reach), dtype=np.float64)
    # Those near the ends would meet the next axis's at the box's corners.
    inside: NDArray[np.float64] = ticks[np.abs(ticks - middle) < 0.85 * reach]
    return inside
