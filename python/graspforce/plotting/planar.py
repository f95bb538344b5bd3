"""Planar grasps: outline, contacts, cones and forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Polygon

from graspforce._core import Grasp, unwarned_grasp
from graspforce._internal.checks import finite_array, instance
from graspforce._internal.normal_limits import normal_limits
from graspforce.errors import InvalidInputError

from .style import CONE, FORCE, INK, OBJECT, OVERLOAD

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

LONGEST = 1.5
"""Largest length of a drawn force, in limits."""

_CONE_EDGES = 16
_CONE_SHARE = 0.35
_ARROW = {"arrowstyle": "-|>,head_length=0.4,head_width=0.18", "lw": 1.4, "shrinkA": 0, "shrinkB": 0}


def draw_planar_grasp(
    axes: Axes,
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    outline: ArrayLike | None = None,
    metres_per_newton: float | None = None,
) -> list[Artist]:
    """Draw contacts with cones and forces, which lie outside the object with their tips at the contacts.

    The length of a cone is the limit of the normal force. The length of an arrow is the force, on the same
    scale. A force past its limit is red, and is cut at one and a half limits.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw, in m.
    grasp : Grasp
        A planar grasp.
    forces : array_like, optional
        (m, 2) contact forces ``[f_n, f_t]`` in N, in contact frames.
    outline : array_like, optional
        (n, 2) corners of the object in m.
    metres_per_newton : float, optional
        Length at which one newton is drawn; by default the longest cone is about a third of the grasp's size.

    Returns
    -------
    list of matplotlib.artist.Artist
        Outline, cones, arrows and points.

    Raises
    ------
    InvalidInputError
        The grasp is spatial, or an array has the wrong shape.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import graspforce as gf
    >>> from graspforce.plotting import draw_planar_grasp
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], max_normal_force=4.0)
    >>> axes = Figure().subplots()
    >>> len(draw_planar_grasp(axes, grasp, [(1, 0.5), (1, -0.5)]))
    5
    """
    instance("grasp", grasp, Grasp)
    if grasp.wrench_dim != 3:
        raise InvalidInputError("grasp: spatial; draw_spatial_grasp draws it")
    where, limits = grasp.positions, normal_limits(grasp)
    if metres_per_newton is None:
        metres_per_newton = _CONE_SHARE * size_of(where) / float(limits.max())
    artists: list[Artist] = []
    if outline is not None:
        corners = finite_array("outline", outline)
        if corners.ndim != 2 or corners.shape[1] != 2 or not len(corners):
            raise InvalidInputError(f"outline: shape {corners.shape}, expected (n, 2)")
        shape = Polygon(corners, facecolor=OBJECT, edgecolor=INK, lw=0.7, zorder=1)
        artists.append(axes.add_patch(shape))
    for point, fan in zip(where, cone_fans(grasp), strict=True):
        wedge = np.vstack([point, point - metres_per_newton * fan])
        # A frictionless cone has no area; its edge still shows.
        edge = CONE if len(fan) == 1 else "none"
        artists.append(axes.add_patch(Polygon(wedge, facecolor=CONE, edgecolor=edge, zorder=2)))
    for point, tail, color in force_lines(grasp, forces, limits, metres_per_newton):
        arrow: dict[str, Any] = {**_ARROW, "color": color}
        artists.append(axes.annotate("", (*point,), (*tail,), arrowprops=arrow, zorder=3))
        # An annotation does not widen the limits of axes.
        axes.update_datalim([tail])
    artists += axes.plot(*where.T, "o", ms=3.4, color=INK, zorder=4)
    axes.set_aspect("equal")
    return artists


def cone_fans(grasp: Grasp) -> list[NDArray[np.float64]]:
    """Edges (l, dim) of the cone of each contact, side by side, in world axes, in N, without torsion.

    True cones get 16 edges.
    """
    if (grasp.num_edges == 0).any():
        grasp = unwarned_grasp(
            grasp.positions, grasp.normals, grasp.friction, grasp.max_normal_force, edges=_CONE_EDGES,
            friction_margin=grasp.friction_margin,
        )  # fmt: skip
    dim = grasp.positions.shape[1]
    starts = np.cumsum(grasp.num_edges)[:-1]
    extremes = np.split(grasp.extreme_forces[:, :dim], starts)
    return [_side_by_side(forces) @ frame for forces, frame in zip(extremes, grasp.frames, strict=True)]


def _side_by_side(forces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the forces that bound the cone in order: the convex hull of their slopes."""
    pressing = forces[forces[:, 0] > 0]
    slopes = pressing[:, 1:] / pressing[:, :1]
    _, first = np.unique(slopes.round(12), axis=0, return_index=True)
    if slopes.shape[1] == 1 or len(first) < 3:
        return pressing[first]
    # In lexicographic order, along the lower side and back along the upper one.
    hull: list[int] = []
    for order in (first, first[::-1]):
        side: list[int] = []
        for k in order.tolist():
            while len(side) > 1 and _turn(*slopes[[*side[-2:], k]]) <= 1e-12:
                side.pop()
            side.append(k)
        hull += side[:-1]
    return pressing[hull]


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    """Twice the area of a triangle, positive counterclockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def size_of(points: NDArray[np.float64]) -> float:
    """Largest extent of points, or one where they coincide."""
    extent = float(np.ptp(points, axis=0).max())
    return extent if extent > 0 else 1.0


def force_lines(
    grasp: Grasp, forces: ArrayLike | None, limits: NDArray[np.float64], metres_per_newton: float
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64], str]]:
    """Yield contact, tail and colour of each force that presses; those past their limit are red and cut."""
    if forces is None:
        return
    array, expected = finite_array("forces", forces), (grasp.num_contacts, grasp.force_dim)
    if array.shape != expected:
        raise InvalidInputError(f"forces: shape {array.shape}, expected {expected}")
    dim = grasp.positions.shape[1]
    for point, frame, force, share in zip(
        grasp.positions, grasp.frames, array, array[:, 0] / limits, strict=True
    ):
        if share > 1e-9:
            length = min(1.0, LONGEST / share) * metres_per_newton
            yield point, point - length * force[:dim] @ frame, OVERLOAD if share > 1 + 1e-9 else FORCE
