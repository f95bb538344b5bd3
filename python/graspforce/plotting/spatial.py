"""Spatial grasps: the mesh, contacts, cones and forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._core import Grasp
from graspforce._internal.checks import instance, triangles
from graspforce._internal.normal_limits import normal_limits
from graspforce.errors import InvalidInputError

from .planar import cone_fans, force_lines, size_of
from .scene import draw_mesh, equal_box
from .style import CONE, FORCE, INK

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike

_CONE_SHARE = 0.3


def draw_spatial_grasp(
    axes: Axes3D,
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    metres_per_newton: float | None = None,
    labels: bool = False,
    color: str = CONE,
) -> list[Artist]:
    """Draw contacts with cones and forces, which lie outside the object with their tips at the contacts.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.axes3d.Axes3D
        Where to draw, in m.
    grasp : Grasp
        A spatial grasp; true cones are drawn with 16 edges.
    forces : array_like, optional
        (m, k) contact forces in N, in contact frames; past their limit they are red and cut at one and a half
        limits. Torsion is not drawn.
    mesh : tuple of array_like, optional
        Vertices (v, 3) in m and triangles (t, 3) of the object.
    metres_per_newton : float, optional
        Length at which one newton is drawn; by default the longest cone is about a third of the grasp's size.
    labels : bool
        True numbers the contacts, from 0 as errors and tables do.
    color : str
        Of the cones.

    Returns
    -------
    list of matplotlib.artist.Artist
        Mesh, cones, lines and points.

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
    where, limits = grasp.positions, normal_limits(grasp)
    mesh = None if mesh is None else triangles("mesh", mesh)
    corners = where if mesh is None else np.vstack([where, mesh[0]])
    if metres_per_newton is None:
        metres_per_newton = _CONE_SHARE * size_of(corners) / float(limits.max())
    artists: list[Artist] = []
    if mesh is not None:
        artists.append(draw_mesh(axes, *mesh, alpha=0.55))
    for number, (point, fan) in enumerate(zip(where, cone_fans(grasp), strict=True)):
        rim = point - metres_per_newton * fan
        sides = [np.stack([point, rim[h - 1], rim[h]]) for h in range(len(rim))]
        edge = {"edgecolors": FORCE, "linewidths": 0.2, "zorder": 3}
        artists.append(axes.add_collection3d(Poly3DCollection(sides, facecolors=color, alpha=0.45, **edge)))
        if labels:
            outside = point - 1.25 * (point - rim.mean(axis=0))
            artists.append(axes.text(*outside, str(number), fontsize=8, color=INK, ha="center", zorder=12))
        corners = np.vstack([corners, rim])
    for point, tail, colour in force_lines(grasp, forces, limits, metres_per_newton):
        artists += axes.plot(*np.stack([tail, point]).T, color=colour, lw=2.0, zorder=10)
        corners = np.vstack([corners, tail])
    artists += axes.plot(*where.T, "o", ms=4, color=INK, zorder=11)
    equal_box(axes, corners)
    for name in "xyz":
        getattr(axes, f"set_{name}label")(
            f"{name} (m)", fontsize=8, color=INK, labelpad=6 if name != "z" else 10
        )
    return artists
