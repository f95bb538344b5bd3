"""Drawings of the tile's plans, one panel for each iterate, as in Fig. 5 of the paper.

Needs matplotlib (the ``plot`` extra).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from graspforce._core import unwarned_grasp
from graspforce.plotting import draw_mesh, draw_spatial_grasp, frame_view

from .examples import TILE, tile_side
from .tile_forces_drawing import save_tile_forces_figures

if TYPE_CHECKING:
    from pathlib import Path

    from mpl_toolkits.mplot3d import Axes3D
    from numpy.typing import NDArray

    from graspforce.planning import Iterate

    from .tile import TilePlanRun, TileRun

_PANELS = 8
_GRID = 24
_CONE = 0.08
_SIDES = 24
_BENEATH_COLOUR = "#d99a66"


def draw_tile(axes: Axes3D) -> None:
    """Draw both sides of the tile and the rim between them, in m."""
    u, v = (grid.ravel() for grid in np.meshgrid(*[np.linspace(-0.2, 0.2, _GRID + 1)] * 2, indexing="ij"))
    corner = np.arange((_GRID + 1) ** 2).reshape(_GRID + 1, _GRID + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    a, b, c, d = (part.ravel() for part in (a, b, c, d))
    upward = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    params = np.column_stack([u, v])
    draw_mesh(axes, tile_side("lower").point(params), upward[:, ::-1])
    draw_mesh(axes, tile_side("upper").point(params), upward)


def tile_plan_figure(run: TilePlanRun) -> Figure:
    """Return one panel for each iterate that moved: at most eight, the first ones and the last."""
    moved = _moved(run.plan.history)
    shown = moved if len(moved) <= _PANELS else [*moved[: _PANELS - 1], moved[-1]]
    columns = min(4, len(shown))
    rows = -(-len(shown) // columns)
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
        f"friction {run.friction:g} ({label}); blue cones on top, orange ones beneath",
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


def _moved(history: tuple[Iterate, ...]) -> list[tuple[int, Iterate]]:
    """Return iterates that differ from the one before, with their numbers."""
    previous: NDArray[np.float64] | None = None
    moved = []
    for k, row in enumerate(history):
        if previous is None or not np.array_equal(row.params, previous):
            moved.append((k, row))
        previous = row.params
    return moved


def _draw_iterate(axes: Axes3D, run: TilePlanRun, params: NDArray[np.float64]) -> None:
    positions, normals = (array[0] for array in TILE.surface(params[None]))
    # Contacts beneath the tile are drawn before it, contacts on top after it.
    beneath, above = slice(2, 4), slice(0, 2)
    grasps = [
        unwarned_grasp(positions[side], normals[side], run.friction, edges=_SIDES)
        for side in (beneath, above)
    ]
    draw_spatial_grasp(axes, grasps[0], metres_per_newton=_CONE, color=_BENEATH_COLOUR)
    draw_tile(axes)
    draw_spatial_grasp(axes, grasps[1], metres_per_newton=_CONE)
    for number, (point, n) in enumerate(zip(positions, normals, strict=True)):
        axes.text(*(point - 1.3 * _CONE * n), str(number), fontsize=8, ha="center", zorder=6)
    frame_view(axes, (-0.24, -0.24, -0.2), (0.24, 0.24, 0.2), elevation=34, azimuth=-68, zoom=1.1)
