"""Drawings of the least forces on the tile over one period, as in Figs. 6 and 7.

Needs matplotlib (the ``plot`` extra).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from .tile_forces import TrajectoryForces

_INK, _LIMIT = "#30343b", "#c0392b"
_LINES = {"sum": ("#c8742c", "--", "least sum"), "max": ("#1f5f99", "-", "least maximum")}
_PANELS = (
    ("a", "largest", r"maximum of $f_{in}/f_i^U$"),
    ("b", "total", r"sum of $f_{in}/f_i^U$"),
)


def tile_forces_figure(runs: Sequence[TrajectoryForces]) -> Figure:
    """Return maximum and sum over time under both objectives, for runs of one wrench and any frictions.

    A run in which no forces balance the wrench has no curve. The title says so.
    """
    figure = Figure(figsize=(8.4, 3.5), dpi=130, layout="constrained")
    shown = [run for run in runs if run.balanced > 0]
    for axes, (letter, attribute, label) in zip(figure.subplots(1, 2), _PANELS, strict=True):
        for run in shown:
            color, style, name = _LINES[run.objective]
            axes.plot(run.times, getattr(run, attribute), style, color=color, lw=1.6, label=name)
        _dress(axes, letter, label, runs[0].times[-1])
        if attribute == "largest":
            axes.axhline(1, color=_LIMIT, lw=1, label="limit")
    figure.suptitle("\n".join(_title(runs)), fontsize=9, color=_INK)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def save_tile_forces_figures(runs: Sequence[TrajectoryForces], folder: Path) -> list[Path]:
    """Draw each wrench into `folder`, one PNG each, and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for number in sorted({run.figure for run in runs}):
        path = folder / f"tile-forces-figure-{number}.png"
        tile_forces_figure([run for run in runs if run.figure == number]).savefig(path)
        paths.append(path)
    return paths


def _dress(axes: Axes, letter: str, label: str, end: float) -> None:
    axes.set_title(f"({letter}) {label}", fontsize=10, color=_INK)
    axes.set_xlabel("t (s)", fontsize=9, color=_INK)
    axes.set_xlim(0, end)
    axes.tick_params(labelsize=8, colors=_INK)
    axes.grid(color="#ececec")
    axes.spines[["top", "right"]].set_visible(False)


def _title(runs: Sequence[TrajectoryForces]) -> list[str]:
    lines = [f"Least forces on the tile, wrench of Fig. {runs[0].figure}"]
    for friction in sorted({run.friction for run in runs}, reverse=True):
        run = next(run for run in runs if run.friction == friction)
        label = "as printed" if run.as_printed else "inferred"
        outcome = "the curves below" if run.balanced > 0 else "no forces balance the wrench at any time"
        lines.append(f"friction {friction:g} ({label}): {outcome}")
    return lines
