"""Drawing of the paper's racket: its curves, joined to one outline.

The paper prints the curves on which contacts may lie. Straight lines join them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke

from .examples import RACKET

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_FRAME, _EDGE, _STRING = "#ded8c9", "#30343b", "#e9e9ea"
_LABEL_DISTANCE = 0.011


def draw_racket(axes: Axes) -> None:
    """Draw head, strings, throat and handle, in m."""
    axes.add_patch(Polygon(_outline(), facecolor=_FRAME, edgecolor=_EDGE, lw=0.7, zorder=1))
    hole = _hole()
    head = Polygon(hole, facecolor="white", edgecolor="none", zorder=1)
    axes.add_patch(head)
    spacing = np.arange(-0.165, 0.166, 0.015)
    strings = [[(x, -0.2), (x, 0.2)] for x in spacing] + [[(-0.2, y), (0.2, y)] for y in spacing]
    axes.add_collection(LineCollection(strings, colors=_STRING, linewidths=0.5, zorder=1, clip_path=head))
    axes.add_patch(Polygon(hole, fill=False, edgecolor=_EDGE, lw=0.7, zorder=1.5))


def label_contacts(axes: Axes, positions: NDArray[np.float64], normals: NDArray[np.float64]) -> None:
    """Write each contact's number, from 0, on its object side (m, 2). Coinciding contacts share a label."""
    labels: dict[tuple[float, ...], list[str]] = {}
    for i, place in enumerate(np.hstack([positions + _LABEL_DISTANCE * normals, normals])):
        labels.setdefault(tuple(np.round(place, 3)), []).append(str(i))
    for (x, y, n_x, n_y), numbers in labels.items():
        axes.text(
            x,
            y,
            ",".join(numbers),
            ha="center" if abs(n_x) < 0.5 else "left" if n_x > 0 else "right",
            va="center" if abs(n_y) < 0.5 else "bottom" if n_y > 0 else "top",
            fontsize=7,
            color=_EDGE,
            zorder=5,
            path_effects=[withStroke(linewidth=2, foreground="white")],
        )


def _outline() -> NDArray[np.float64]:
    """(n, 2) outer edge, from the top down the right side and back up the left."""
    head, _, throat = RACKET["three fingers"].curves
    right = np.concatenate(
        [
            # The head's ellipse is left where a straight line joins it to the throat without a corner.
            head.point(np.linspace(np.pi / 2, -0.3, 60)),
            throat.point(np.linspace(0.5, 0.0, 40)),
            [[0.015, -0.515]],
        ]
    )
    return np.concatenate([right, right[::-1] * [-1, 1]])


def _hole() -> NDArray[np.float64]:
    """(n, 2) inner edge of the head: two half ellipses of different heights."""
    upper, lower, *_ = RACKET["four fingers"].curves
    return np.concatenate([upper.point(np.linspace(0, np.pi, 100)), lower.point(np.linspace(-np.pi, 0, 100))])
