"""Wrench sets of planar grasps: the union's hull inside the Minkowski sum's (Fig. 1b of the paper)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

from .scene import fill_view
from .style import MINKOWSKI, MUTED, OVERLOAD, UNION
from .views import DEFAULT_VIEW, axes_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import NDArray

    from graspforce._core import Grasp


def draw_wrench_polytopes(
    axes: Axes3D, grasp: Grasp, *, ball: Literal["max", "sum"] | None = "max"
) -> list[Artist]:
    """Draw both wrench polytopes of a planar grasp, and the ball that touches the nearest facet of one.

    The hull of the union of the contacts' wrenches (orange) is what the sum of normalised normal forces
    limits; the hull of their Minkowski sum (blue) is what the maximum limits. The radius of the largest ball
    about the origin inside a polytope is its epsilon.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.axes3d.Axes3D
        Where to draw: forces in N, torque divided by the grasp's length scale in N.
    grasp : Grasp
        A planar grasp of few contacts: the Minkowski sum of m contacts has ``3^m - 1`` points.
    ball : {"max", "sum"}, optional
        Whose ball to draw, where the grasp is force closure; None draws none.

    Returns
    -------
    list of matplotlib.artist.Artist
        Both polytopes, the ball and the point where it touches.

    Raises
    ------
    InvalidInputError
        The grasp is spatial, or one of its polytopes is flat.
    MissingExtraError
        SciPy, which finds the facets, is not installed.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import graspforce as gf
    >>> from graspforce.plotting import draw_wrench_polytopes
    >>> grasp = gf.Grasp([(-1, 0), (1, 0), (0, 1)], [(1, 0), (-1, 0), (0, -1)], friction=0.4)
    >>> axes = Figure().add_subplot(projection="3d")
    >>> len(draw_wrench_polytopes(axes, grasp))
    4
    """
    if grasp.wrench_dim != 3:
        raise InvalidInputError("grasp: spatial; its wrenches have six components")
    to_norm = np.array([1, 1, 1 / grasp.length_scale])
    union, minkowski = grasp.primitive_wrenches * to_norm, grasp.minkowski_sum().wrenches * to_norm
    artists: list[Artist] = []
    touch = None
    axes.computed_zorder = False
    for points, colour, face, width, name in (
        (union, UNION, 0.16, 1.3, "hull of the union (sum)"),
        (minkowski, MINKOWSKI, 0.05, 0.9, "hull of the Minkowski sum (max)"),
    ):
        # Faces are nearly clear, so that one sees inside; edges are not.
        polytope = Poly3DCollection(
            _facets(points),
            facecolors=(*to_rgb(colour), face),
            edgecolors=(*to_rgb(colour), 0.8),
            linewidths=width,
            label=name,
        )
        artists.append(axes.add_collection3d(polytope))
    quality = None if ball is None else grasp.quality(ball)
    if quality is not None and quality.closure == "force":
        artists.append(
            axes.plot_surface(
                *_sphere(quality.epsilon),
                color=MUTED,
                alpha=0.35,
                linewidth=0,
                label=f"largest ball ({ball})",
            )
        )
        touch = quality.wrench * to_norm
        artists += axes.plot(
            *touch[:, None],
            "o",
            ms=6,
            color=OVERLOAD,
            zorder=10,
            label="weakest wrench, where the ball touches",
        )
    elevation, azimuth = DEFAULT_VIEW
    if touch is not None and axes_of(*DEFAULT_VIEW)[2] @ touch < 0:
        azimuth += 180.0  # the point where the ball touches is in front
    fill_view(axes, minkowski, (elevation, azimuth), names=("$f_x$", "$f_y$", r"$\tau / L$"), unit="N")
    return artists


def _facets(points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Facets of a hull as polygons, triangles of one plane joined."""
    spatial = optional("scipy.spatial", "plot")
    try:
        hull = spatial.ConvexHull(points)
    except spatial.QhullError:
        raise InvalidInputError("grasp: its wrench polytope is flat, some wrench cannot be exerted") from None
    planes = np.round(hull.equations / [1, 1, 1, np.abs(points).max()], 7)
    polygons = []
    for plane in np.unique(planes, axis=0):
        corners = points[np.unique(hull.simplices[(planes == plane).all(axis=1)])]
        normal, spokes = plane[:3], corners - corners.mean(axis=0)
        first = spokes[0] / np.linalg.norm(spokes[0])
        angles = np.arctan2(spokes @ np.cross(normal, first), spokes @ first)
        polygons.append(corners[np.argsort(angles)])
    return polygons


def _sphere(radius: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(0, np.pi, 21))
    ring = radius * np.sin(polar)
    return ring * np.cos(azimuth), ring * np.sin(azimuth), radius * np.cos(polar)
