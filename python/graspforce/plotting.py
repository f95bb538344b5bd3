"""Figures of planar grasps: contacts, friction cones and forces, and the racket's plans iterate by iterate.

Needs matplotlib (the ``plot`` extra). Figures are made without pyplot, so nothing here touches the state of a
caller's own plots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from .paper import RACKET_WRENCH
from .racket_drawing import draw_racket, label_contacts

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from .planning import Iterate
    from .reproduction import PlanRun, RacketRun

__all__ = ["draw_planar_grasp", "plan_figure", "save_plan_figures"]

_INK, _CONE, _FORCE, _OVERLOAD = "#30343b", "#a9cdea", "#1f5f99", "#c0392b"
_LONGEST = 1.5
_ARROW = {"arrowstyle": "-|>,head_length=0.4,head_width=0.18", "lw": 1.4, "shrinkA": 0, "shrinkB": 0}


def draw_planar_grasp(
    axes: Axes,
    positions: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    max_normal_force: ArrayLike,
    forces: ArrayLike | None = None,
    *,
    metres_per_newton: float,
) -> None:
    """Draw contacts as fingers see them: cones and forces lie outside the object, their tips at the contacts.

    A cone is as long as its normal force may be and an arrow as long as its force is, on one scale, so an
    arrow that leaves its cone's end is past the limit: it is red, and cut at one and a half limits.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw, in m.
    positions, normals : array_like
        (m, 2) contacts and unit normals into the object.
    friction, max_normal_force : array_like
        (m,) friction coefficients and limits in N.
    forces : array_like, optional
        (m, 2) contact forces ``[f_n, f_t]`` in N, in contact frames ``(n, t)`` with ``t = (-n_y, n_x)``.
    metres_per_newton : float
        Length at which one newton is drawn.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from graspforce.plotting import draw_planar_grasp
    >>> axes = Figure().subplots()
    >>> draw_planar_grasp(
    ...     axes, [(-1, 0), (1, 0)], [(1, 0), (-1, 0)], 0.5, 4.0, [(1, 0.5), (1, -0.5)], metres_per_newton=0.1
    ... )
    >>> len(axes.patches)
    2
    """
    where, inward = np.asarray(positions, dtype=float), np.asarray(normals, dtype=float)
    across = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
    limits = np.broadcast_to(np.asarray(max_normal_force, dtype=float), len(where))
    slopes = np.broadcast_to(np.asarray(friction, dtype=float), len(where))
    for point, n, t, slope, limit in zip(where, inward, across, slopes, limits, strict=True):
        reach = limit * metres_per_newton
        wedge = [point, point - reach * (n + slope * t), point - reach * (n - slope * t)]
        axes.add_patch(Polygon(wedge, facecolor=_CONE, edgecolor="none", zorder=2))
    for i, force in enumerate(np.zeros((0, 2)) if forces is None else np.asarray(forces, dtype=float)):
        share = force[0] / limits[i]
        if share <= 1e-9:
            continue
        f_n, f_t = force * min(1.0, _LONGEST / share) * metres_per_newton
        tail = where[i] - f_n * inward[i] - f_t * across[i]
        arrow = {**_ARROW, "color": _OVERLOAD if share > 1 + 1e-9 else _FORCE}
        axes.annotate("", where[i], tail, arrowprops=arrow, zorder=3)
    axes.plot(*where.T, "o", ms=3.4, color=_INK, zorder=4)


def plan_figure(run: PlanRun) -> Figure:
    """Return one panel for each iterate of a racket plan, with the least forces against Table 1's wrench."""
    history = run.plan.history
    figure = Figure(figsize=(1.9 * len(history), 4.75), dpi=130, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(history), sharex=True, sharey=True))
    for k, (axes, row) in enumerate(zip(panels, history, strict=True)):
        _draw_iterate(axes, run, row)
        axes.set_title(f"iteration {k}" if k else "start", fontsize=9, color=_INK)
    wrench = ", ".join(f"{x:g}" for x in RACKET_WRENCH)
    figure.suptitle(
        rf"Racket, {run.problem.name}: the search for the least $\rho_{{\mathrm{{{run.plan.criterion}}}}}$,"
        f" with the least forces against [{wrench}] N, N m",
        fontsize=10,
        color=_INK,
    )
    figure.legend(handles=_legend(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def save_plan_figures(run: RacketRun, folder: Path) -> list[Path]:
    """Draw every plan into `folder`, one PNG each, and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for result in run.plans:
        path = folder / f"racket-{result.problem.name.replace(' ', '-')}-{result.plan.criterion}.png"
        plan_figure(result).savefig(path)
        paths.append(path)
    return paths


def _draw_iterate(axes: Axes, run: PlanRun, row: Iterate) -> None:
    problem, forces = run.problem, run.forces(row.params)
    positions, normals = (array[0] for array in problem.surface(row.params[None]))
    draw_racket(axes)
    draw_planar_grasp(
        axes, positions, normals, problem.friction, problem.max_normal_force, forces, metres_per_newton=1.4e-3
    )
    label_contacts(axes, positions, normals)
    lines = [rf"$\rho_{{\mathrm{{{run.plan.criterion}}}}} = {row.rho:.3f}$"]
    if forces is None:
        lines += ["no forces balance", "the wrench"]
    else:
        shares = forces[:, 0] / np.asarray(problem.max_normal_force)
        lines += [rf"max $f_n/f^U = {shares.max():.3f}$", rf"sum $f_n/f^U = {shares.sum():.3f}$"]
    axes.text(0, -0.54, "\n".join(lines), ha="center", va="top", fontsize=8, color=_INK, linespacing=1.4)
    axes.set(aspect="equal", xlim=(-0.215, 0.215), ylim=(-0.66, 0.205))
    axes.axis("off")


def _legend() -> list[Artist]:
    return [
        Patch(facecolor=_CONE, label="friction cone, as long as the force's limit"),
        Line2D([], [], color=_FORCE, lw=1.4, label="contact force"),
        Line2D([], [], color=_OVERLOAD, lw=1.4, label=f"force past its limit, cut at {_LONGEST:g} limits"),
    ]
