"""Drawings of the tile's plans, iterate by iterate, as in Fig. 5 of the paper.

Needs matplotlib (the ``plot`` extra).
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from graspforce._core import unwarned_grasp
from graspforce._internal.grid import patch_triangles
from graspforce.plotting.scene import fill_view
from graspforce.plotting.spatial import draw_contacts
from graspforce.plotting.style import CONE

from .examples import TILE, tile_side
from .shown_iterates import shown_iterates
from .tile_forces_drawing import save_tile_forces_figures

if TYPE_CHECKING:
    from pathlib import Path

    from mpl_toolkits.mplot3d import Axes3D
    from numpy.typing import NDArray

    from .tile import TilePlanRun, TileRun

_PANELS = 8
_GRID = 24
_CONE = 0.08
_SIDES = 24
_VIEW = (34.0, -68.0)
_SHOWN = np.array(list(product((-0.24, 0.24), (-0.24, 0.24), (-0.15, 0.15))))
"""Corners of the box that each panel shows."""


def tile_mesh() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices (V, 3) in m and triangles (F, 3) of both sides of the tile."""
    bounds = [(-0.2, 0.2), (-0.2, 0.2)]
    (lower, faces), (upper, _) = (
        patch_triangles(tile_side(name).point, bounds, _GRID) for name in ("lower", "upper")
    )
    return np.vstack([lower, upper]), np.vstack([faces[:, ::-1], faces + len(lower)])


def tile_plan_figure(run: TilePlanRun) -> Figure:
    """Return panels of iterates, at most eight; those that hardly change the quality have none."""
    shown = shown_iterates(run.plan.history, _PANELS)
    rows = -(-len(shown) // 4)
    columns = -(-len(shown) // rows)
    figure = Figure(figsize=(2.9 * columns, 2.6 * rows + 0.5), dpi=130, layout="constrained")
    for place, (k, row) in enumerate(shown, start=1):
        axes = figure.add_subplot(rows, columns, place, projection="3d", computed_zorder=False)
        _draw_iterate(axes, run, row.params)
        title = f"iterate {k}" if k else "start"
        rho = np.round(row.rho, 3) + 0.0
        axes.set_title(rf"{title}: $\rho_{{\mathrm{{{run.plan.criterion}}}}} = {rho:.3f}$", fontsize=9)
    label = "as printed" if run.as_printed else "inferred"
    figure.suptitle(
        rf"Tile: the search for the least $\rho_{{\mathrm{{{run.plan.criterion}}}}}$, "
        f"friction {run.friction:g} ({label}); contacts beneath are circles",
        fontsize=10,
    )
    return figure


def save_tile_figures(run: TileRun, folder: Path) -> list[Path]:
    """Draw every plan and every wrench's forces into `folder`, one PNG each, and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for result in run.plans:
        path = folder / f"tile-{result.plan.criterion}-friction-{result.friction:g}.png"
        tile_plan_figure(result).savefig(path)
        paths.append(path)
    return paths + save_tile_forces_figures(run.forces, folder)


def _draw_iterate(axes: Axes3D, run: TilePlanRun, params: NDArray[np.float64]) -> None:
    positions, normals = (array[0] for array in TILE.surface(params[None]))
    grasp = unwarned_grasp(positions, normals, run.friction, edges=_SIDES)
    draw_contacts(
        axes, grasp, None, tile_mesh(), metres_per_newton=_CONE, labels=True, color=CONE, view=_VIEW
    )
    fill_view(axes, _SHOWN, _VIEW)
