"""Figures of planar grasps: contacts, friction cones and forces, and the racket's plans iterate by iterate.

Needs matplotlib (the ``plot`` extra). Figures are made without pyplot, so nothing here touches the state of a
caller's own plots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from .paper import RACKET_WRENCH

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from .reproduction import PlanRun, RacketRun

__all__ = ["draw_planar_grasp", "plan_figure", "save_plan_figures"]

_INK, _OBJECT, _CONE, _FORCE, _OVERLOAD = "#30343b", "#d9d4c7", "#9cc4e4", "#1f5f99", "#c0392b"


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
    arrow that leaves its cone's end is past the limit; it is drawn in red.

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
    """
    where, inward = np.asarray(positions, dtype=float), np.asarray(normals, dtype=float)
    across = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
    limits = np.broadcast_to(np.asarray(max_normal_force, dtype=float), len(where))
    slopes = np.broadcast_to(np.asarray(friction, dtype=float), len(where))
    for point, n, t, slope, limit in zip(where, inward, across, slopes, limits, strict=True):
        reach = limit * metres_per_newton
        wedge = [point, point - reach * (n + slope * t), point - reach * (n - slope * t)]
        axes.add_patch(Polygon(wedge, facecolor=_CONE, edgecolor="none", zorder=2))
    for i, (f_n, f_t) in enumerate(np.zeros((0, 2)) if forces is None else np.asarray(forces, dtype=float)):
        if f_n <= 1e-9 * limits[i]:
            continue
        color = _OVERLOAD if f_n > limits[i] * (1 + 1e-9) else _FORCE
        tail = where[i] - metres_per_newton * (f_n * inward[i] + f_t * across[i])
        arrow = {"arrowstyle": "-|>,head_length=0.35,head_width=0.16", "color": color, "lw": 1.3}
        axes.annotate("", where[i], tail, arrowprops={**arrow, "shrinkA": 0, "shrinkB": 0}, zorder=3)
    axes.plot(*where.T, "o", ms=3.2, color=_INK, zorder=4)


def plan_figure(run: PlanRun) -> Figure:
    """Return one panel for each iterate of a racket plan, with the least forces against Table 1's wrench."""
    history = run.plan.history
    figure = Figure(figsize=(1.75 * len(history) + 0.3, 4.9), dpi=130, layout="constrained")
    all_axes = np.atleast_1d(figure.subplots(1, len(history), sharex=True, sharey=True))
    for k, (axes, row) in enumerate(zip(all_axes, history, strict=True)):
        forces = run.forces(row.params)
        _draw_racket(axes)
        positions, normals = run.problem.surface(row.params[None])
        draw_planar_grasp(
            axes,
            positions[0],
            normals[0],
            run.problem.friction,
            run.problem.max_normal_force,
            forces,
            metres_per_newton=1.2e-3,
        )
        axes.set_title(f"{k}", fontsize=10, color=_INK)
        axes.text(0.5, 0.0, _caption(run, row.rho, forces), transform=axes.transAxes, **_CAPTION)
        axes.set(aspect="equal", xlim=(-0.205, 0.205), ylim=(-0.66, 0.235))
        axes.axis("off")
    wrench = ", ".join(f"{x:g}" for x in RACKET_WRENCH)
    figure.suptitle(
        rf"Racket, {run.problem.name}: least $\rho_{{\mathrm{{{run.plan.criterion}}}}}$ by iteration"
        f"; forces balance the wrench [{wrench}] N, N m",
        fontsize=10,
        color=_INK,
    )
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


_CAPTION = {"ha": "center", "va": "bottom", "fontsize": 8, "color": _INK, "linespacing": 1.35}


def _caption(run: PlanRun, rho: float, forces: NDArray[np.float64] | None) -> str:
    name = rf"$\rho_{{\mathrm{{{run.plan.criterion}}}}}$ = {rho:.3f}"
    if forces is None:
        return f"{name}\nno balancing\nforces"
    shares = forces[:, 0] / np.asarray(run.problem.max_normal_force)
    return f"{name}\nlargest share {shares.max():.2f}\nsum of shares {shares.sum():.2f}"


def _draw_racket(axes: Axes) -> None:
    """The paper's curves as one silhouette: head, throat and handle, the head's hole cut out and strung."""
    outer = np.linspace(np.arcsin(-0.64), np.pi / 2, 60)
    throat = np.linspace(0.5, 0.0, 40)
    right = np.concatenate([
        np.stack([0.13 * np.cos(outer), 0.16 * np.sin(outer)], axis=1)[::-1],
        np.stack([0.68 * throat**3 + 0.015, 0.8 * throat**2 - 0.315], axis=1),
        [[0.015, -0.515]],
    ])
    axes.add_patch(Polygon(np.concatenate([right, right[::-1] * [-1, 1]]), facecolor=_OBJECT, edgecolor=_INK, lw=0.7))
    around = np.linspace(0, 2 * np.pi, 200)
    hole = np.stack([0.12 * np.cos(around), np.where(around < np.pi, 0.15, 0.17) * np.sin(around)], axis=1)
    axes.add_patch(Polygon(hole, facecolor="white", edgecolor=_INK, lw=0.7))
