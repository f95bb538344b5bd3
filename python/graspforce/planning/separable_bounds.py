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
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import ProductBound

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from .contact_wrenches import ContactWrenches
    from .wrench_curvature import Departures

    Array = NDArray[np.float64]
    Indices = NDArray[np.int64]

__all__ = ["SeparableBounds", "ask_samples", "polish"]

_MAX_PRODUCTS = 4_000_000
_MAX_CELLS = 50_000  # of all groups: each takes 4 kB
_SAMPLE = 2048  # random grasps, for a first good one
_FIRST_DIRECTIONS = 300
_COARSE = 0.3  # of what is enough: cells that leave more open are cut before products are looked at
_COARSE_CELLS = 4096
_OPEN_ALONG = 0.02  # of what is enough: more than other axes could gain
_LOOKED_AT = 96  # products whose worst directions are asked for at a time
_MIXED = 1000  # products that are bounded closely, one by one, before cells are cut
_NEAR = 100  # grasps that are tried around the best one at a time


class _Cells:
    """Boxes of one group's parameters, and the boxes that they were cut into."""

    def __init__(self, axes: Indices, contacts: Indices, low: Array, high: Array) -> None:
        self.axes, self.contacts = axes, contacts
        self.low, self.high = low[None, axes], high[None, axes]
        self.children = np.array([-1])
        # Of the boxes that were measured, which are all but the last ones.
        self.slack = np.zeros(0)
        self.along = np.zeros((0, len(axes)))
        self.needs = np.zeros((0, 0), dtype=bool)
        self.seeds = np.zeros((0, len(contacts), 3))

    @property
    def leaves(self) -> Indices:
        """Boxes that were not cut."""
        return np.flatnonzero(self.children < 0)

    def keep(self, kept: Indices) -> None:
        """Drop all other boxes."""
        place = np.full(len(self.children), -1)
        place[kept] = np.arange(len(kept))
        children = self.children[kept]
        self.children = np.where(children < 0, -1, place[children])
        self.low, self.high = self.low[kept], self.high[kept]
        self.slack, self.needs, self.along = self.slack[kept], self.needs[kept], self.along[kept]

    def halve(self, rows: Indices, rates: Array, enough: float) -> bool:
        """Cut boxes where interpolation leaves most open, or where contacts move most across them.

        False where one is too small to be cut.
        """
        low, high = self.low[rows], self.high[rows]
        axis = np.argmax((high - low) * rates[self.axes], axis=1)
        open_along = self.along[rows]
        axis = np.where(open_along.max(axis=1) > _OPEN_ALONG * enough, np.argmax(open_along, axis=1), axis)
        each = np.arange(len(rows))
        middle = (low[each, axis] + high[each, axis]) / 2
        if not ((low[each, axis] < middle) & (middle < high[each, axis])).all():
            return False
        low, high = np.repeat(low, 2, axis=0), np.repeat(high, 2, axis=0)
        high[2 * each, axis] = low[2 * each + 1, axis] = middle
        self.children[rows] = len(self.children) + 2 * each
        self.children = np.r_[self.children, np.full(len(low), -1)]
        self.low, self.high = np.concatenate([self.low, low]), np.concatenate([self.high, high])
        return True


class SeparableBounds:
    """Products of cells that may hold a better grasp than the best one known.

    Attributes
    ----------
    proven : float
        An upper bound of everything, from when the products were last in order: what holds if an error or
        Ctrl-C interrupts a step.
    boxes : int
        Cells that were bounded.
    """

    def __init__(
        self,
        wrenches: ContactWrenches,
        departures: Callable[[Array, Array, Indices, Indices], Departures],
        groups: list[tuple[Indices, Indices]],
        start: Array,
        lower: Array,
        upper: Array,
        rates: Array,
    ) -> None:
        self._wrenches, self._departures = wrenches, departures
        self._start, self._rates, self._whole = start, rates, (lower, upper)
        self._cells = [_Cells(axes, contacts, lower, upper) for contacts, axes in groups]
        forces = [wrenches.force_sets(contacts) for contacts, _ in groups]
        self._bound = ProductBound(2 + wrenches.is_spatial, wrenches.criterion, forces, wrenches.center)
        self.proven = np.inf
        self.boxes = 0

    @property
    def top(self) -> float:
        """No parameters exceed it."""
        return self._bound.top

    @property
    def discarded(self) -> float:
        """Largest bound of the products that were discarded."""
        return self._bound.discarded

    def boxes_left(self, rows: list[int] | None = None) -> tuple[Array, Array, Array]:
        """Bounds, and lower and upper corners, of products that are left: of all, or of some rows."""
        bounds, cells = self._bound.products(list(range(len(self._bound))) if rows is None else rows)
        low = np.empty((len(bounds), len(self._start)))
        high = low.copy()
        for boxes, of in zip(self._cells, cells.astype(np.int64).T, strict=len(bounds) > 0):
            low[:, boxes.axes], high[:, boxes.axes] = boxes.low[of], boxes.high[of]
        return bounds, low, high

    def run(
        self,
        attempt: Callable[[Array], None],
        best: Callable[[], Array | None],
        enough: Callable[[], float],
        seconds_left: Callable[[float, int], float],
    ) -> None:
        """Cut and discard until nothing is left, no time is, or memory would not hold more.

        `attempt` looks for a better grasp among parameters (B, p), `best` gives those of the best one, and
        products whose bound is at most `enough()` are discarded. Nothing is done without a force closure:
        sums of supports do not tell open grasps from each other.
        """

        def left() -> float:
            return max(0.0, seconds_left(self.proven, self.boxes))

        random = np.random.default_rng(0)
        low, high = self._whole
        sample = low + random.random((_SAMPLE, len(low))) * (high - low)
        attempt(sample)
        polish(self._whole, random, attempt, best, left)
        if best() is None or enough() <= 0:
            return
        for group in range(len(self._cells)):
            self._measure(self._cells[group])
            self._cut_coarse(self._cells[group], enough() / len(self._cells), left)
            self._plant(group)
        self._bound.learn(self._wrenches.critical_directions(sample[:_FIRST_DIRECTIONS]))
        while True:
            self._bound.descend(enough(), _MAX_PRODUCTS, left())

            def middles(rows: list[int]) -> None:
                _, low, high = self.boxes_left(rows)
                attempt((low + high) / 2)

            ask_samples(self._bound, random, enough, left, middles, _MAX_PRODUCTS)
            if len(self._bound) <= _MIXED:
                self._bound.ask(list(range(len(self._bound))), enough(), True, left())
            self.proven = min(self.proven, self.top)
            if not len(self._bound) or not left() or not self._cut(enough()):
                return

    def _cut_coarse(self, cells: _Cells, enough: float, left: Callable[[], float]) -> None:
        """Cut the cells of a group that hide more than any bound could make up for."""
        while left():
            leaves = cells.leaves
            rows = leaves[cells.slack[leaves] > _COARSE * enough]
            if not len(rows) or len(leaves) + len(rows) > _COARSE_CELLS:
                return
            if not cells.halve(rows, self._rates, enough):
                return
            self._measure(cells)

    def _cut(self, enough: float) -> bool:
        """Halve cells of the group whose interpolation leaves most open; False where memory ends."""
        if 2 * len(self._bound) > _MAX_PRODUCTS:
            return False
        for cells, kept in zip(self._cells, self._bound.compact(), strict=True):
            cells.keep(kept)
        if any((cells.children >= 0).any() for cells in self._cells):
            # The descent was stopped before.
            return False
        slacks = [float(cells.slack.max()) for cells in self._cells]
        group = int(np.argmax(slacks))
        rows = np.flatnonzero(self._cells[group].slack > 0.25 * slacks[group])
        if slacks[group] <= 0.05 * enough:
            # Interpolation is good enough: the widest cells hide the most.
            widths = [((c.high - c.low) * self._rates[c.axes]).max(axis=1) for c in self._cells]
            group = int(np.argmax([width.max() for width in widths]))
            rows = np.flatnonzero(widths[group] > 0.5 * widths[group].max())
        cells = self._cells[group]
        if len(rows) + sum(len(cells.low) for cells in self._cells) > _MAX_CELLS:
            return False
        if not cells.halve(rows, self._rates, enough):
            return False
        self._measure(cells)
        self._plant(group)
        return True

    def _measure(self, cells: _Cells) -> None:
        """Bound what the last boxes leave open between their corners."""
        done = len(cells.slack)
        new = np.arange(done, len(cells.low))
        self.boxes += len(new)
        lower, upper = (np.broadcast_to(self._start, (len(new), len(self._start))).copy() for _ in range(2))
        lower[:, cells.axes], upper[:, cells.axes] = cells.low[new], cells.high[new]
        found = self._departures(lower, upper, cells.contacts, cells.axes)
        slack = found.each.max(axis=1) if self._wrenches.criterion == "sum" else found.each.sum(axis=1)
        cells.slack, cells.seeds = np.r_[cells.slack, slack], found.seeds
        cells.needs = np.concatenate([cells.needs.reshape(done, len(found.seeds)), found.needs])
        along = np.zeros((len(new), len(cells.axes))) if found.along is None else found.along
        cells.along = np.concatenate([cells.along, along])

    def _plant(self, group: int) -> None:
        """Give the core the cells of a group."""
        cells = self._cells[group]
        leaves = cells.leaves
        low, high = cells.low[leaves], cells.high[leaves]
        steps = np.array(list(itertools.product((0.0, 1.0), repeat=len(cells.axes))))
        frames = [(None, np.ones(len(leaves), dtype=bool))]
        if len(cells.seeds):
            frames = list(zip(cells.seeds, cells.needs[leaves].T, strict=True))
        owners, corners, maps = [], [], []
        number = 0
        for seeds, use in frames:
            rows = np.flatnonzero(use)
            if not len(rows):
                continue
            params = np.broadcast_to(self._start, (len(rows), len(steps), len(self._start))).copy()
            params[:, :, cells.axes] = np.where(steps > 0, high[rows, None], low[rows, None])
            # Neighbours share their corners.
            places, which = np.unique(params.reshape(-1, params.shape[2]), axis=0, return_inverse=True)
            maps.append(self._wrenches.columns(places, cells.contacts, seeds))
            corners.append(number + which.reshape(-1))
            owners.append(np.repeat(leaves[rows], len(steps)))
            number += len(places)
        owner = np.concatenate(owners)
        self._bound.plant(
            group,
            cells.children,
            np.r_[0, np.cumsum(np.bincount(owner, minlength=len(cells.children)))],
            np.concatenate(corners)[np.argsort(owner, kind="stable")],
            np.where(cells.children < 0, cells.slack, 0.0),
            np.concatenate(maps),
        )


def polish(
    whole: tuple[Array, ...],
    random: np.random.Generator,
    attempt: Callable[[Array], None],
    best: Callable[[], Array | None],
    left: Callable[[], float],
) -> None:
    """Look for better grasps ever nearer to the best one, within lower and upper bounds."""
    low, high = whole
    share = 0.2
    while share > 1e-4 and left():
        before = best()
        if before is None:
            return
        near = before + share * (high - low) * random.standard_normal((_NEAR, len(before)))
        attempt(np.clip(near, low, high))
        if best() is before:
            share /= 2


def ask_samples(
    bound: ProductBound,
    random: np.random.Generator,
    enough: Callable[[], float],
    left: Callable[[], float],
    look: Callable[[list[int]], None],
    most: int,
) -> None:
    """Ask for the worst directions of some products, as long as these discard much of what is left."""
    while len(bound) and left():
        before = len(bound)
        rows = bound.worst(_LOOKED_AT // 2) + random.integers(0, before, _LOOKED_AT // 2).tolist()
        rows = sorted(set(rows))
        look(rows)
        directions = bound.ask(rows, enough(), False, left())
        if not len(bound) or not bound.learn(directions):
            return
        bound.descend(enough(), most, left())
        if len(bound) > 0.8 * before:
            return
