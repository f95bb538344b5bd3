"""Planning from many starts: the best few grasps that differ, out of local searches all over the bounds."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, Unpack

import numpy as np

from graspforce._checks import finite_array, search_bounds
from graspforce._core import quality_many
from graspforce._optional import optional
from graspforce.display import plan_set_dict, plan_set_html
from graspforce.errors import GraspForceError, InvalidInputError

from .pattern_search import pattern_search
from .progress import Report, progress_bar
from .scoring import CandidateSource, EpsilonScore, Score

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from .pattern_search import Criterion, Feasible, GraspOptions, Plan, Stopped, Surface
    from .placement import Placement

    Array = NDArray[np.float64]

__all__ = ["PlanSet", "plan_many"]

# Draws by start before the search for feasible starts gives up.
_DRAWS = 50

_MAX_STARTS = 1_000_000

Starts: TypeAlias = "int | ArrayLike"


@dataclass(frozen=True, slots=True, eq=False)
class PlanSet:
    """The best distinct grasps of many searches.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    plans : tuple of Plan
        Best first; no two of them are within the distance that makes grasps the same.
    starts : numpy.ndarray
        (S, p) where searches began, in the order they ran: the most promising first.
    epsilon : numpy.ndarray
        (S,) where each of them ended; NaN where it failed or was not run.
    failures : dict of int to str
        Why searches failed, by row of `starts`.
    stopped : {"tolerance", "target", "time", "interrupted"}
        Whether all starts were searched, or why not.
    seconds : float
        How long it took.
    """

    plans: tuple[Plan, ...]
    starts: NDArray[np.float64]
    epsilon: NDArray[np.float64]
    failures: dict[int, str]
    stopped: Stopped
    seconds: float

    @property
    def best(self) -> Plan:
        """The best plan."""
        return self.plans[0]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain Python numbers and lists, ready for JSON."""
        return plan_set_dict(self)

    def _repr_html_(self) -> str:
        return plan_set_html(self)

    def __repr__(self) -> str:
        run = int(np.isfinite(self.epsilon).sum())
        return (
            f"PlanSet({len(self.plans)} plans, best epsilon={self.best.quality.epsilon:.6g}, "
            f"{run} of {len(self.starts)} starts, {self.seconds:.1f} s)"
        )


def plan_many(
    surface: Surface,
    bounds: ArrayLike,
    step: ArrayLike,
    tolerance: ArrayLike,
    criterion: Criterion = "max",
    *,
    starts: Starts = 200,
    best: int = 10,
    distinct: float | None = None,
    seed: int = 0,
    rtol: float | None = None,
    center: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    feasible: Feasible | None = None,
    min_distance: float = 0.0,
    placement: Placement | None = None,
    target: float | None = None,
    time_limit: float | None = None,
    max_candidates: int = 729,
    progress: bool | Report = False,
    **grasp_options: Unpack[GraspOptions],
) -> PlanSet:
    """Run the pattern search from many starts and keep the best few grasps that differ.

    Starts are drawn from a scrambled Halton sequence over the bounds, infeasible ones are replaced, and all
    are measured first, so that the most promising are searched first.

    Threads may call this at once as far as `surface` and `feasible` allow, which the calling thread calls.

    Parameters
    ----------
    surface, step, tolerance, criterion, rtol, center, metric
        As for `graspforce.plan`.
    feasible, min_distance, placement, max_candidates
        As for `graspforce.plan`.
    bounds : array_like
        (p, 2) finite lower and upper bounds, for the starts as for the searches.
    starts : int or array_like
        How many, or (S, p) the starts themselves.
    best : int
        How many distinct grasps to keep.
    distinct : float, optional
        Two grasps are the same where their contacts, matched with each other, are all within this many m; by
        default a fiftieth of the distance that contacts range over.
    seed : int
        Of the sequence: the same seed gives the same plans, whatever the machine.
    target, time_limit : float, optional
        Stop as soon as an epsilon reaches the target, or after this many seconds.
    progress : bool or callable
        Show a progress bar (needs rich), or call ``progress(done, total, epsilon)`` after every search with
        the best epsilon so far.
    **grasp_options
        As for `graspforce.plan`.

    Returns
    -------
    PlanSet
        At least one plan. A search that fails does not stop the others; Ctrl-C returns what was found.

    Raises
    ------
    InvalidInputError
        As for `graspforce.plan`; also where no start is feasible.
    InvalidGraspError
        As for `graspforce.plan`, where every start fails.
    MissingExtraError
        SciPy, or rich for the progress bar, is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> import graspforce as gf
    >>> from graspforce.surfaces import contacts_on, ellipse
    >>> egg = contacts_on(ellipse(0.05, 0.03), ellipse(0.05, 0.03), ellipse(0.05, 0.03))
    >>> found = gf.plan_many(
    ...     egg, [(0, 2 * np.pi)] * 3, step=0.5, tolerance=0.05, starts=8, best=3, length_scale=0.05
    ... )
    >>> len(found.plans), found.best.quality.closure
    (3, 'force')
    """
    if criterion not in ("max", "sum"):
        raise InvalidInputError(f"criterion: {criterion!r} is neither 'max' nor 'sum'")
    if best < 1:
        raise InvalidInputError(f"best: {best} must be at least 1")
    began = time.monotonic()
    deadline = None if time_limit is None else began + time_limit
    source = CandidateSource(surface, grasp_options, feasible, min_distance)
    question = {"criterion": criterion, "rtol": rtol, "center": center, "metric": metric}
    score: Score = EpsilonScore(prune=True, **question)
    if placement is not None:
        score = placement.score(question)
    points = _feasible_starts(source, bounds, starts, seed)
    order, reach = _ranked(source, points, question)
    points = points[order]
    epsilon = np.full(len(points), np.nan)
    plans: list[Plan] = []
    failures: dict[int, str] = {}
    first_error: GraspForceError | None = None
    stopped: Stopped = "tolerance"
    report: Any = progress if callable(progress) else None
    with contextlib.ExitStack() as stack:
        if progress is True:
            report = stack.enter_context(progress_bar("planning"))
        try:
            for row, start in enumerate(points):
                try:
                    found = pattern_search(
                        source,
                        score,
                        question,
                        start,
                        step,
                        tolerance,
                        bounds,
                        target,
                        deadline,
                        max_candidates,
                    )
                except GraspForceError as error:
                    failures[row] = str(error)
                    first_error = first_error or error
                    if error.partial is None:
                        continue
                    found = error.partial
                plans.append(found)
                epsilon[row] = -found.history[-1].rho
                if report is not None:
                    report(row + 1, len(points), float(np.nanmax(epsilon)))
                if found.stopped != "tolerance":
                    stopped = found.stopped
                    break
        except KeyboardInterrupt:
            if not plans:
                raise
            stopped = "interrupted"
    if not plans:
        raise first_error or InvalidInputError("starts: no search was run")
    plans.sort(key=lambda plan: plan.history[-1].rho)
    same = reach / 50 if distinct is None else distinct
    kept = _distinct(plans, best, same, interchangeable=_interchangeable(source))
    return PlanSet(tuple(kept), points, epsilon, failures, stopped, time.monotonic() - began)


def _feasible_starts(source: CandidateSource, bounds: ArrayLike, starts: Starts, seed: int) -> Array:
    box = finite_array("bounds", bounds)
    if box.ndim != 2 or box.shape[1:] != (2,):
        raise InvalidInputError(f"bounds: shape {box.shape}, expected (p, 2)")
    lower, upper = search_bounds(box, np.minimum(box[:, 0], box[:, 1]))
    if not isinstance(starts, int | np.integer):
        points = finite_array("starts", starts)
        if points.ndim != 2 or points.shape[1] != len(box) or not len(points):
            raise InvalidInputError(f"starts: shape {points.shape}, expected (S, {len(box)})")
        for point in points:
            search_bounds(box, point)
        return points
    if not 1 <= starts <= _MAX_STARTS:
        raise InvalidInputError(f"starts: {starts} must be within 1 to {_MAX_STARTS}")
    sequence = _halton(len(box), seed)
    kept: list[Array] = []
    drawn = 0
    while len(kept) < starts and drawn < _DRAWS * starts:
        points = lower + sequence.random(int(starts)) * (upper - lower)
        drawn += len(points)
        kept.extend(points[source.feasible(source.contacts(points))])
    if not kept:
        raise InvalidInputError(f"feasible: none of {drawn} starts all over the bounds was feasible")
    return np.array(kept[:starts])


def _halton(size: int, seed: int) -> Any:
    qmc = optional("scipy.stats", "search").qmc
    generator = np.random.default_rng(seed)
    try:
        return qmc.Halton(size, scramble=True, rng=generator)
    except TypeError:  # SciPy before 1.15
        return qmc.Halton(size, scramble=True, seed=generator)


def _ranked(
    source: CandidateSource, points: Array, question: dict[str, Any]
) -> tuple[NDArray[np.intp], float]:
    """Which starts to take first, and the distance in m that contacts range over."""
    contacts = source.contacts(points)
    coarse = {**question, "rtol": max(question["rtol"] or 0.0, 1e-2)}
    given: dict[str, Any] = {**source.options, **contacts}
    epsilon = quality_many(**given, **coarse).epsilon
    places = contacts["positions"].reshape(-1, contacts["positions"].shape[-1])
    # Rows that are no grasp go last; their searches will say why.
    order = np.argsort(-np.nan_to_num(epsilon, nan=-np.inf), kind="stable")
    return order, float(np.linalg.norm(np.ptp(places, axis=0)))


def _interchangeable(source: CandidateSource) -> bool:
    """Whether contacts may be matched in any order: they may where all have the same friction and limit."""
    values = [source.options.get(name, 1.0) for name in ("friction", "max_normal_force", "torsion")]
    return all(value is None or np.ptp(np.asarray(value, dtype=float)) == 0 for value in values)


def _distinct(plans: Sequence[Plan], best: int, same: float, *, interchangeable: bool) -> list[Plan]:
    kept: list[Plan] = []
    for plan in plans:
        if all(_distance(plan, other, interchangeable) > same for other in kept):
            kept.append(plan)
        if len(kept) == best:
            break
    return kept


def _distance(one: Plan, other: Plan, interchangeable: bool) -> float:
    """Largest distance in m between matched contacts of two grasps."""
    apart = np.linalg.norm(one.grasp.positions[:, None] - other.grasp.positions[None], axis=-1)
    if not interchangeable:
        return float(np.diagonal(apart).max())
    assignment = optional("scipy.optimize", "search").linear_sum_assignment
    return float(apart[assignment(apart)].max())
