"""Example 2 of the paper, computed: plans of the tile and forces on it, as printed and as inferred.

With the printed friction of 0.2 neither printed end is force closure, and the search ends elsewhere. With
friction near 0.68 the printed psi_1 are local optima, and the forces behave as in Figs. 6 and 7. This
friction is inferred; results that use it are labelled "inferred".
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp
from graspforce.planning import Plan, plan
from graspforce.typing import CRITERIA

from .completed import completed
from .examples import TILE
from .tile_forces import TrajectoryForces, tile_forces

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce.typing import Criterion

INFERRED_FRICTION = 0.68


@dataclass(frozen=True, slots=True, eq=False)
class TilePlanRun:
    """One plan of the tile, and the quality of the printed end with the same friction.

    Attributes
    ----------
    friction : float
        Friction coefficient of all contacts.
    plan : Plan
        The plan.
    seconds : float
        Time of the plan, called from Python.
    published_rho : float
        Quality of the end that the paper prints.
    published_closure : {"force", "partial", "none"}
        Closure at the printed end.
    """

    friction: float
    plan: Plan
    seconds: float
    published_rho: float
    published_closure: str

    @property
    def as_printed(self) -> bool:
        """True if every input is as printed."""
        return self.friction == TILE.friction

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, ready for JSON."""
        published = TILE.published[self.plan.criterion]
        counts = self.plan.counts
        return {
            "criterion": self.plan.criterion,
            "friction": self.friction,
            "as_printed": self.as_printed,
            "history": [row.to_dict() for row in self.plan.history],
            "seconds": self.seconds,
            "candidates": counts.candidates,
            "rejected": counts.rejected,
            "polytopes": counts.polytopes,
            "converged": counts.converged,
            "published": {
                "params": list(published.params),
                "iterations": published.iterations,
                "seconds": published.seconds,
                "rho_here": self.published_rho,
                "closure_here": self.published_closure,
            },
        }


@dataclass(frozen=True, slots=True, eq=False)
class TileRun:
    """Example 2, computed."""

    plans: tuple[TilePlanRun, ...]
    forces: tuple[TrajectoryForces, ...]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, ready for JSON."""
        return {
            "plans": [run.to_dict() for run in self.plans],
            "forces": [run.to_dict() for run in self.forces],
        }


def run_tile() -> TileRun:
    """Plan the tile by both criteria, and distribute forces at the printed optimum, with both frictions.

    Examples
    --------
    >>> from graspforce.paper.tile import run_tile
    >>> run = run_tile()
    >>> [(r.friction, r.plan.criterion, len(r.plan.history) - 1) for r in run.plans if not r.as_printed]
    [(0.68, 'max', 10), (0.68, 'sum', 19)]
    """
    frictions = (TILE.friction, INFERRED_FRICTION)
    plans = tuple(_run_plan(criterion, friction) for friction in frictions for criterion in CRITERIA)
    optimum = TILE.published["max"].params
    return TileRun(plans, tuple(tile_forces((mu, tile_grasp(optimum, mu)) for mu in frictions)))


def tile_grasp(
    params: NDArray[np.float64] | tuple[float, ...], friction: float, edges: int | None = TILE.edges
) -> Grasp:
    """Grasp of the tile at ``[phi_1, psi_1, phi_3, psi_3]`` (m); with ``edges=None`` true cones."""
    positions, normals = TILE.surface(np.asarray(params, dtype=np.float64)[None])
    return Grasp(
        positions[0], normals[0], friction=friction, max_normal_force=TILE.max_normal_force, edges=edges
    )


def _run_plan(criterion: Criterion, friction: float) -> TilePlanRun:
    start = time.perf_counter()
    found = plan(
        TILE.surface,
        TILE.initial,
        TILE.step,
        TILE.tolerance,
        TILE.bounds,
        criterion,
        friction=friction,
        max_normal_force=TILE.max_normal_force,
        edges=TILE.edges,
    )
    seconds = time.perf_counter() - start
    published = tile_grasp(TILE.published[criterion].params, friction).quality(criterion)
    return TilePlanRun(friction, completed(found), seconds, published.rho, published.closure)
