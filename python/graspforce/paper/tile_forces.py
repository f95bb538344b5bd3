"""Least forces at the printed optimum against the dynamic wrenches of Example 2 (Figs. 6 and 7)."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._core import ForceDistributor

from .examples import TILE, TILE_WRENCHES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from graspforce._core import Grasp

RATE = 1000
_JSON_EVERY = 100

Objective = Literal["max", "sum"]


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryForces:
    """Normalised normal forces against one dynamic wrench over one period, under one objective.

    Attributes
    ----------
    figure : {6, 7}
        The figure of the paper that shows them.
    friction : float
        Friction coefficient of all contacts.
    objective : {"max", "sum"}
        What is minimised.
    times : numpy.ndarray
        (T,) times in s.
    largest, total : numpy.ndarray
        (T,) maximum and sum of ``f_n / f_U`` over the contacts; NaN where no forces balance the wrench.
    seconds : float
        Time of one wrench, on average over the trajectory, in one call from Python.
    """

    figure: int
    friction: float
    objective: Objective
    times: NDArray[np.float64]
    largest: NDArray[np.float64]
    total: NDArray[np.float64]
    seconds: float

    @property
    def as_printed(self) -> bool:
        """True if every input is as printed."""
        return self.friction == TILE.friction

    @property
    def balanced(self) -> float:
        """Share of the times at which some forces balance the wrench."""
        return float(np.isfinite(self.largest).mean())

    @property
    def past_limit(self) -> float:
        """Share of the times at which a normal force exceeds its upper bound."""
        return float((self.largest > 1).mean())

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, ready for JSON, at every tenth of a second; None where unbalanced."""
        rows = slice(None, None, _JSON_EVERY)
        return {
            "figure": self.figure,
            "objective": self.objective,
            "friction": self.friction,
            "as_printed": self.as_printed,
            "balanced": self.balanced,
            "past_limit": self.past_limit,
            "seconds_per_wrench": self.seconds,
            "times": self.times[rows].tolist(),
            "max": [None if np.isnan(x) else x for x in self.largest[rows].tolist()],
            "sum": [None if np.isnan(x) else x for x in self.total[rows].tolist()],
        }


def trajectory_forces(grasp: Grasp, friction: float, figure: int, objective: Objective) -> TrajectoryForces:
    """Least forces of a tile grasp against the wrench of Fig. 6 or 7, at 1 kHz over one period.

    Examples
    --------
    >>> from graspforce.paper import TILE
    >>> from graspforce.paper.tile import tile_grasp
    >>> from graspforce.paper.tile_forces import trajectory_forces
    >>> grasp = tile_grasp(TILE.published["max"].params, 0.68)
    >>> runs = [trajectory_forces(grasp, 0.68, 6, objective) for objective in ("max", "sum")]
    >>> [round(float(run.largest.max()), 6) for run in runs]
    [0.943191, 1.247796]
    """
    wrench = TILE_WRENCHES[figure]
    times = np.arange(round(wrench.period * RATE) + 1) / RATE
    external = wrench.at(times)
    distributor = ForceDistributor(grasp, objective)
    start = time.perf_counter()
    batch = distributor.solve_many(external)
    seconds = (time.perf_counter() - start) / len(times)
    return TrajectoryForces(figure, friction, objective, times, batch.sigma_max, batch.sigma_sum, seconds)


def tile_forces(grasps: Iterable[tuple[float, Grasp]]) -> Iterator[TrajectoryForces]:
    """Least forces of each (friction, grasp) against both wrenches by both objectives."""
    objectives: tuple[Objective, ...] = ("sum", "max")
    for friction, grasp in grasps:
        for figure in TILE_WRENCHES:
            for objective in objectives:
                yield trajectory_forces(grasp, friction, figure, objective)
