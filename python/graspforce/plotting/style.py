"""Colours, lines and axes of all figures."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, MUTED = "#30343b", "#8a9099"
OBJECT, CONE = "#ded8c9", "#a9cdea"
FORCE, OVERLOAD = "#1f5f99", "#c0392b"
WEAKEST, EXTERNAL = "#7b3fa0", "#d1762b"
UNION, MINKOWSKI = "#d1762b", "#1f5f99"
CONTACTS = ("#1f5f99", "#d1762b", "#4a8f5c", "#8a5a9e", "#b0413e", "#6b7280", "#b8912f", "#3b8ea5")
"""One colour for each contact; after the last colour the first is used again."""


class InlineFigure(Figure):
    """A figure that notebooks show, whether or not pyplot is imported."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()


def new_figure(width: float, height: float, title: str) -> Figure:
    """Return an empty figure of a size in inches, laid out so that nothing overlaps."""
    figure = InlineFigure(figsize=(width, height), dpi=130, layout="constrained")
    if title:
        figure.suptitle(title, fontsize=10, color=INK)
    return figure


def plain_axes(axes: Axes, xlabel: str, ylabel: str) -> None:
    """Label axes of numbers and leave out the frame's upper and right sides."""
    axes.set_xlabel(xlabel, fontsize=9, color=INK)
    axes.set_ylabel(ylabel, fontsize=9, color=INK)
    axes.tick_params(labelsize=8, colors=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(MUTED)
    axes.grid(visible=True, lw=0.4, color="#e6e7e9")
    axes.set_axisbelow(True)
