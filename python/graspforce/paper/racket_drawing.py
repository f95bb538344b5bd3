"""Drawings of the racket's plans, iterate by iterate, as in Fig. 4 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from graspforce.plotting.planar import LONGEST, draw_planar_grasp
from graspforce.plotting.style import CONE, FORCE, INK, OVERLOAD

from .examples import RACKET_WRENCH
from .racket import grasp_at
from .racket_outline import draw_racket, label_contacts
from .shown_iterates import shown_iterates

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from graspforce.planning import Iterate

    from .racket import PlanRun, RacketRun

_PANELS = 8


def plan_figure(run: PlanRun) -> Figure:
    """Return panels of the iterates of a racket plan, with the least forces against Table 1's wrench.

    Iterates that hardly change the quality have none.

    For one thread at a time, as all of matplotlib.
    """
    shown = shown_iterates(run.plan.history, _PANELS)
    figure = Figure(figsize=(max(1.9 * len(shown), 8.0), 4.75), dpi=130, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(shown), sharex=True, sharey=True))
    for axes, (k, row) in zip(panels, shown, strict=True):
        _draw_iterate(axes, run, row)
        axes.set_title(f"iteration {k}" if k else "start", fontsize=9, color=INK)
    wrench = ", ".join(f"{x:g}" for x in RACKET_WRENCH)
    figure.suptitle(
        rf"Racket, {run.problem.name}: the search for the least $\rho_{{\mathrm{{{run.plan.criterion}}}}}$,"
        f" with the least forces against [{wrench}] N, N m",
        fontsize=10,
        color=INK,
    )
    figure.legend(handles=_legend(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def save_plan_figures(run: RacketRun, folder: Path) -> list[Path]:
    """Draw every plan into `folder`, one PNG each, and return their paths.

    For one thread at a time, as all of matplotlib.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for result in run.plans:
        path = folder / f"racket-{result.problem.name.replace(' ', '-')}-{result.plan.criterion}.png"
        plan_figure(result).savefig(path)
        paths.append(path)
    return paths


def _draw_iterate(axes: Axes, run: PlanRun, row: Iterate) -> None:
    problem, forces = run.problem, run.forces(row.params)
    draw_racket(axes)
    grasp = grasp_at(problem, row.params)
    draw_planar_grasp(axes, grasp, forces, metres_per_newton=1.4e-3)
    label_contacts(axes, grasp.positions, grasp.normals)
    lines = [rf"$\rho_{{\mathrm{{{run.plan.criterion}}}}} = {row.rho:.3f}$"]
    if forces is None:
        lines += ["no forces balance", "the wrench"]
    else:
        shares = forces[:, 0] / np.asarray(problem.max_normal_force)
        lines += [rf"max $f_n/f^U = {shares.max():.3f}$", rf"sum $f_n/f^U = {shares.sum():.3f}$"]
    axes.text(0, -0.54, "\n".join(lines), ha="center", va="top", fontsize=8, color=INK, linespacing=1.4)
    axes.set(aspect="equal", xlim=(-0.215, 0.215), ylim=(-0.66, 0.205))
    axes.axis("off")


def _legend() -> list[Artist]:
    return [
        Patch(facecolor=CONE, label="friction cone, as long as the force's limit"),
        Line2D([], [], color=FORCE, lw=1.4, label="contact force"),
        Line2D([], [], color=OVERLOAD, lw=1.4, label=f"force past its limit, cut at {LONGEST:g} limits"),
    ]
