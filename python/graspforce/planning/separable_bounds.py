"""Bounds of grasps whose contacts have parameters of their own: supports of separate contacts add up.

For any unit wrench direction z, ``epsilon <= p(z)``. If the contacts fall into groups k with parameters of
their own, ``p(z) = sum_k p_k(z)`` by the maximum criterion, and the largest ``p_k`` by the sum. The bound of
a product of cells is therefore the sum (or the largest) of one number for each cell, the largest ``p_k(z)``
over it. These numbers are computed once for each cell and direction; products of cells are then discarded by
additions alone.

Products that are left are cut, one group at a time. If no direction at hand discards them, the critical
directions of grasps within them are added.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from .contact_wrenches import ContactWrenches

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from .problem import SearchProblem

    Array = NDArray[np.float64]

__all__ = ["SeparableBounds"]

_MAX_PRODUCTS = 3_000_000
_MAX_TABLE = 60_000_000  # entries of all tables, four bytes each
_AT_ONCE = 100_000  # products looked at in one step
_DIRECTIONS_AT_ONCE = 16
_SAMPLE = 2048  # random grasps, for a first good one
_FIRST_DIRECTIONS = 300
_LOOKED_AT = 192  # products whose critical directions are asked for at a time
_NEAR = 100  # grasps that are tried around the best one at a time
_ROUNDED = 2e-6  # of the longest wrench: what single precision takes of a support, with a margin
_KEPT = 800  # directions that are kept, whether or not they discarded anything of late


class _Cells:
    """Boxes of one group's parameters, with the largest support along each direction."""

    def __init__(self, axes: NDArray[np.int64], contacts: NDArray[np.int64], low: Array, high: Array) -> None:
        self.axes, self.contacts = axes, contacts
        self.low, self.high = low[None, axes], high[None, axes]
        self.table = np.zeros((0, 1), np.float32)
        self.slack = np.zeros(1)


class SeparableBounds:
    """Products of cells that may hold a better grasp than the best one known.

    Attributes
    ----------
    discarded : float
        Largest bound of the products that were discarded.
    proven : float
        An upper bound of everything, from when the products were last in order: what holds if an error or
        Ctrl-C interrupts a step.
    boxes : int
        Cells that were bounded.
    """

    def __init__(
        self,
        problem: SearchProblem,
        groups: list[tuple[NDArray[np.int64], NDArray[np.int64]]],
        start: Array,
        lower: Array,
        upper: Array,
        curvature: Array | None,
        safety: float,
        rates: Array,
    ) -> None:
        self._problem, self._start, self._rates = problem, start, rates
        self._whole = lower, upper
        self._curvature, self._safety = curvature, safety
        self._wrenches = ContactWrenches(problem, start)
        self._sum = problem.quality_options["criterion"] == "sum"
        self._cells = [_Cells(axes, contacts, lower, upper) for contacts, axes in groups]
        self._directions = np.zeros((0, self._wrenches.dim))
        self._used = np.zeros(0)
        self._products = np.zeros((1, len(groups)), np.int32)
        self._bounds = np.full(1, np.inf, np.float32)
        self.discarded = -np.inf
        self.proven = np.inf
        self.boxes = 0
        self._late: Callable[[], bool] = bool
        for cells in self._cells:
            cells.slack = self._slack(cells)

    @property
    def top(self) -> float:
        """No parameters exceed it."""
        return max(float(self._bounds.max(initial=-np.inf)), self.discarded)

    def boxes_left(self) -> tuple[Array, Array, Array]:
        """Bounds, and lower and upper corners, of the products that are left."""
        low = np.empty((len(self._products), len(self._start)))
        high = low.copy()
        for group, cells in enumerate(self._cells):
            low[:, cells.axes] = cells.low[self._products[:, group]]
            high[:, cells.axes] = cells.high[self._products[:, group]]
        return self._bounds.astype(float), low, high

    def run(
        self,
        attempt: Callable[[Array], None],
        best: Callable[[], Array | None],
        enough: Callable[[], float],
        stop: Callable[[float, int], bool],
    ) -> None:
        """Cut and discard until nothing is left, `stop` says so, or memory would not hold more.

        `attempt` looks for a better grasp among parameters (B, p), `best` gives those of the best one, and
        products whose bound is at most `enough()` are discarded. Nothing is done without a force closure:
        sums of supports do not tell open grasps from each other.
        """
        self._late = lambda: stop(self.proven, self.boxes)
        random = np.random.default_rng(0)
        sample = self._sample(random, _SAMPLE)
        attempt(sample)
        self._polish(random, attempt, best)
        if best() is None or enough() <= 0:
            return
        self._learn(sample[:_FIRST_DIRECTIONS])
        while len(self._products):
            self._discard(enough(), len(self._directions))
            self._look_closer(random, attempt, enough)
            self.proven = min(self.proven, self.top)
            if not len(self._products) or self._late() or not self._cut(enough):
                return

    def _polish(
        self, random: np.random.Generator, attempt: Callable[[Array], None], best: Callable[[], Array | None]
    ) -> None:
        """Look for better grasps ever nearer to the best one."""
        low, high = self._whole
        share = 0.2
        while share > 1e-4 and not self._late():
            before = best()
            if before is None:
                return
            near = before + share * (high - low) * random.standard_normal((_NEAR, len(before)))
            attempt(np.clip(near, low, high))
            if best() is before:
                share /= 2

    def _sample(self, random: np.random.Generator, number: int) -> Array:
        _, low, high = self.boxes_left()
        rows = random.integers(0, len(low), number)
        return low[rows] + random.random((number, len(self._start))) * (high - low)[rows]

    def _learn(self, params: Array) -> int:
        """Add the directions along which these grasps are weakest; return how many are new."""
        found = self._wrenches.critical_directions(params)
        if len(self._directions) and len(found):
            found = found[(found @ self._directions.T).max(axis=1) < 1 - 1e-9]
        self._directions = np.vstack([self._directions, found])
        self._used = np.append(self._used, np.full(len(found), 1.0))
        for cells in self._cells:
            cells.table = np.vstack([cells.table, self._table(cells, found)])
        return len(found)

    def _look_closer(
        self, random: np.random.Generator, attempt: Callable[[Array], None], enough: Callable[[], float]
    ) -> None:
        """Ask for critical directions of what is left, as long as they discard much of it."""
        while len(self._products):
            before = len(self._products)
            worst = np.argsort(-self._bounds)[: _LOOKED_AT // 2]
            rows = np.concatenate([worst, random.integers(0, before, _LOOKED_AT // 2)])
            _, low, high = self._boxes_of(np.unique(rows))
            attempt((low + high) / 2)
            self._discard(enough(), self._learn((low + high) / 2))
            if len(self._products) > 0.8 * before or self._late():
                return

    def _boxes_of(self, rows: NDArray[Any]) -> tuple[Array, Array, Array]:
        products, bounds = self._products, self._bounds
        self._products, self._bounds = products[rows], bounds[rows]
        try:
            return self.boxes_left()
        finally:
            self._products, self._bounds = products, bounds

    def _discard(self, enough: float, number: int) -> None:
        """Lower the bounds by the last directions, and drop what is low enough."""
        first = len(self._directions) - number
        # Bounds are compared in single precision, and must not pass for less than they are.
        enough = float(np.nextafter(np.float32(enough), np.float32(-np.inf)))
        kept = []
        for begin in range(0, len(self._products), _AT_ONCE):
            rows = np.arange(begin, min(begin + _AT_ONCE, len(self._products)))
            if self._late():
                kept.append(np.arange(begin, len(self._products)))
                break
            bounds = self._bounds[rows].copy()
            for at in range(len(self._directions), first, -_DIRECTIONS_AT_ONCE):
                alive = bounds > enough
                if not alive.all():
                    self.discarded = max(self.discarded, float(bounds[~alive].max()))
                    rows, bounds = rows[alive], bounds[alive]
                if not len(rows):
                    break
                some = slice(max(first, at - _DIRECTIONS_AT_ONCE), at)
                along = self._bounds_along(some, rows)
                np.minimum(bounds, along.min(axis=0), out=bounds)
                self._used[some] += (along <= enough).sum(axis=1)
            alive = bounds > enough
            if not alive.all():
                self.discarded = max(self.discarded, float(bounds[~alive].max()))
            self._bounds[rows[alive]] = bounds[alive]
            kept.append(rows[alive])
        left = np.concatenate(kept) if kept else np.zeros(0, np.int64)
        self._products, self._bounds = self._products[left], self._bounds[left]
        self._forget()

    def _bounds_along(self, some: slice, rows: NDArray[Any]) -> NDArray[np.float32]:
        """Bounds of products by each of some directions."""
        total: Any = None
        for group, cells in enumerate(self._cells):
            part = cells.table[some][:, self._products[rows, group]]
            if total is None:
                total = part
            elif self._sum:
                np.maximum(total, part, out=total)
            else:
                total += part
        if self._wrenches.center is not None:
            shift = (self._directions[some] @ self._wrenches.center).astype(np.float32)
            total = np.maximum(total, 0) + shift[:, None]
        along: NDArray[np.float32] = total
        return along

    def _forget_directions(self) -> None:
        """Keep the directions that discarded most of late; those come last that are to be asked first."""
        order = np.argsort(self._used)[-_KEPT:]
        self._directions, self._used = self._directions[order], 0.5 * self._used[order]
        for cells in self._cells:
            cells.table = cells.table[order]

    def _forget(self) -> None:
        """Drop the cells that no product uses."""
        for group, cells in enumerate(self._cells):
            used, self._products[:, group] = np.unique(self._products[:, group], return_inverse=True)
            cells.low, cells.high, cells.slack = cells.low[used], cells.high[used], cells.slack[used]
            cells.table = cells.table[:, used]

    def _cut(self, enough: Callable[[], float]) -> bool:
        """Halve the cells of the group whose interpolation leaves most open; False where memory ends."""
        slacks = [float(cells.slack.max()) for cells in self._cells]
        order = sorted(range(len(slacks)), key=lambda group: -slacks[group])
        entries = len(self._directions) * sum(len(cells.low) for cells in self._cells)
        if 2 * len(self._products) > _MAX_PRODUCTS or 2 * entries > _MAX_TABLE:
            return False
        self._forget_directions()
        if max(slacks) <= 0.05 * abs(enough()):
            # Interpolation is good enough: the widest cells hide the most.
            widths = [float(((c.high - c.low) * self._rates[c.axes]).max()) for c in self._cells]
            order = sorted(range(len(widths)), key=lambda group: -widths[group])
        cells = self._cells[order[0]]
        axis = np.argmax((cells.high - cells.low) * self._rates[cells.axes], axis=1)
        rows = np.arange(len(axis))
        middle = (cells.low[rows, axis] + cells.high[rows, axis]) / 2
        if not ((cells.low[rows, axis] < middle) & (middle < cells.high[rows, axis])).all():
            return False
        first_high, second_low = cells.high.copy(), cells.low.copy()
        first_high[rows, axis] = second_low[rows, axis] = middle
        cells.low = np.concatenate([cells.low, second_low])
        cells.high = np.concatenate([first_high, cells.high])
        cells.slack = self._slack(cells)
        cells.table = self._table(cells, self._directions)
        again = self._products.copy()
        again[:, order[0]] += len(rows)
        self._products = np.concatenate([self._products, again])
        self._bounds = np.concatenate([self._bounds, self._bounds])
        return True

    def _corners(self, cells: _Cells, steps: Array) -> Array:
        """Parameters at steps (S, axes) from the cells' centres in half-widths: (cells, S, p)."""
        center, half = (cells.low + cells.high) / 2, (cells.high - cells.low) / 2
        places = center[:, None] + steps * half[:, None]
        # Rounding must not carry a vertex over the bounds, where the surface may end.
        places = np.clip(places, cells.low[:, None], cells.high[:, None])
        params = np.broadcast_to(self._start, (*places.shape[:2], len(self._start))).copy()
        params[:, :, cells.axes] = places
        return params

    def _table(self, cells: _Cells, directions: Array) -> NDArray[np.float32]:
        """Return the largest support over each cell along each direction, with its slack."""
        steps = np.array(list(itertools.product((-1.0, 1.0), repeat=len(cells.axes))))
        params = self._corners(cells, steps)
        self.boxes += len(cells.low)
        # Neighbours share their corners.
        places, which = np.unique(params.reshape(-1, params.shape[2]), axis=0, return_inverse=True)
        supports = self._wrenches.supports(places, cells.contacts, directions, union=self._sum)
        which = which.reshape(len(cells.low), len(steps))
        largest = supports[:, which[:, 0]]
        for corner in which.T[1:]:
            np.maximum(largest, supports[:, corner], out=largest)
        largest += cells.slack.astype(np.float32)
        return largest + np.float32(_ROUNDED * self._wrenches.longest)

    def _slack(self, cells: _Cells) -> Array:
        """Return what the interpolation between the corners of each cell leaves open."""
        axes = len(cells.axes)
        if self._curvature is not None:
            half = (cells.high - cells.low) / 2
            each = 0.5 * half**2 @ self._curvature[np.ix_(cells.contacts, cells.axes)].T
        else:
            arms = np.kron(np.eye(axes), np.array([[-1.0], [-0.5], [0.5], [1.0]]))
            params = self._corners(cells, np.vstack([np.zeros(axes), arms]))
            each = 2 * self._safety * self._wrenches.second_differences(params, cells.contacts, axes)
        slack: Array = each.max(axis=1) if self._sum else each.sum(axis=1)
        return slack
