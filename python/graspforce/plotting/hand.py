"""Hands with the objects they grasp."""

from __future__ import annotations

import reprlib
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._internal.checks import chosen, triangles
from graspforce.errors import InvalidInputError

from .hand_view import clearest_view, lit, seen, small_triangles
from .style import CONE, INK, OBJECT
from .views import axes_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


_SKIN = "#a9b6c6"
_LONGEST = 0.006  # m, of a triangle's edge
_ZOOM = 1.6  # fills the axes with a ball that touches the limits


def draw_hand(
    axes: Axes3D,
    plan: Any,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    pose: Literal["grasp", "pregrasp"] = "grasp",
    labels: bool = False,
    elevation: float | None = None,
    azimuth: float | None = None,
) -> list[Artist]:
    """Draw a hand at its grasp or pregrasp, the object, and the contacts.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.axes3d.Axes3D
        Where to draw, in m.
    plan : HandPlan or HandPose
        What `graspforce.plan_hand` or `Hand.reach` found.
    mesh : tuple of array_like, optional
        Vertices (v, 3) in m and triangles (t, 3) of the object.
    pose : {"grasp", "pregrasp"}
        Joints at the contacts, or those of the pregrasp.
    labels : bool
        True numbers the contacts, from 0. Contacts that something hides are hollow.
    elevation, azimuth : float, optional
        Direction of view in degrees. By default, if one of them is missing, the contacts are seen best.

    Returns
    -------
    list of matplotlib.artist.Artist
        The surface of hand and object, then points and numbers.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import graspforce as gf
    >>> from graspforce.plotting import draw_hand
    >>> pose = gf.hands.preset("allegro-right").reach([(0.02, 0, 0), (-0.02, 0, 0)], [(-1, 0, 0), (1, 0, 0)])
    >>> axes = Figure().add_subplot(projection="3d")
    >>> len(draw_hand(axes, pose))
    1
    """
    chosen("pose", pose, ("grasp", "pregrasp"))
    if not (hasattr(plan, "hand") and hasattr(plan, "palm")):
        raise InvalidInputError(f"plan: {reprlib.repr(plan)} is not a HandPlan or HandPose")
    joints = plan.pregrasp if pose == "pregrasp" else plan.joints
    vertices, faces = plan.hand.surface(plan.palm, joints, forearm=False)
    skin = small_triangles(vertices[faces], _LONGEST)
    shown = [(skin, _SKIN)]
    if mesh is not None:
        points, numbers = triangles("mesh", mesh)
        shown.append((small_triangles(points[numbers], _LONGEST), OBJECT))
    middles = np.concatenate([corners.mean(axis=1) for corners, _ in shown])
    grasp = getattr(plan, "grasp", None)
    where = np.zeros((0, 3)) if grasp is None else grasp.positions - 1e-3 * grasp.normals
    if elevation is None or azimuth is None:
        elevation, azimuth = clearest_view(where, middles) if len(where) else (20.0, -60.0)
    view = axes_of(elevation, azimuth)
    facing = [lit(corners, color, view) for corners, color in shown]
    # One collection: matplotlib sorts the triangles of each by depth, but not those of two.
    colours = np.concatenate([rgba for _, rgba in facing])
    surface = Poly3DCollection(
        np.concatenate([front for front, _ in facing]),
        facecolors=colours,
        edgecolors=colours,
        linewidths=0.3,
        zorder=1,
    )
    artists: list[Artist] = [axes.add_collection3d(surface)]
    for number, (point, clear) in enumerate(zip(where, seen(where, middles, view), strict=True)):
        fill = {"color": CONE, "mec": INK} if clear else {"color": "none", "mec": CONE}
        artists += axes.plot(*point[:, None], "o", ms=5, mew=0.8, zorder=11, **fill)
        if labels:
            beside = point + 0.012 * view[0]
            artists.append(axes.text(*beside, str(number), fontsize=8, color=INK, zorder=12))
    _frame(axes, np.concatenate([corners.reshape(-1, 3) for corners, _ in shown]), view)
    axes.view_init(elev=elevation, azim=azimuth)
    return artists


def _frame(axes: Axes3D, points: Array, view: Array) -> None:
    """Show all points (N, 3), with one scale, without axes and perspective."""
    flat = points @ view.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    middle, half = (low + high) / 2 @ view, float((high - low)[:2].max()) / 2 + 1e-9
    axes.set(**{f"{name}lim": (m - half, m + half) for name, m in zip("xyz", middle, strict=True)})
    axes.set_proj_type("ortho")
    axes.set_box_aspect((1, 1, 1), zoom=_ZOOM)
    axes.set_axis_off()


def hand_figure(
    plan: Any, mesh: tuple[ArrayLike, ArrayLike] | None = None, *, title: str | None = None
) -> Figure:
    """Make a figure of a plan from two sides, at the pregrasp and at the grasp.

    For one thread at a time, as all of matplotlib. Arguments are those of `draw_hand`.

    Examples
    --------
    >>> from graspforce.plotting import hand_figure
    >>> hand_figure(plan, mesh).savefig("plan.png")  # doctest: +SKIP
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - as the other figures do

    figure = Figure(figsize=(9, 4.2), layout="constrained")
    first = figure.add_subplot(1, 3, 2, projection="3d")
    draw_hand(first, plan, mesh, labels=True)
    first.set_title("grasp", fontsize=9, color=INK)
    views: tuple[tuple[int, Literal["grasp", "pregrasp"], float], ...]
    views = (1, "pregrasp", first.azim), (3, "grasp", first.azim + 90)
    for column, name, azimuth in views:
        axes = figure.add_subplot(1, 3, column, projection="3d")
        draw_hand(
            axes,
            plan,
            mesh,
            pose=name,
            labels=name == "grasp",
            elevation=first.elev,
            azimuth=azimuth,
        )
        axes.set_title(name, fontsize=9, color=INK)
    if title is not None:
        figure.suptitle(title, fontsize=10, color=INK)
    return figure
