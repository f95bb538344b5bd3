"""Contact forces along a trajectory of external wrenches, with their limits (Figs. 6 and 7 of the paper)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_array, real_array
from graspforce.errors import InvalidInputError

from .style import CONTACTS, INK, MUTED, plain_axes

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

_PERIOD = 10.0
"""Length of one dash of each contact, in line widths."""

_LIMITS = ((5, 3), (1, 1.5), (7, 2, 1, 2))
"""Dashes of the limits, in turn."""


def draw_forces(
    axes: Axes, normal_forces: ArrayLike, max_normal_force: ArrayLike, *, times: ArrayLike | None = None
) -> list[Artist]:
    """Draw each contact's normal force over time, and the limits as thin dashed lines.

    Contacts whose forces are equal, as of symmetric grasps, share one line of dashes in their colours.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    normal_forces : array_like
        (T, m) normal forces in N; NaN leaves a gap, where no forces balance the wrench.
    max_normal_force : array_like
        Scalar or (m,) limits in N. One limit that all contacts share is one grey line.
    times : array_like, optional
        (T,) in s; by default the rows are numbered.

    Returns
    -------
    list of matplotlib.artist.Artist
        A line for each contact, then one for each limit.

    Raises
    ------
    InvalidInputError
        The shapes do not match.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from graspforce.plotting import draw_forces
    >>> len(draw_forces(Figure().subplots(), [[1, 2], [2, 3], [3, 3]], 5.0))
    3
    """
    forces = real_array("normal_forces", normal_forces)
    if forces.ndim != 2:
        raise InvalidInputError(f"normal_forces: shape {forces.shape}, expected (T, m)")
    moments = np.arange(len(forces)) if times is None else finite_array("times", times)
    if moments.shape != forces.shape[:1]:
        raise InvalidInputError(f"times: shape {moments.shape}, expected {forces.shape[:1]}")
    given = finite_array("max_normal_force", max_normal_force)
    try:
        limits = np.broadcast_to(given, forces.shape[1:])
    except ValueError:
        shape = np.shape(max_normal_force)
        raise InvalidInputError(f"max_normal_force: shape {shape}, expected {forces.shape[1:]}") from None
    artists: list[Artist] = []
    for i, (column, dashes) in enumerate(zip(forces.T, _dashes(forces), strict=True)):
        colour = CONTACTS[i % len(CONTACTS)]
        artists += axes.plot(moments, column, lw=1.8, ls=dashes, color=colour, label=f"contact {i}")
    for k, value in enumerate(np.unique(limits)):
        owners = np.flatnonzero(limits == value)
        colour = CONTACTS[owners[0] % len(CONTACTS)] if len(owners) == 1 else MUTED
        limit = axes.axhline(value, lw=1.0, ls=(0, _LIMITS[k % len(_LIMITS)]), color=colour)
        names = "all" if len(owners) == len(limits) else ", ".join(str(i) for i in owners)
        limit.set_label(f"limit of {names}")
        artists.append(limit)
    plain_axes(axes, "row" if times is None else "time (s)", "normal force (N)")
    axes.set_ylim(bottom=0)
    legend = axes.legend(
        fontsize=8, frameon=False, labelcolor=INK, loc="center left", bbox_to_anchor=(1.0, 0.5)
    )
    for line in legend.get_lines()[: forces.shape[1]]:
        line.set_linestyle("-")
    return artists


def _dashes(forces: NDArray[np.float64]) -> list[Any]:
    """Line styles of columns (T, m). Columns that run together share the line: each has its dashes of it."""
    scale = max(float(np.nanmax(np.abs(forces), initial=0.0)), 1e-300)
    together: list[list[int]] = []
    for i, column in enumerate(forces.T):
        for group in together:
            apart = np.abs(column - forces[:, group[0]])
            if (apart < 0.01 * scale).sum() > 0.5 * np.isfinite(apart).sum():
                group.append(i)
                break
        else:
            together.append([i])
    styles: list[Any] = ["-"] * forces.shape[1]
    for group in together:
        for place, i in enumerate(group[1:], start=1):
            dash = _PERIOD / len(group)
            styles[i] = (dash * place, (dash, _PERIOD - dash))
    return styles
