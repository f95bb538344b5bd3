"""The mesh of the object and the view of a spatial drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.text import Text
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._internal.checks import finite_vector, triangles

from .style import INK, OBJECT
from .views import axes_of

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

_LIGHT = np.array([0.3, -0.5, 0.8])
_FILLED = 0.94
"""Share of the axes that a drawing fills, in its larger direction."""

_FEW = 200
_LEAST_USED = 0.4
"""Room for the arms, where a drawing is narrow."""


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
    _remove_arms(axes)


def fill_view(
    axes: Axes3D,
    points: NDArray[np.float64],
    view: tuple[float, float],
    *,
    names: tuple[str, str, str] = ("x", "y", "z"),
    unit: str = "m",
) -> NDArray[np.float64]:
    """Show points (n, 3) from a view (elevation, azimuth) in degrees, so that they fill the axes.

    Rays are parallel, scales equal. In place of axes there are three arms of one length, which is written.
    Returned are the shares (2,) of the axes' width and height that are used.
    """
    frame = axes_of(*view)
    seen = points @ frame.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, half = (low + high) / 2 @ frame, float((high - low)[:2].max()) / 2 / _FILLED
    half = half if half > 0 else 1.0
    axes.set_proj_type("ortho")
    axes.view_init(*view)
    axes.set_axis_off()
    # How large a box is drawn, and how far off the middle, only matplotlib knows: ask it, then mend both.
    _show_box(axes, middle, half, 1.0)
    center, edge = (_in_axes(axes, point) for point in (middle, middle + half * frame[0]))
    zoom = 0.5 / float((edge - center)[0])
    _show_box(axes, middle + 2 * half * (center - 0.5) @ frame[:2], half, zoom)
    _remove_arms(axes)
    flat = (seen - (low + high) / 2)[:, :2] / (2 * half)
    if len(flat) <= _FEW:
        # Corners alone do not tell where edges and faces are.
        flat = np.concatenate([flat + share * (flat[:, None] - flat) for share in (0.25, 0.5)]).reshape(-1, 2)
    used: NDArray[np.float64] = np.maximum((high - low)[:2] / (2 * half) + 1 - _FILLED, _LEAST_USED)
    at, covered = _free_corner(flat, used)
    if covered and used[1] < 1:
        used[1] = min(1.0, used[1] + 0.3)
        at, _ = _free_corner(flat, used)
    axes.add_artist(Arms(0.5 + at, half, names, unit))
    return used


def _remove_arms(axes: Axes3D) -> None:
    """Remove the arms of a drawing whose axes are shown otherwise now."""
    for artist in [a for a in axes.artists if isinstance(a, Arms)]:
        artist.remove()


def _free_corner(flat: NDArray[np.float64], used: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Return where arms cover the fewest points (n, 2), and how many: shares from the middle of the axes."""
    (left, below), (right, above) = np.array([0.07, 0.12]) - used / 2, used / 2 - [0.15, 0.14]
    corners = np.array([(left, below), (right, below), (left, above), (right, above)])
    away = flat - corners[:, None] - (0.04, 0.01)
    covered = (np.abs(away) < (0.13, 0.15)).all(axis=2).sum(axis=1)
    best = int(np.argmin(covered))
    at: NDArray[np.float64] = corners[best]
    return at, int(covered[best])


def _show_box(axes: Axes3D, middle: NDArray[np.float64], half: float, zoom: float) -> None:
    for name, at in zip("xyz", middle, strict=True):
        getattr(axes, f"set_{name}lim")(at - half, at + half)
    axes.set_box_aspect((1, 1, 1), zoom=zoom)


def _in_axes(axes: Axes3D, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where a point (3,) is drawn, in shares (2,) of the axes."""
    x, y, _ = proj3d.proj_transform(*point, axes.get_proj())
    place: NDArray[np.float64] = axes.transLimits.transform((x, y))
    return place


class Arms(Artist):
    """Three arms along the axes, of one round length, in the corner of a drawing of this half width."""

    def __init__(self, at: NDArray[np.float64], half: float, names: tuple[str, str, str], unit: str) -> None:
        super().__init__()
        self.set_zorder(20)
        self._at, self._names = at, names
        power = 10.0 ** np.floor(np.log10(0.2 * half))
        length = power * max(s for s in (1, 2, 5) if s * power <= 0.2 * half * (1 + 1e-9))
        self._share = length / (2 * half)
        milli = unit == "m" and length < 1
        self._text = f"{1e3 * length:g} mm" if milli else f"{length:g} {unit}"

    def draw(self, renderer: RendererBase) -> None:
        """Draw the arms as the axes are turned now."""
        axes: Any = self.axes
        frame = axes_of(axes.elev, axes.azim)
        # Arms that point left or down begin further right or up.
        at = self._at + self._share * np.maximum(0.0, -frame[:2].min(axis=1))
        labels: list[Any] = []
        arms = zip(self._names, self._share * frame[:2].T, strict=True)
        for name, arm in sorted(arms, key=lambda each: -float(np.hypot(*each[1]))):
            length = float(np.hypot(*arm))
            if length < 0.2 * self._share:
                continue  # It points at the viewer.
            self._show(Line2D(*np.stack([at, at + arm]).T, color=INK, lw=1.0), renderer)
            place = at + arm + 0.025 * arm / length
            if any(np.hypot(*(place - other)) < 0.04 for other in labels):
                place = at + arm + 0.025 * np.array([-arm[1], arm[0]]) / length  # beside a longer arm
            labels.append(place)
            x, y = place
            self._show(Text(x, y, name, fontsize=7, color=INK, ha="center", va="center"), renderer)
        x, y = self._at[0] + 0.3 * self._share, self._at[1] - 0.06
        self._show(Text(x, y, self._text, fontsize=7, color=INK, ha="center", va="center"), renderer)

    def _show(self, artist: Artist, renderer: RendererBase) -> None:
        artist.set_figure(self.axes.figure)  # type: ignore[union-attr] # it has axes when drawn
        artist.set_transform(self.axes.transAxes)  # type: ignore[union-attr]
        artist.draw(renderer)
