"""Drawings of the iterates of a search, and of the durations of calls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from graspforce._internal.checks import finite_array
from graspforce.errors import InvalidInputError

from .style import FORCE, INK, OVERLOAD, plain_axes

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from graspforce.planning import Plan


def draw_plan_history(axes: Axes, plan: Plan) -> list[Artist]:
    """Draw the quality of every iterate of a plan that has one: an infeasible start has none.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    plan : Plan
        What `graspforce.plan` returned.

    Returns
    -------
    list of matplotlib.artist.Artist
        The line.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import graspforce as gf
    >>> from graspforce.plotting import draw_plan_history
    >>> disc = gf.surfaces.contacts_on(*[gf.surfaces.ellipse(1, 1)] * 2)
    >>> found = gf.plan(disc, [0, 2], step=0.5, tolerance=0.1, bounds=[(0, 1), (1, 4)])
    >>> len(draw_plan_history(Figure().subplots(), found))
    1
    """
    epsilon = {k: -row.rho for k, row in enumerate(plan.history) if np.isfinite(row.rho)}
    line = axes.plot(list(epsilon), list(epsilon.values()), "o-", ms=4, lw=1.3, color=FORCE)
    last = max(epsilon)
    axes.annotate(
        f"{epsilon[last]:.6g}", (last, epsilon[last]), (-4, -12), textcoords="offset points",
        ha="right", fontsize=8, color=INK,
    )  # fmt: skip
    plain_axes(axes, "iteration", rf"$\epsilon_{{\mathrm{{{plan.criterion}}}}}$ (N)")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return list(line)


def draw_latencies(axes: Axes, seconds: ArrayLike, *, bins: int = 60) -> list[Artist]:
    """Draw how long many calls took, on a logarithmic axis, with median and 99th percentile marked.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    seconds : array_like
        Durations, positive.
    bins : int, optional
        Number of bars.

    Returns
    -------
    list of matplotlib.artist.Artist
        The bars and two marks.

    Raises
    ------
    InvalidInputError
        There are no durations, or one is not positive.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from graspforce.plotting import draw_latencies
    >>> len(draw_latencies(Figure().subplots(), [1e-6, 2e-6, 5e-6], bins=10))
    12
    """
    durations = 1e6 * finite_array("seconds", seconds).ravel()
    if durations.size == 0 or not (durations > 0).all():
        raise InvalidInputError("seconds: durations must be positive")
    low, high = durations.min(), durations.max()
    edges = np.geomspace(low, high * (1 + 1e-9) if high > low else 2 * low, bins + 1)
    counts, _ = np.histogram(durations, edges)
    bars = axes.bar(edges[:-1], counts, width=np.diff(edges), align="edge", color=FORCE, alpha=0.85)
    artists: list[Artist] = list(bars)
    axes.set_xscale("log")
    for name, percentile, colour in (("median", 50, INK), ("99 %", 99, OVERLOAD)):
        value = float(np.percentile(durations, percentile))
        artists.append(axes.axvline(value, lw=1.2, color=colour, label=f"{name}: {value:.3g} µs"))
    axes.legend(fontsize=8, frameon=False, labelcolor=INK, loc="upper right")
    plain_axes(axes, "duration (µs)", "calls")
    return artists
