"""Which iterates of a plan get a panel of their own."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graspforce.planning import Iterate

_CHANGE = 0.02
"""Least change of rho from panel to panel, in shares of the largest change."""


def shown_iterates(history: tuple[Iterate, ...], most: int) -> list[tuple[int, Iterate]]:
    """Return the first iterate, the last that moved, and those between that change rho enough, numbered.

    Of more than `most` the last ones before the end are left out.
    """
    rho = np.array([row.rho for row in history])
    moved = [not np.array_equal(a.params, b.params) for a, b in pairwise(history)]
    end = max((k for k, changed in enumerate(moved, start=1) if changed), default=0)
    least = _CHANGE * float(np.ptp(rho[np.isfinite(rho)], axis=0)) if np.isfinite(rho).any() else 0.0
    shown = [0]
    for k in range(1, end):
        if not abs(rho[k] - rho[shown[-1]]) <= least and not abs(rho[k] - rho[end]) <= least:
            shown.append(k)
    shown = [*shown[: most - 1], end] if end else shown
    return [(k, history[k]) for k in shown]
