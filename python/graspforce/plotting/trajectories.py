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

    Array = NDArray[np.float64]

_PERIOD = 10.0
"""Length of one dash of each contact, in line widths."""

_LIMITS = ((5, 3), (1, 1.5), (7, 2, 1, 2))
"""Dashes of the limits, in turn."""


def draw_forces(
    axes: Axes, normal_forces: ArrayLike, max_normal_force: ArrayLike, *, times: ArrayLike | None = None
) -> list[Artist]:
    """Draw each contact's normal force over time, and the limits as thin dashed lines.

    While forces of several contacts are equal, they share one line of dashes in their colours.

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
        A line for each contact, of most of its rows, then one for each limit.

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
    for i, (column, parts) in enumerate(zip(forces.T, _styles(forces), strict=True)):
        style: dict[str, Any] = {"lw": 1.8, "color": CONTACTS[i % len(CONTACTS)]}
        (dashes, rows), *others = parts or [("-", np.ones(len(moments), dtype=bool))]
        artists += axes.plot(
            moments, np.where(rows, column, np.nan), ls=dashes, label=f"contact {i}", **style
        )
        for dashes, rows in others:
            axes.plot(moments, np.where(rows, column, np.nan), ls=dashes, **style)
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


def _styles(forces: Array) -> list[list[tuple[Any, NDArray[np.bool_]]]]:
    """Line styles of columns (T, m), each with the rows (T,) that it is for.

    While several columns run together, the first is solid, and the others have their dashes of its line.
    """
    count, contacts = forces.shape
    scale = max(float(np.nanmax(np.abs(forces), initial=0.0)), 1e-300)
    place, sharing = np.zeros(forces.shape, dtype=int), np.ones(forces.shape, dtype=int)
    for j in range(contacts):
        for i in range(j):
            near = np.abs(forces[:, i] - forces[:, j]) < 0.01 * scale
            together = _runs(near, max(1, count // 40))
            place[:, j] += together
            sharing[:, i] += together
            sharing[:, j] += together
    styles = []
    for j in range(contacts):
        solid = place[:, j] == 0
        # Solid parts reach to the dashes beside them.
        reach = solid.copy()
        reach[1:] |= solid[:-1]
        reach[:-1] |= solid[1:]
        parts: list[tuple[Any, NDArray[np.bool_]]] = [("-", reach)] if solid.any() else []
        for at, size in sorted(set(zip(place[~solid, j].tolist(), sharing[~solid, j].tolist(), strict=True))):
            dash = _PERIOD / size
            parts.append(
                ((dash * at, (dash, _PERIOD - dash)), (place[:, j] == at) & (sharing[:, j] == size) & ~solid)
            )
        styles.append(sorted(parts, key=lambda part: -int(part[1].sum())))
    return styles


def _runs(rows: NDArray[np.bool_], longer_than: int) -> NDArray[np.bool_]:
    """Keep the runs of True that are longer than a number of rows: lines that cross do not run together."""
    steps = np.diff(np.concatenate([[False], rows, [False]]).astype(int))
    kept = np.zeros_like(rows)
    for start, end in zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True):
        kept[start:end] = end - start > longer_than
    return kept
