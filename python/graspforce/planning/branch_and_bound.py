"""Branch and bound: the best grasp within a box of a few parameters, with a certified gap.

The core (`BoxBound`) bounds a box by two terms. The first is the quality of the hull of the wrench sets at
the box's vertices. The second covers the interpolation between vertices: half the curvature of the primitive
wrenches times the squares of the box's half-widths. The bound is a proof if the caller gives the curvature.
By default the curvature of each box is estimated by second differences along its axes, times `safety`. A bump
that is narrow against the box escapes them: such a bound is an estimate, and the result says so.
"""

from __future__ import annotations

import heapq
import itertools
import time
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from graspforce._core import BoxBound
from graspforce._internal.checks import (
    bounds_array,
    finite_array,
    finite_vector,
    real_number,
    search_bounds,
    whole_number,
)
from graspforce._internal.vectors import unit
from graspforce.errors import GraspForceError, InvalidGraspError, InvalidInputError

from .global_optimum import GlobalOptimum
from .problem import SearchProblem, deadline_after, read_only_copy
from .progress import Report, reporting

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp
    from graspforce.typing import Criterion, Feasible, GraspOptions, Surface

    from .candidates import CandidateSource
    from .global_optimum import Ended

    Array = NDArray[np.float64]

_MAX_PARAMS = 4
_BATCH = 64  # boxes split between two looks at the clock: enough for all cores
_OPEN = 1e-6  # of the longest wrench of a normal force: an epsilon below it is none


def plan_global(
    surface: Surface,
    bounds: ArrayLike,
    criterion: Criterion = "max",
    *,
    gap: float = 0.01,
    initial: ArrayLike | None = None,
    curvature: ArrayLike | None = None,
    safety: float = 1.5,
    rtol: float | None = None,
    external_wrench: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    feasible: Feasible | None = None,
    min_distance: float = 0.0,
    max_boxes: int = 1_000_000,
    time_limit: float | None = None,
    progress: bool | Report = False,
    **grasp_options: Unpack[GraspOptions],
) -> GlobalOptimum:
    """Find the globally best grasp for up to four parameters, by branch and bound.

    Safe to call from several threads if `surface` and `feasible` are.

    Parameters
    ----------
    surface, criterion, rtol, external_wrench, metric, feasible, min_distance, **grasp_options
        As for `graspforce.plan`. The contact frames must vary smoothly: where the default tangents switch
        axes (normals with ``|n_x|`` about 0.7), give ``tangents``.
    bounds : array_like
        (p, 2) finite lower and upper bounds, p at most 4.
    gap : float
        Stop when the relative gap between the best grasp and the upper bound is this small. The gap is a
        proof with `curvature` and an estimate without.
    initial : array_like, optional
        (p,) parameters of a good grasp, such as `Plan.params`. The search starts with this quality as the
        incumbent; by default it starts in the middle of the bounds.
    curvature : array_like, optional
        (m, p) upper bounds of the norms of the second derivatives of contact i's primitive wrenches by
        parameter j, valid everywhere within the bounds. They make the result a proof. By default the
        curvature of each box is estimated, and the result ends as an "estimate".
    safety : float
        Factor of the estimated curvature: it multiplies the largest second difference along the box's axes.
    max_boxes : int
        Largest number of boxes to bound.
    time_limit : float, optional
        Stop after this many seconds and return the gap reached.
    progress : bool or callable
        Show a progress bar (needs rich), or call ``progress(boxes, max_boxes, upper)``.

    Returns
    -------
    GlobalOptimum
        The best grasp found. Its ``epsilon_upper`` is proven if ``proven`` is True. Ctrl-C ends the search
        and returns the result so far.

    Raises
    ------
    InvalidInputError
        As for `graspforce.plan`, with a `GlobalOptimum` as ``partial``. Also if there are more than four
        parameters, or if the search met no feasible grasp.
    InvalidGraspError
        As for `graspforce.plan`.

    Examples
    --------
    Three fingers on a disc, one of them fixed: by estimate, nothing beats the equilateral triangle by more
    than 1%.

    >>> import numpy as np
    >>> import graspforce as gf
    >>> def disc(angles):
    ...     angles = np.column_stack([np.zeros(len(angles)), angles])
    ...     outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ...     return outward, -outward
    >>> found = gf.plan_global(disc, [(0.5, 3.0), (3.2, 6.0)], friction=0.3)
    >>> found.gap <= 0.01, found.stopped, found.proven
    (True, 'estimate', False)

    Wrenches of a contact on the unit circle turn about the origin: their second derivatives are as long as
    their forces, which makes the bound a proof.

    >>> import math
    >>> bends = [[0, 0], [math.hypot(1, 0.3), 0], [0, math.hypot(1, 0.3)]]
    >>> gf.plan_global(disc, [(0.5, 3.0), (3.2, 6.0)], friction=0.3, curvature=bends).stopped
    'tolerance'
    """
    box = bounds_array(bounds)
    if not 1 <= len(box) <= _MAX_PARAMS:
        raise InvalidInputError(
            f"bounds: {len(box)} parameters, 1 to {_MAX_PARAMS} are possible; fix some of them, or use "
            "graspforce.plan_multistart"
        )
    middle = box[:, 0] / 2 + box[:, 1] / 2
    start = middle if initial is None else finite_vector("initial", initial, len(box))
    lower, upper = search_bounds(box, start)
    if not 0 < real_number("gap", gap) < 1:
        raise InvalidInputError(f"gap: {gap} must lie between 0 and 1")
    safety = real_number("safety", safety, least=1)
    max_boxes = whole_number("max_boxes", max_boxes, least=1)
    began = time.monotonic()
    deadline = deadline_after(time_limit)
    problem = SearchProblem.of(
        plan_global, surface, grasp_options, feasible, min_distance,
        criterion=criterion, rtol=rtol, external_wrench=external_wrench, metric=metric,
    )  # fmt: skip
    source = problem.source
    first = source.grasp(start)
    bends = None
    if curvature is not None:
        bends = finite_array("curvature", curvature)
        if bends.shape != (first.num_contacts, len(box)) or (bends < 0).any():
            expected = (first.num_contacts, len(box))
            raise InvalidInputError(
                f"curvature: shape {bends.shape}, expected {expected} of nonnegative numbers"
            )
    tree = _Tree(problem, first, bends, safety, _rates(source, lower, upper))

    def result(stopped: Ended) -> GlobalOptimum | None:
        if tree.best is None:
            return None
        grasp, quality = problem.answer(tree.best)
        top = max(tree.top, quality.epsilon)
        proven = bends is not None
        ended: Ended = "estimate" if stopped in ("tolerance", "open") and not proven else stopped
        return GlobalOptimum(
            read_only_copy(tree.best), quality, grasp, top, _relative(top, quality.epsilon), tree.boxes,
            proven, ended, time.monotonic() - began,
        )  # fmt: skip

    try:
        with reporting(progress, "bounding", "upper bound of epsilon") as report:
            stopped = tree.run(start, lower, upper, gap, max_boxes, deadline, report)
    except GraspForceError as error:
        error.partial = result("error")
        raise
    found = result(stopped)
    if found is None:
        raise InvalidInputError(f"{source.conditions}: refused all {source.counts.candidates} grasps tried")
    return found


class _Tree:
    """Boxes not yet discarded, the largest bound first."""

    def __init__(
        self, problem: SearchProblem, first: Grasp, bends: Array | None, safety: float, rates: Array
    ) -> None:
        self._source, self._score = problem.source, problem.score
        self._bends, self._safety, self._rates = bends, safety, rates
        self._sum = problem.quality_options["criterion"] == "sum"
        options = {name: value for name, value in problem.quality_options.items() if name != "rtol"}
        self._bound = BoxBound(first.positions.shape[1], **options)
        self._open = _OPEN * _scale(first, problem.quality_options["metric"])
        self.best: Array | None = None
        self._rho: float | None = None
        # Bounds are negated: heapq pops the least.
        self._heap: list[tuple[float, int, Array, Array]] = []
        self._serial = itertools.count()
        self._discarded = -np.inf
        self.boxes = 0

    @property
    def epsilon(self) -> float:
        """The best found so far."""
        return -np.inf if self._rho is None else -self._rho

    @property
    def top(self) -> float:
        """No parameters exceed it."""
        return max(-self._heap[0][0] if self._heap else -np.inf, self._discarded)

    def run(
        self,
        start: Array,
        lower: Array,
        upper: Array,
        gap: float,
        max_boxes: int,
        deadline: float,
        report: Report | None,
    ) -> Ended:
        # Nothing is known of the whole box before it is bounded.
        popped = [(-np.inf, next(self._serial), lower, upper)]
        try:
            self._try(start[None])
            self._offer(lower[None], upper[None], gap)
            popped = []
            while self._heap and -self._heap[0][0] > max(self._enough(gap), self._discarded):
                if self.top <= self._open:
                    return "open"
                if time.monotonic() >= deadline:
                    return "time"
                if self.boxes >= max_boxes:
                    return "boxes"
                # One by one into a list that is there already: an interrupt between two loses none.
                for _ in range(min(_BATCH, len(self._heap))):
                    popped.append(self._heap[0])
                    heapq.heappop(self._heap)
                low, high = self._halves(popped)
                if len(low):
                    self._try((low + high) / 2)
                    self._offer(low, high, gap)
                popped = []
                if report is not None:
                    report(self.boxes, max_boxes, self.top)
        except BaseException as error:
            for entry in popped:
                heapq.heappush(self._heap, entry)
            if isinstance(error, KeyboardInterrupt) and self.best is not None:
                return "interrupted"
            raise
        if self.top <= self._enough(gap):
            return "tolerance"
        return "open" if self.top <= self._open else "boxes"

    def _enough(self, gap: float) -> float:
        return self.epsilon + gap * abs(self.epsilon) if self.best is not None else -np.inf

    def _halves(self, boxes: list[tuple[float, int, Array, Array]]) -> tuple[Array, Array]:
        """Cut each box where the wrenches change most across it; what is too small to be cut is discarded."""
        low, high = (np.array([box[side] for box in boxes]) for side in (2, 3))
        between = (low < (low + high) / 2) & ((low + high) / 2 < high)
        can = between.any(axis=1)
        self._discarded = max(
            [self._discarded, *(-box[0] for box, cut in zip(boxes, can, strict=True) if not cut)]
        )
        low, high = low[can], high[can]
        axis = np.argmax(np.where(between[can], (high - low) * self._rates, -1.0), axis=1)
        rows = np.arange(len(low))
        middle = (low[rows, axis] + high[rows, axis]) / 2
        first_high, second_low = high.copy(), low.copy()
        first_high[rows, axis] = middle
        second_low[rows, axis] = middle
        return np.concatenate([low, second_low]), np.concatenate([first_high, high])

    def _try(self, params: Array) -> None:
        """Whether one of these grasps is better than the best."""
        if self.best is not None:
            params = np.vstack([self.best, params])
        choice = self._source.best(params, 0, self._rho, self._score)
        if choice is not None and (self._rho is None or choice.rho < self._rho):
            self.best, self._rho = params[choice.index], choice.rho

    def _offer(self, low: Array, high: Array, gap: float) -> None:
        """Bound boxes and keep those that may hold something better."""
        self.boxes += len(low)
        axes = low.shape[1]
        rows = np.array(list(itertools.product((-1.0, 1.0), repeat=axes)))
        options: dict[str, Any] = {"enough": self._enough(gap)}
        if self._bends is None:
            arms = np.kron(np.eye(axes), np.array([[-1.0], [-0.5], [0.5], [1.0]]))
            rows = np.vstack([rows, np.zeros(axes), arms])
            options |= {"axes": axes, "safety": self._safety}
            slack = np.full(len(low), np.finfo(float).max)
        else:
            slack = 0.5 * ((high - low) / 2) ** 2 @ self._bends.T
            slack = slack.max(axis=1) if self._sum else slack.sum(axis=1)
        center, half = (low + high) / 2, (high - low) / 2
        params = (center[:, None] + rows * half[:, None]).reshape(-1, axes)
        # Rounding must not carry a vertex over the bounds, where the surface may end.
        params = np.clip(params, np.repeat(low, len(rows), axis=0), np.repeat(high, len(rows), axis=0))
        given: dict[str, Any] = {**self._source.options, **self._source.contacts(params)}
        try:
            bounds = self._bound.over(slack, **given, **options)
        except InvalidGraspError as error:
            if error.row is None:
                raise
            where = params[error.row].tolist()
            raise InvalidGraspError(f"surface, parameters {where}: {error}") from error
        for bound, box_low, box_high in zip(bounds.tolist(), low, high, strict=True):
            if bound > self._enough(gap):
                heapq.heappush(self._heap, (-bound, next(self._serial), box_low, box_high))
            else:
                self._discarded = max(self._discarded, bound)


def _relative(top: float, epsilon: float) -> float:
    """Return by which share of epsilon the upper bound exceeds it."""
    if top == epsilon:
        return 0.0
    return (top - epsilon) / abs(epsilon) if epsilon else np.inf


def _scale(grasp: Grasp, metric: ArrayLike | None) -> float:
    """Norm of the longest wrench that a normal force at its limit exerts."""
    wrenches = grasp.grasp_matrix[:, :: grasp.force_dim] * grasp.max_normal_force
    if metric is None:
        num_forces = grasp.positions.shape[1]
        wrenches[num_forces:] /= grasp.length_scale
        return float(np.linalg.norm(wrenches, axis=0).max())
    return float(np.sqrt((wrenches * (np.asarray(metric, dtype=np.float64) @ wrenches)).sum(axis=0)).max())


def _rates(source: CandidateSource, lower: Array, upper: Array) -> Array:
    """How much contacts move and turn by each parameter (p,): only the order of cuts depends on it."""
    width = upper - lower
    # Uneven, and along three lines: two places would be the same one of a periodic or an even parameter.
    shares = (1 - np.cos(np.linspace(0, np.pi, 10))) / 2
    rates = np.zeros(len(lower))
    for axis in range(len(lower)):
        lines = np.repeat(lower + np.outer([0.21, 0.5, 0.83], width), len(shares), axis=0)
        lines[:, axis] = lower[axis] + np.tile(shares, 3) * width[axis]
        # Rounding must not carry the last of them over the bounds, where the surface may end.
        contacts = source.contacts(np.clip(lines, lower, upper))
        positions = contacts["positions"]
        size = max(float(np.ptp(positions, axis=(0, 1)).max()), np.finfo(float).tiny)
        ends = np.concatenate([positions / size, unit(contacts["normals"])], axis=-1)
        changes = np.diff(ends.reshape(3, len(shares), -1), axis=1)
        way = float(np.linalg.norm(changes, axis=-1).sum())
        rates[axis] = way / max(width[axis], np.finfo(float).tiny)
    rates += 1e-3 * rates.max()
    return rates
