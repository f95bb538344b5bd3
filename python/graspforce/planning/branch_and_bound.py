"""Branch and bound: the best grasp within a box of a few parameters, with a certified gap.

The bound of a box is derived in the core (`BoxBound`): the quality of the hull of the wrench sets at the
box's vertices, plus what interpolation between vertices leaves open, half the curvature of the primitive
wrenches times the squares of the box's half-widths. The certificate is therefore as good as the curvature:
bounds that the caller derived make it a proof. By default the curvature of each box is estimated by second
differences along its axes, and the certificate holds on the assumption that nowhere in a box the wrenches
bend more than `safety` times that. A bump that is narrow against a box breaks the assumption unseen: such a
bound is an estimate, and the result says so.
"""

from __future__ import annotations

import heapq
import itertools
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, Unpack

import numpy as np

from graspforce._core import BoxBound
from graspforce._internal.checks import finite_array, finite_vector, real_number, search_bounds, whole_number
from graspforce._internal.to_dict import Record
from graspforce._internal.vectors import unit
from graspforce.errors import GraspForceError, InvalidGraspError, InvalidInputError

from .pattern_search import deadline_after
from .problem import SearchProblem, read_only
from .progress import Report, reporting

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp, Quality
    from graspforce.typing import Criterion, Feasible, GraspOptions, Surface

    from .candidates import CandidateSource

    Array = NDArray[np.float64]

__all__ = ["GlobalOptimum", "plan_global"]

_MAX_PARAMS = 4
_BATCH = 64  # boxes split between two looks at the clock: enough for all cores
_OPEN = 1e-6  # of the longest wrench of a normal force: an epsilon below it is none

Ended: TypeAlias = Literal["tolerance", "open", "estimate", "boxes", "time", "interrupted", "error"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GlobalOptimum(Record):
    """The best grasp found, and how much better any other can be.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the best grasp found.
    quality, grasp : Quality, Grasp
        What it is worth.
    epsilon_upper : float
        Upper bound of the epsilon of all parameters within the bounds: proven where `proven` is True,
        otherwise an estimate, which better grasps can exceed.
    gap : float
        ``(epsilon_upper - quality.epsilon) / abs(quality.epsilon)``, relative as the argument; infinite where
        epsilon is zero and its bound is not.
    boxes : int
        How many boxes were bounded.
    proven : bool
        True: the caller gave the curvature, and `epsilon_upper` is a proof. False: it was estimated.
    stopped : {"tolerance", "open", "estimate", "boxes", "time", "interrupted", "error"}
        Why the search ended. "tolerance": the gap is proven to be as small as asked for. "open": proven, no
        grasp within the bounds is force closure by more than a millionth of the contacts' strength.
        "estimate": one of the two by an estimated curvature, which is no proof; `epsilon_upper` and `gap` are
        then estimates. "boxes": their limit was reached, or none is left that could be cut. "error": in what
        an error carries as its ``partial``.
    seconds : float
        How long it took.
    """

    params: NDArray[np.float64]
    quality: Quality
    grasp: Grasp
    epsilon_upper: float
    gap: float
    boxes: int
    proven: bool
    stopped: Ended
    seconds: float

    def __repr__(self) -> str:
        upper = f"{self.epsilon_upper:.6g} ({'proven' if self.proven else 'estimate'})"
        return (
            f"GlobalOptimum(epsilon={self.quality.epsilon:.6g}, epsilon_upper={upper}, "
            f"stopped={self.stopped!r}, boxes={self.boxes}, {self.seconds:.1f} s)"
        )


def plan_global(
    surface: Surface,
    bounds: ArrayLike,
    criterion: Criterion = "max",
    *,
    gap: float = 0.01,
    initial: ArrayLike | None = None,
    curvature: ArrayLike | None = None,
    safety: float = 1.5,
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

    Threads may call this at once as far as `surface` and `feasible` allow, which the calling thread calls.

    Parameters
    ----------
    surface, criterion, external_wrench, metric, feasible, min_distance, **grasp_options
        As for `graspforce.plan`. The contact frames must vary smoothly: where the default tangents switch
        axes (normals with ``|n_x|`` about 0.7), give ``tangents``.
    bounds : array_like
        (p, 2) finite lower and upper bounds, p at most 4.
    gap : float
        Stop when nothing can be better than the best by more than this share of it: by proof with
        `curvature`, by estimate without.
    initial : array_like, optional
        (p,) a good grasp to start from, such as `Plan.params`: nothing worse is looked at closely.
    curvature : array_like, optional
        (m, p) bounds of the norms of the second derivatives of contact i's primitive wrenches by parameter j,
        all over the bounds. Given, they make the result a proof. By default each box's is estimated, and the
        result ends as an "estimate".
    safety : float
        The estimate is this times the largest second difference along the box's axes.
    max_boxes : int
        Bound on the work.
    time_limit : float, optional
        Stop after this many seconds, with the gap reached.
    progress : bool or callable
        Show a progress bar (needs rich), or call ``progress(boxes, max_boxes, upper)``.

    Returns
    -------
    GlobalOptimum
        Its ``epsilon_upper`` bounds every epsilon within the bounds where ``proven`` is True. Ctrl-C returns
        the gap reached.

    Raises
    ------
    InvalidInputError
        As for `graspforce.plan`, with a `GlobalOptimum` as ``partial``; or more than four parameters, or
        nothing feasible was met.
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
    box = finite_array("bounds", bounds)
    if box.ndim != 2 or box.shape[1:] != (2,) or not len(box):
        raise InvalidInputError(f"bounds: shape {box.shape}, expected (p, 2)")
    if len(box) > _MAX_PARAMS:
        raise InvalidInputError(
            f"bounds: {len(box)} parameters, but boxes are bounded by their 2^p vertices for up to "
            f"{_MAX_PARAMS}"
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
        surface, grasp_options, feasible, min_distance,
        criterion=criterion, external_wrench=external_wrench, metric=metric,
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
            read_only(tree.best), quality, grasp, top, _relative(top, quality.epsilon), tree.boxes, proven,
            ended, time.monotonic() - began,
        )  # fmt: skip

    try:
        with reporting(progress, "bounding", "no epsilon exceeds") as report:
            stopped = tree.run(start, lower, upper, gap, max_boxes, deadline, report)
    except GraspForceError as error:
        error.partial = result("error")
        raise
    found = result(stopped)
    if found is None:
        raise InvalidInputError(f"feasible: none of the {source.counts.candidates} grasps met was feasible")
    return found


class _Tree:
    """Boxes not yet discarded, the largest bound first."""

    def __init__(
        self, problem: SearchProblem, first: Grasp, bends: Array | None, safety: float, rates: Array
    ) -> None:
        self._source, self._score = problem.source, problem.score
        self._bends, self._safety, self._rates = bends, safety, rates
        self._sum = problem.question["criterion"] == "sum"
        self._bound = BoxBound(first.positions.shape[1], **problem.question)
        self._open = _OPEN * _scale(first, problem.question["metric"])
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
