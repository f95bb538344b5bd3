"""Planar grasps: outline, contacts, cones and forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Polygon

from graspforce._core import Grasp, unwarned_grasp
from graspforce._internal.checks import finite_array, instance
from graspforce._internal.normal_limits import normal_limits
from graspforce.errors import InvalidInputError

from .arrows import HEAD
from .style import CONE, FORCE, INK, OBJECT, OVERLOAD

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

LONGEST = 1.5
"""Largest length of a drawn force, in limits, where forces have the scale of cones."""

FORCE_SHARE = 0.36
"""Length of the largest force in sizes of the object, where forces have a scale of their own."""

_CONE_EDGES = 16
_CONE_SHARE = 0.36
_ARROW = {"arrowstyle": HEAD, "mutation_scale": 15, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}


def draw_planar_grasp(
    axes: Axes,
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    outline: ArrayLike | None = None,
    metres_per_newton: float | None = None,
    labels: bool = False,
) -> list[Artist]:
    """Draw contacts with cones and forces, which lie outside the object with their tips at the contacts.

    The length of a cone is the limit of the normal force. A force past its limit is red.

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
        Length at which one newton is drawn; forces are then cut at one and a half limits. By default the
        longest cone is about a third of the object's size, and so is the largest force, on its own scale.
    labels : bool
        True numbers the contacts, from 0 as errors and tables do.

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
    where, shown = grasp.positions, [grasp.positions]
    artists: list[Artist] = []
    if outline is not None:
        corners = finite_array("outline", outline)
        if corners.ndim != 2 or corners.shape[1] != 2 or not len(corners):
            raise InvalidInputError(f"outline: shape {corners.shape}, expected (n, 2)")
        shown.append(corners)
        artists.append(axes.add_patch(Polygon(corners, facecolor=OBJECT, edgecolor=INK, lw=0.7, zorder=1)))
    fans = cone_fans(grasp)
    scale = lengths_per_newton(grasp, forces, fans, size_of(np.vstack(shown)), _CONE_SHARE, metres_per_newton)
    for number, (point, fan) in enumerate(zip(where, fans, strict=True)):
        wedge = np.vstack([point, point - scale.cones * fan])
        artists.append(
            axes.add_patch(Polygon(wedge, facecolor=CONE, edgecolor=FORCE, lw=0.8, alpha=0.8, zorder=2))
        )
        if labels:
            tip = point + 1.16 * (wedge[1:].mean(axis=0) - point)
            artists.append(
                axes.text(
                    float(tip[0]),
                    float(tip[1]),
                    str(number),
                    fontsize=9,
                    color=INK,
                    ha="center",
                    va="center",
                    zorder=5,
                )
            )
            axes.update_datalim([tip])
    for _, point, tail, color in force_lines(grasp, forces, scale):
        arrow: dict[str, Any] = {**_ARROW, "color": color}
        artists.append(axes.annotate("", (*point,), (*tail,), arrowprops=arrow, zorder=3))
        # An annotation does not widen the limits of axes.
        axes.update_datalim([tail])
    artists += axes.plot(*where.T, "o", ms=4, color=INK, zorder=4)
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


@dataclass(frozen=True, slots=True)
class Scale:
    """Metres at which a newton is drawn, and whether forces are cut at one and a half limits."""

    cones: float
    forces: float
    cut: bool


def lengths_per_newton(
    grasp: Grasp,
    forces: ArrayLike | None,
    fans: Sequence[Array],
    size: float,
    cone_share: float,
    given: float | None,
) -> Scale:
    """Return the scales at which the longest cone and the largest force are shares of an object's size."""
    if given is not None:
        return Scale(given, given, cut=True)
    largest = 0.0 if forces is None else float(np.linalg.norm(_checked(grasp, forces), axis=1).max())
    longest = max(float(np.linalg.norm(fan, axis=1).max()) for fan in fans)
    # Beside forces, cones only show directions.
    cones = cone_share * size / longest * (1.0 if forces is None else 0.7)
    return Scale(cones, FORCE_SHARE * size / largest if largest > 0 else cones, cut=False)


def _checked(grasp: Grasp, forces: ArrayLike) -> Array:
    array, expected = finite_array("forces", forces), (grasp.num_contacts, grasp.force_dim)
    if array.shape != expected:
        raise InvalidInputError(f"forces: shape {array.shape}, expected {expected}")
    return array[:, : grasp.positions.shape[1]]


def force_lines(
    grasp: Grasp, forces: ArrayLike | None, scale: Scale
) -> Iterator[tuple[int, Array, Array, str]]:
    """Yield number, contact, tail and colour of each force that presses; those past their limit are red."""
    if forces is None:
        return
    array = _checked(grasp, forces)
    shares = array[:, 0] / normal_limits(grasp)
    for i, (point, frame, force) in enumerate(zip(grasp.positions, grasp.frames, array, strict=True)):
        if shares[i] > 1e-9:
            length = scale.forces * (min(1.0, LONGEST / shares[i]) if scale.cut else 1.0)
            yield i, point, point - length * force @ frame, OVERLOAD if shares[i] > 1 + 1e-9 else FORCE
