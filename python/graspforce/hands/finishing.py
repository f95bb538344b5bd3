"""The last steps of a search: pregrasps, and a trial in simulation that decides which plan comes first."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .trial import shake

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .grasped_object import GraspedObject
    from .hand_plan import HandPlan
    from .plan_making import Maker
    from .search import Search

    Array = NDArray[np.float64]


_TRIED = 5
_SECONDS = 0.6
_MASS, _ACCELERATION = 0.1, 10.0  # kg, m/s^2: the trial's push is 1 N


class Finish:
    """Plans with their pregrasps, and what the simulation said of them."""

    def __init__(self, maker: Maker, search: Search, grasped: GraspedObject, pushes: Array) -> None:
        self._maker, self._search, self._grasped, self._pushes = maker, search, grasped, pushes
        self._finished: dict[int, HandPlan] = {}
        self._held: dict[int, bool] = {}

    def finished(self, plans: list[HandPlan], best: int) -> list[HandPlan]:
        """Return the first plans with pregrasps; those that are free and were not lost come first."""
        chosen = plans[: max(best, _TRIED)]
        new = [plan for plan in chosen if id(plan) not in self._finished]
        if new:
            opened = self._maker.with_pregrasps(new)
            self._finished |= {id(plan): done for plan, done in zip(new, opened, strict=True)}
        kept = [self._finished[id(plan)] for plan in chosen]
        # A plan whose pregrasp is not free can be held, but not reached.
        kept.sort(key=lambda plan: (not self._held.get(id(plan), True), plan.pregrasp_clearance <= 0))
        return kept

    def some_hold(self, plans: list[HandPlan]) -> bool:
        """Whether one of the plans holds all pushes; they are tried in their order, until one does."""
        for plan in self.finished(plans, _TRIED)[:_TRIED]:
            if id(plan) not in self._held and not self._search.ended:
                self._held[id(plan)] = self._holds(plan)
                self._search.counts[f"{'held' if self._held[id(plan)] else 'lost'} in simulation"] += 1
            if self._held.get(id(plan), False):
                return True
        return False

    def _holds(self, plan: HandPlan) -> bool:
        # Resting forces that press nothing hold nothing.
        return plan.onset > 0 and shake(
            plan, self._grasped, _MASS, acceleration=_ACCELERATION, closing=plan.pregrasp_clearance > 0,
            pushes=self._pushes, seconds=_SECONDS,
        ).success  # fmt: skip
