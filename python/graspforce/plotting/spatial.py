"""Spatial grasps: the object, contacts, cones and forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._core import Grasp
from graspforce._internal.checks import instance, triangles
from graspforce.errors import InvalidInputError

from .arrows import Arrow3D
from .planar import cone_fans, force_lines, lengths_per_newton, size_of
from .scene import draw_mesh, fill_view
from .style import CONE, FORCE, INK
from .views import best_view, hidden

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

_CONE_SHARE = 0.36


def draw_spatial_grasp(
    axes: Axes3D,
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    metres_per_newton: float | None = None,
    labels: bool = False,
    color: str = CONE,
    view: tuple[float, float] | None = None,
) -> list[Artist]:
    """Draw contacts with cones and forces, which lie outside the object with their tips at the contacts.

    Contacts behind the object are circles, and their forces are dashed.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.axes3d.Axes3D
        Where to draw, in m. Its view and its limits are set.
    grasp : Grasp
        A spatial grasp; true cones are drawn with 16 edges.
    forces : array_like, optional
        (m, k) contact forces in N, in contact frames; past their limit they are red. Torsion is not drawn.
    mesh : tuple of array_like, optional
        Vertices (v, 3) in m and triangles (t, 3) of the object.
    metres_per_newton : float, optional
        Length at which one newton is drawn; forces are then cut at one and a half limits. By default the
        longest cone is about a third of the object's size, and so is the largest force, on its own scale.
    labels : bool
        True numbers the contacts, from 0 as errors and tables do.
    color : str
        Of the cones.
    view : tuple of float, optional
        Elevation and azimuth in degrees. By default a view from which the object hides as few contacts as
        possible.

    Returns
    -------
    list of matplotlib.artist.Artist
        Mesh, cones, arrows and points.

    Raises
    ------
    InvalidInputError
        The grasp is planar, or an array has the wrong shape.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import graspforce as gf
    >>> from graspforce.plotting import draw_spatial_grasp
    >>> grasp = gf.Grasp([(-1, 0, 0), (1, 0, 0)], [(1, 0, 0), (-1, 0, 0)], edges=8)
    >>> axes = Figure().add_subplot(projection="3d")
    >>> len(draw_spatial_grasp(axes, grasp))
    3
    """
    instance("grasp", grasp, Grasp)
    if grasp.wrench_dim != 6:
        raise InvalidInputError("grasp: planar; draw_planar_grasp draws it")
    artists, shown, _ = draw_contacts(axes, grasp, forces, mesh, metres_per_newton, labels, color, view)
    fill_view(axes, *shown)
    return artists


def draw_contacts(
    axes: Axes3D,
    grasp: Grasp,
    forces: ArrayLike | None,
    mesh: tuple[ArrayLike, ArrayLike] | None,
    metres_per_newton: float | None,
    labels: bool,
    color: str,
    view: tuple[float, float] | None,
    arrows: Sequence[Array] = (),
) -> tuple[list[Artist], tuple[Array, tuple[float, float]], NDArray[np.bool_]]:
    """Draw without framing, so that other `arrows` can be read.

    Return artists, arguments of `fill_view`, and which contacts are behind.
    """
    where = grasp.positions
    skin = None if mesh is None else triangles("mesh", mesh)
    solid = None if skin is None else skin[0][skin[1]]
    shown = [where] if solid is None else [where, solid.reshape(-1, 3)]
    fans = cone_fans(grasp)
    scale = lengths_per_newton(grasp, forces, fans, size_of(np.vstack(shown)), _CONE_SHARE, metres_per_newton)
    pressing = list(force_lines(grasp, forces, scale))
    if view is None:
        longest = max((float(np.linalg.norm(point - tail)) for _, point, tail, _ in pressing), default=0.0)
        long = [np.stack([tail, p]) for _, p, tail, _ in pressing if np.linalg.norm(p - tail) > longest / 3]
        view = best_view(where, grasp.normals, solid, [*arrows, *long])
    behind = hidden(where, grasp.normals, solid, view)
    # What is behind is drawn first.
    axes.computed_zorder = False
    artists: list[Artist] = [] if skin is None else [draw_mesh(axes, *skin, alpha=0.72)]
    for number, (point, fan, covered) in enumerate(zip(where, fans, behind, strict=True)):
        rim = point - scale.cones * fan
        sides = [np.stack([point, rim[h - 1], rim[h]]) for h in range(len(rim))]
        style = {
            "facecolors": color,
            "edgecolors": FORCE,
            "linewidths": 6.0 / max(12, len(rim)),
            "zorder": 0.5 if covered else 3,
        }
        artists.append(axes.add_collection3d(Poly3DCollection(sides, alpha=0.5, **style)))
        tip = point - 1.16 * (point - rim.mean(axis=0))
        if labels:
            artists.append(
                axes.text(*tip, str(number), fontsize=9, color=INK, ha="center", va="center", zorder=12)
            )
        # Points along the sides tell where the cone leaves room.
        shown += [rim, (rim + point) / 2, tip[None]]
    for i, point, tail, colour in pressing:
        line = {"linestyle": (0, (3, 2)) if behind[i] else "-", "color": colour, "lw": 2.0, "zorder": 10}
        artists.append(axes.add_artist(Arrow3D(np.stack([tail, point]), **line)))
        shown.append(tail[None])
    for group, fill in ((~behind, INK), (behind, "none")):
        if group.any():
            artists += axes.plot(*where[group].T, "o", ms=4.5, mfc=fill, mec=INK, mew=0.9, zorder=11)
    return artists, (np.vstack(shown), view), behind
