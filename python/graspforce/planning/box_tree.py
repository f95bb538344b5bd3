"""Boxes of all parameters, divided where their bounds are largest.

The core (`BoxBound`) bounds a box by two terms. The first is the quality of the hull of the wrench sets at
the box's vertices. The second covers the interpolation between vertices: half the curvature of the primitive
wrenches times the squares of the box's half-widths.
"""

from __future__ import annotations

import heapq
import itertools
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import BoxBound
from graspforce.errors import InvalidGraspError

from .search_scales import force_ceiling

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce._core import Grasp

    from .global_optimum import Ended
    from .incumbent import Incumbent
    from .problem import SearchProblem
    from .progress import Report
    from .separable_bounds import SeparableBounds
    from .wrench_curvature import Departures, FormulaCurvature, GivenCurvature

    Array = NDArray[np.float64]

__all__ = ["BoxTree"]

# Boxes of all parameters, before contact groups are bounded apart: in the plane a box costs little.
_PLAIN_BOXES = {2: 512, 3: 0}
_SLACK = 0.1  # of a bound: interpolation leaves more open than other axes could gain
_BATCH = 64  # boxes split between two looks at the clock: enough for all cores


class BoxTree:
    """Boxes not yet discarded, the largest bound first."""

    def __init__(
        self,
        problem: SearchProblem,
        incumbent: Incumbent,
        first: Grasp,
        curvature: GivenCurvature | FormulaCurvature | None,
        safety: float,
        rates: Array,
    ) -> None:
        self._source, self._incumbent = problem.source, incumbent
        self._curvature, self._safety, self._rates = curvature, safety, rates
        self._contacts = np.arange(first.num_contacts)
        self._sum = problem.quality_options["criterion"] == "sum"
        options = {name: value for name, value in problem.quality_options.items() if name != "rtol"}
        self._bound = BoxBound(first.positions.shape[1], **options)
        # Bounds are negated: heapq pops the least.
        self._heap: list[tuple[float, int, Array, Array, int]] = []
        self._serial = itertools.count()
        self._discarded = -np.inf
        self._plain_boxes = _PLAIN_BOXES[first.positions.shape[1]]
        self._ceiling = force_ceiling(first, options["metric"], options["criterion"])
        self.boxes = 0
        self.separable: SeparableBounds | None = None

    @property
    def top(self) -> float:
        """No parameters exceed it."""
        return min(max(-self._heap[0][0] if self._heap else -np.inf, self._discarded), self._ceiling)

    def _separate(self, max_boxes: int, deadline: float, report: Report | None) -> None:
        """Bound the contact groups apart; what that leaves replaces the boxes if its bound is lower."""
        separable, self.separable = self.separable, None
        if separable is None:
            return
        before = self.boxes

        incumbent = self._incumbent

        def seconds_left(top: float, cells: int) -> float:
            self.boxes, self._ceiling = before + cells, min(self._ceiling, top)
            if report is not None:
                report(self.boxes, max_boxes, self.top)
            over = top <= incumbent.open or self.boxes >= max_boxes
            return 0.0 if over else deadline - time.monotonic()

        separable.run(incumbent.attempt, lambda: incumbent.best, lambda: incumbent.enough, seconds_left)
        if separable.top < max(-self._heap[0][0], self._discarded):
            boxes = zip(*separable.boxes_left(), strict=True)
            heap = [(-float(bound), next(self._serial), low, high, -1) for bound, low, high in boxes]
            heapq.heapify(heap)
            self._heap, self._discarded = heap, separable.discarded

    def run(
        self,
        start: Array,
        lower: Array,
        upper: Array,
        max_boxes: int,
        deadline: float,
        report: Report | None,
    ) -> Ended:
        """Divide the box between two corners until its bound is low enough, or the work allowed is done."""
        # Nothing is known of the whole box before it is bounded.
        popped = [(-np.inf, next(self._serial), lower, upper, -1)]
        try:
            self._incumbent.attempt(start[None])
            self._offer(lower[None], upper[None])
            popped = []
            while self._heap and -self._heap[0][0] > max(self._incumbent.enough, self._discarded):
                if self.top <= self._incumbent.open:
                    return "open"
                if time.monotonic() >= deadline:
                    return "time"
                if self.boxes >= max_boxes:
                    return "boxes"
                if self.separable is not None and self.boxes >= self._plain_boxes:
                    self._separate(max_boxes, deadline, report)
                    continue
                # One by one into a list that is there already: an interrupt between two loses none.
                for _ in range(min(_BATCH, len(self._heap))):
                    popped.append(self._heap[0])
                    heapq.heappop(self._heap)
                low, high = self._halves(popped)
                if len(low):
                    self._incumbent.attempt((low + high) / 2)
                    self._offer(low, high)
                popped = []
                if report is not None:
                    report(self.boxes, max_boxes, self.top)
        except BaseException as error:
            for entry in popped:
                heapq.heappush(self._heap, entry)
            if isinstance(error, KeyboardInterrupt) and self._incumbent.best is not None:
                return "interrupted"
            raise
        if self.top <= self._incumbent.enough:
            return "tolerance"
        return "open" if self.top <= self._incumbent.open else "boxes"

    def _halves(self, boxes: list[tuple[float, int, Array, Array, int]]) -> tuple[Array, Array]:
        """Cut each box along the axis that it names, or else where the wrenches change most across it.

        What is too small to be cut is discarded.
        """
        low, high = (np.array([box[side] for box in boxes]) for side in (2, 3))
        between = (low < (low + high) / 2) & ((low + high) / 2 < high)
        can = between.any(axis=1)
        self._discarded = max(
            [self._discarded, *(-box[0] for box, cut in zip(boxes, can, strict=True) if not cut)]
        )
        named = np.array([box[4] for box in boxes])[can]
        low, high = low[can], high[can]
        axis = np.argmax(np.where(between[can], (high - low) * self._rates, -1.0), axis=1)
        rows = np.arange(len(low))
        axis = np.where((named >= 0) & between[can][rows, named], named, axis)
        middle = (low[rows, axis] + high[rows, axis]) / 2
        first_high, second_low = high.copy(), low.copy()
        first_high[rows, axis] = middle
        second_low[rows, axis] = middle
        return np.concatenate([low, second_low]), np.concatenate([first_high, high])

    def _offer(self, low: Array, high: Array) -> None:
        """Bound boxes and keep those that may hold something better."""
        self.boxes += len(low)
        axes = low.shape[1]
        rows = np.array(list(itertools.product((-1.0, 1.0), repeat=axes)))
        options: dict[str, Any] = {"enough": self._incumbent.enough}
        slack = np.full(len(low), np.finfo(float).max)
        frames: NDArray[np.float64] | None = None
        axis = np.full(len(low), -1)
        if self._curvature is None:
            arms = np.kron(np.eye(axes), np.array([[-1.0], [-0.5], [0.5], [1.0]]))
            rows = np.vstack([rows, np.zeros(axes), arms])
            options |= {"axes": axes, "safety": self._safety}
        else:
            found = self._curvature.over(low, high, self._contacts, np.arange(axes))
            total = found.each.max(axis=1) if self._sum else found.each.sum(axis=1)
            slack = np.minimum(total, slack)
            if found.along is not None:
                axis = np.argmax(found.along, axis=1)
            if len(found.seeds):
                frames = _frames(found)
                rows = np.tile(rows, (frames.shape[1], 1))
        center, half = (low + high) / 2, (high - low) / 2
        params = (center[:, None] + rows * half[:, None]).reshape(-1, axes)
        # Rounding must not carry a vertex over the bounds, where the surface may end.
        params = np.clip(params, np.repeat(low, len(rows), axis=0), np.repeat(high, len(rows), axis=0))
        given: dict[str, Any] = {**self._source.options, **self._source.contacts(params)}
        if frames is not None:
            given["tangents"] = np.repeat(frames, 2**axes, axis=1).reshape(-1, *frames.shape[2:])
        try:
            bounds = self._bound.over(slack, **given, **options)
        except InvalidGraspError as error:
            if error.row is None:
                raise
            where = params[error.row].tolist()
            raise InvalidGraspError(f"surface, parameters {where}: {error}") from error
        # Where interpolation leaves most of the bound open, it says which axis is to be cut.
        axis[slack < _SLACK * np.abs(bounds)] = -1
        for bound, box_low, box_high, cut in zip(bounds.tolist(), low, high, axis.tolist(), strict=True):
            if bound > self._incumbent.enough:
                heapq.heappush(self._heap, (-bound, next(self._serial), box_low, box_high, cut))
            else:
                self._discarded = max(self._discarded, bound)


def _frames(found: Departures) -> Array:
    """Return the first tangents (B, K, contacts, 3) that boxes need; some repeat those that they have."""
    need = found.needs
    # Those that are needed come first; the first one takes the places of the others.
    order = np.argsort(~need, axis=1, kind="stable")
    rows = np.arange(len(need))[:, None]
    order = np.where(need[rows, order], order, order[:, :1])[:, : int(need.sum(axis=1).max())]
    frames: Array = found.seeds[order]
    return frames
