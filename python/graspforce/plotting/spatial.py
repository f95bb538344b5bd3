"""Spatial grasps: the mesh, contacts, cones and forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import Locator, MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._core import Grasp
from graspforce.errors import InvalidInputError

from .planar import LONGEST, cone_fans, size_of
from .style import CONE, FORCE, INK, MUTED, OBJECT, OVERLOAD

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

__all__ = ["draw_spatial_grasp", "equal_box"]

_CONE_SHARE = 0.3
_CONE_EDGES = 16


def draw_spatial_grasp(
    axes: Axes3D,
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    metres_per_newton: float | None = None,
) -> list[Artist]:
    """Draw contacts as fingers see them: cones and forces lie outside the object, their tips at the contacts.

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
    if grasp.wrench_dim != 6:
        raise InvalidInputError("grasp: planar; draw_planar_grasp draws it")
    where, limits = grasp.positions, grasp.max_normal_force
    corners = where if mesh is None else np.vstack([where, np.asarray(mesh[0], dtype=float)])
    if metres_per_newton is None:
        metres_per_newton = _CONE_SHARE * size_of(corners) / float(limits.max())
    artists: list[Artist] = []
    if mesh is not None:
        triangles = np.asarray(mesh[0], dtype=float)[np.asarray(mesh[1])]
        skin = Poly3DCollection(triangles, facecolors=OBJECT, edgecolors=OBJECT, lw=0, alpha=0.35)
        artists.append(axes.add_collection3d(skin))
    for point, fan in zip(where, _fans(grasp), strict=True):
        rim = point - metres_per_newton * fan
        sides = [np.stack([point, rim[h - 1], rim[h]]) for h in range(len(rim))]
        cone = Poly3DCollection(sides, facecolors=CONE, edgecolors=FORCE, linewidths=0.2, alpha=0.45)
        artists.append(axes.add_collection3d(cone))
        corners = np.vstack([corners, rim])
    for i, force in enumerate(() if forces is None else _checked(forces, grasp)):
        share = force[0] / limits[i]
        if share <= 1e-9:
            continue
        tail = where[i] - min(1.0, LONGEST / share) * metres_per_newton * force[:3] @ grasp.frames[i]
        colour = OVERLOAD if share > 1 + 1e-9 else FORCE
        artists += axes.plot(*np.stack([tail, where[i]]).T, color=colour, lw=2.0, zorder=10)
        corners = np.vstack([corners, tail])
    artists += axes.plot(*where.T, "o", ms=4, color=INK, zorder=11)
    equal_box(axes, corners)
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"{name} (m)", fontsize=8, color=INK)
    return artists


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
        axis.set_major_locator(_few_ticks(float(reach / half.max())))
    # Less than the whole, so that the labels of the axes stay inside the figure.
    axes.set_box_aspect(tuple(half), zoom=0.78)
    axes.tick_params(labelsize=7, colors=INK)
    axes.grid(visible=False)


def _few_ticks(share: float) -> Locator:
    return MaxNLocator(4 if share > 0.5 else 2)


def _fans(grasp: Grasp) -> list[NDArray[np.float64]]:
    if (grasp.num_edges > 0).all():
        return cone_fans(grasp)
    drawn = Grasp(grasp.positions, grasp.normals, grasp.friction, grasp.max_normal_force, edges=_CONE_EDGES)
    return cone_fans(drawn)


def _checked(forces: ArrayLike, grasp: Grasp) -> NDArray[np.float64]:
    array = np.asarray(forces, dtype=float)
    if array.shape != (grasp.num_contacts, grasp.force_dim):
        expected = (grasp.num_contacts, grasp.force_dim)
        raise InvalidInputError(f"forces: shape {array.shape}, expected {expected}")
    return array
