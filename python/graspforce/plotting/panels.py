"""One grasp with all that explains it: contact numbers, a wrench as arrows, and a legend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, Polygon
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from graspforce._internal.checks import triangles
from graspforce._internal.normal_limits import normal_limits

from .arrows import HEAD, Arrow3D, wrench_lines
from .hull import hull_faces
from .planar import FORCE_SHARE, draw_planar_grasp, size_of
from .scene import fill_view
from .spatial import draw_contacts
from .style import CONE, EXTERNAL, FORCE, INK, MUTED, OBJECT, OVERLOAD, WEAKEST

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp, Quality

    Array = NDArray[np.float64]


_HULL: dict[str, Any] = {"facecolor": OBJECT, "edgecolor": MUTED, "alpha": 0.45}


@dataclass(frozen=True, slots=True)
class DrawnWrench:
    """A wrench (d,) about the grasp's origin, as arrows of a colour; `label` says what it is."""

    wrench: Array
    color: str
    label: str

    @classmethod
    def weakest(cls, quality: Quality) -> DrawnWrench:
        """Return the nearest wrench on the boundary of the wrench set, or one that cannot be exerted."""
        if quality.epsilon > 0:
            return cls(
                quality.wrench, WEAKEST, f"weakest wrench ({quality.criterion}): {sizes(quality.wrench)}"
            )
        return cls(quality.direction, WEAKEST, "wrench that cannot be exerted")

    @classmethod
    def external(cls, wrench: Array) -> DrawnWrench:
        """Return an external wrench."""
        return cls(wrench, EXTERNAL, f"external wrench: {sizes(wrench)}")


def sizes(wrench: Array) -> str:
    """Write the norms of force and torque."""
    dim = 2 if len(wrench) == 3 else 3
    force, torque = (float(np.linalg.norm(part)) for part in (wrench[:dim], wrench[dim:]))
    parts = [f"{force:.4g} N"] * (force > 1e-9 * torque) + [f"{torque:.4g} N m"] * (torque > 1e-9 * force)
    return ", ".join(parts) or "zero"


def draw_panel(
    figure: Figure,
    position: int,
    grasp: Grasp,
    *,
    forces: ArrayLike | None = None,
    wrench: DrawnWrench | None = None,
    outline: ArrayLike | None = None,
    mesh: Any = None,
    curves: Sequence[Array] = (),
) -> tuple[list[Artist], Array]:
    """Draw a grasp into a place of a figure.

    Returned are the entries of its legend, and width and height (2,) of what is drawn, the larger about one.
    """
    if grasp.wrench_dim == 3:
        axes = figure.add_subplot(position)
        for curve in curves:
            axes.plot(*curve.T, color=MUTED, lw=4, alpha=0.6, solid_capstyle="round", zorder=1.5)
        if outline is None and grasp.num_contacts > 1:
            axes.add_patch(Polygon(hull_faces(grasp.positions)[0], **_HULL, lw=0.8, zorder=1))
        draw_planar_grasp(axes, grasp, forces, outline=outline, labels=True)
        _arrows_2d(axes, grasp, wrench, outline)
        _dress(axes)
        entries = _entries(
            grasp, forces, wrench, np.zeros(grasp.num_contacts, bool), outline is None, bool(curves)
        )
        extent = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
        return entries, np.maximum(extent / extent.max(), 0.4)
    mesh = None if mesh is None else triangles("mesh", mesh)
    solid = cast("Axes3D", figure.add_subplot(position, projection="3d"))
    lines = _lines(grasp, wrench, grasp.positions if mesh is None else mesh[0])
    _, (shown, view), behind = draw_contacts(
        solid, grasp, forces, mesh, None, True, CONE, view=None, arrows=lines
    )
    if mesh is None:
        hull = Poly3DCollection(hull_faces(grasp.positions), **_HULL, linewidths=0.8, zorder=1)
        solid.add_collection3d(hull)
    for line in lines:
        solid.add_artist(Arrow3D(line, color=wrench.color, lw=2.2, zorder=13))  # type: ignore[union-attr] # lines are of one
    used = fill_view(solid, np.vstack([shown, *lines]), view)
    return _entries(grasp, forces, wrench, behind, mesh is None, curves=False), used


def _lines(grasp: Grasp, drawn: DrawnWrench | None, points: Array) -> list[Array]:
    """Lines of a wrench through the origin; through the middle of the points if that is far from them."""
    if drawn is None:
        return []
    dim = points.shape[1]
    low, high, size = points.min(axis=0), points.max(axis=0), size_of(points)
    at, force, torque = grasp.origin, drawn.wrench[:dim], drawn.wrench[dim:]
    if (at < low - size / 2).any() or (at > high + size / 2).any():
        middle = (low + high) / 2
        torque = torque + np.atleast_1d(
            np.cross(at - middle, force) if dim == 3 else _cross(at - middle, force)
        )
        at = middle
    return list(
        wrench_lines(force, torque if dim == 3 else torque[0], grasp.length_scale, at, FORCE_SHARE * size)
    )


def _cross(arm: Array, force: Array) -> float:
    return float(arm[0] * force[1] - arm[1] * force[0])


def _arrows_2d(axes: Axes, grasp: Grasp, wrench: DrawnWrench | None, outline: ArrayLike | None) -> None:
    points = grasp.positions if outline is None else np.asarray(outline, dtype=np.float64)
    for line in _lines(grasp, wrench, points):
        style: dict[str, Any] = {"arrowstyle": HEAD, "mutation_scale": 16, "shrinkA": 0, "shrinkB": 0}
        axes.add_patch(FancyArrowPatch(path=Path(line), color=wrench.color, lw=2.2, zorder=6, **style))  # type: ignore[union-attr]
        axes.update_datalim(line)


def _dress(axes: Axes) -> None:
    axes.margins(0.03)
    axes.autoscale_view()
    axes.set_xlabel("x (m)", fontsize=8, color=INK)
    axes.set_ylabel("y (m)", fontsize=8, color=INK)
    axes.tick_params(labelsize=7, colors=INK)
    axes.spines[:].set_visible(False)
    extent = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
    for axis, share in zip((axes.xaxis, axes.yaxis), extent / extent.max(), strict=True):
        axis.set_major_locator(MaxNLocator(max(1, round(5 * share)), min_n_ticks=2))


def _names(contacts: NDArray[np.bool_]) -> str:
    """Numbers of the contacts (m,) that are True, as far as they are few."""
    numbers = np.flatnonzero(contacts)
    if len(numbers) == len(contacts):
        return "all"
    return ", ".join(map(str, numbers)) if len(numbers) <= 6 else f"{len(numbers)} of {len(contacts)}"


def _entries(
    grasp: Grasp,
    forces: ArrayLike | None,
    wrench: DrawnWrench | None,
    behind: NDArray[np.bool_],
    hull: bool,
    curves: bool,
) -> list[Artist]:
    dot: dict[str, Any] = {"ls": "", "marker": "o", "ms": 4.5, "mec": INK}
    entries: list[Artist] = [Line2D([], [], mfc=INK, label="contact", **dot)] if not behind.all() else []
    if behind.any():
        entries.append(Line2D([], [], mfc="none", label=f"behind the object: {_names(behind)}", **dot))
    entries.append(Patch(facecolor=CONE, edgecolor=FORCE, lw=0.8, label="friction cone"))
    if hull and grasp.num_contacts > 1:
        entries.append(Patch(facecolor=OBJECT, edgecolor=MUTED, lw=0.8, label="hull of the contacts"))
    if curves:
        entries.append(Line2D([], [], color=MUTED, lw=4, alpha=0.6, label="where contacts may lie"))
    if forces is not None:
        normal = np.asarray(forces, dtype=np.float64)
        over = normal[:, 0] / normal_limits(grasp) > 1 + 1e-9
        dim = grasp.positions.shape[1]
        largest = float(np.linalg.norm(normal[:, :dim], axis=1).max())
        label = f"the longest is {largest:.4g} N" if largest > 0 else "none"
        if not over.all():
            entries.append(Line2D([], [], color=FORCE, lw=1.8, label=f"contact force; {label}"))
        if over.any():
            tail = f"; {label}" if over.all() else ""
            entries.append(
                Line2D([], [], color=OVERLOAD, lw=1.8, label=f"force past its limit: {_names(over)}{tail}")
            )
        covered = behind & (normal[:, 0] > 0)
        if covered.any():
            color = OVERLOAD if over[covered].all() else FORCE
            entries.append(
                Line2D([], [], color=color, lw=1.8, ls=(0, (3, 2)), label="force behind the object")
            )
    if wrench is not None:
        entries.append(Line2D([], [], color=wrench.color, lw=2.2, label=wrench.label))
    return entries
