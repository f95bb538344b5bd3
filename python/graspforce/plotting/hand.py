"""Hands with the objects they grasp."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._internal.checks import chosen, triangles

from .scene import draw_mesh, frame_view, shaded
from .style import CONE, INK

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike


_SKIN = "#b9c0c8"
_AROUND = 0.05  # m around the object that is shown


def draw_hand(
    axes: Axes3D,
    plan: Any,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    pose: Literal["grasp", "pregrasp"] = "grasp",
    labels: bool = False,
    elevation: float = 20.0,
    azimuth: float = -60.0,
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
        True numbers the contacts, from 0.
    elevation, azimuth : float
        Direction of view in degrees.

    Returns
    -------
    list of matplotlib.artist.Artist
        Hand, object and points.

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
    joints = plan.pregrasp if pose == "pregrasp" else plan.joints
    vertices, faces = plan.hand.surface(plan.palm, joints)
    corners = vertices[faces]
    skin = Poly3DCollection(corners, facecolors=shaded(corners, _SKIN, 0.9), edgecolors="none", zorder=2)
    artists: list[Artist] = [axes.add_collection3d(skin)]
    shown = [vertices]
    if mesh is not None:
        points, numbers = triangles("mesh", mesh)
        artists.append(draw_mesh(axes, points, numbers, alpha=0.8))
        shown.append(points)
    grasp = getattr(plan, "grasp", None)
    if grasp is not None:
        artists += axes.plot(*grasp.positions.T, "o", ms=4, color=CONE, mec=INK, mew=0.5, zorder=11)
        for number, (point, normal) in enumerate(zip(grasp.positions, grasp.normals, strict=True)):
            if labels:
                artists.append(
                    axes.text(*(point - 0.015 * normal), str(number), fontsize=8, color=INK, zorder=12)
                )
    every = np.vstack(shown)
    if mesh is not None:
        # A forearm may be longer than the hand: what is far from the object is left at the rim.
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        near = (
            np.linalg.norm(every - middle, axis=1) < np.linalg.norm(points - middle, axis=1).max() + _AROUND
        )
        every = every[near]
    frame_view(axes, every.min(axis=0), every.max(axis=0), elevation=elevation, azimuth=azimuth)
    return artists


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
    for k, (name, azimuth) in enumerate((("pregrasp", -60.0), ("grasp", -60.0), ("grasp", 30.0))):
        axes = figure.add_subplot(1, 3, k + 1, projection="3d")
        draw_hand(axes, plan, mesh, pose=name, azimuth=azimuth, labels=name == "grasp")  # type: ignore[arg-type]
        axes.set_title(name, fontsize=9, color=INK)
    if title is not None:
        figure.suptitle(title, fontsize=10, color=INK)
    return figure
