"""Multistart planning: pattern searches from many starts within the bounds, and the best distinct grasps."""

from __future__ import annotations

import time
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias, Unpack, cast, get_args

import numpy as np

from graspforce._core import quality_many
from graspforce._internal.checks import bounds_array, finite_array, real_number, search_bounds, whole_number
from graspforce._internal.html import table, vector
from graspforce._internal.optional_imports import optional
from graspforce._internal.restored import expect, expect_array, expect_instance, expect_number, expect_tuple
from graspforce._internal.to_dict import Record
from graspforce.errors import GraspForceError, InvalidInputError
from graspforce.typing import Stopped

from .contacts_on_mesh import with_lengths
from .distinct import default_distance, distinct_plans, interchangeable_contacts
from .pattern_search import pattern_search
from .plan_result import Plan
from .problem import SearchProblem, deadline_after, read_only_copy
from .progress import Report, reporting

if TYPE_CHECKING:
    import os

    from numpy.typing import ArrayLike, NDArray

    from graspforce.surfaces import MeshSurface
    from graspforce.typing import Criterion, Feasible, GraspOptions, Surface

    from .candidates import CandidateSource
    from .placement_noise import PlacementNoise

    Array = NDArray[np.float64]

# Draws by start before the search for feasible starts gives up.
_DRAWS = 50

_MAX_STARTS = 1_000_000

Starts: TypeAlias = "int | ArrayLike"


@dataclass(frozen=True, slots=True, eq=False)
class PlanSet(Record):
    """The best distinct grasps of searches from many starts.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    plans : tuple of Plan
        The plans, best first. Any two differ by more than the argument `distinct`.
    starts : numpy.ndarray
        (S, p) starts in the order of the searches: the start of the best quality first.
    epsilon : numpy.ndarray
        (S,) best epsilon that each search found, also if it failed later. NaN if it found nothing or was not
        run.
    failures : dict of int to str
        Errors of failed searches by row of `starts`. What a search found before its error counts.
    stopped : {"tolerance", "target", "time", "interrupted"}
        Why planning ended: "tolerance" if all searches were run to their ends.
    seconds : float
        Duration in s.
    """

    plans: tuple[Plan, ...]
    starts: NDArray[np.float64]
    epsilon: NDArray[np.float64]
    failures: dict[int, str]
    stopped: Stopped
    seconds: float

    def _check(self) -> None:
        expect_tuple("plans", self.plans, Plan)
        expect(self.plans, "plans", "one or more")
        expect_array("starts", self.starts, (None, self.plans[0].params.size))
        rows = len(self.starts)
        expect(
            all(plan.params.shape == self.starts.shape[1:] for plan in self.plans),
            "plans",
            "as many parameters as the starts",
        )
        expect_array("epsilon", self.epsilon, (rows,), finite=False)
        expect(not np.isinf(self.epsilon).any(), "epsilon", "finite numbers or NaN")
        expect_instance("failures", self.failures, MappingProxyType)
        for row, reason in self.failures.items():
            expect(type(row) is int and 0 <= row < rows, "failures", "rows of the starts")
            expect_instance("failures", reason, str)
        expect(self.stopped in get_args(Stopped), "stopped", "a reason")
        expect_number("seconds", self.seconds, least=0)

    @property
    def best(self) -> Plan:
        """The best plan."""
        return self.plans[0]

    def _repr_html_(self) -> str:
        rows = (
            (str(k), f"{plan.quality.epsilon:.6g}", plan.quality.closure, vector(plan.params))
            for k, plan in enumerate(self.plans)
        )
        return table(repr(self), ("plan", "epsilon", "closure", "parameters"), rows)

    def __repr__(self) -> str:
        run = int(np.isfinite(self.epsilon).sum())
        return (
            f"PlanSet({len(self.plans)} plans, best epsilon={self.best.quality.epsilon:.6g}, "
            f"{run} of {len(self.starts)} starts, {self.seconds:.1f} s)"
        )


def plan_multistart(
    surface: Surface | MeshSurface | str | os.PathLike[str] | Any,
    bounds: ArrayLike | None = None,
    step: ArrayLike | None = None,
    tolerance: ArrayLike | None = None,
    criterion: Criterion = "max",
    *,
    starts: Starts = 200,
    best: int = 10,
    distinct: float | None = None,
    seed: int = 0,
    rtol: float | None = None,
    external_wrench: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    feasible: Feasible | None = None,
    min_distance: float | None = None,
    placement: PlacementNoise | None = None,
    target: float | None = None,
    time_limit: float | None = None,
    max_candidates: int = 729,
    contacts: int | None = None,
    progress: bool | Report = False,
    **grasp_options: Unpack[GraspOptions],
) -> PlanSet:
    """Run the pattern search from many starts and keep the best distinct grasps.

    Starts are drawn from a scrambled Halton sequence over the bounds; infeasible ones are drawn again. The
    searches run in the order of their starts' quality, best first.

    Safe to call from several threads if `surface` and `feasible` are.

    Parameters
    ----------
    surface, step, tolerance, criterion, rtol, external_wrench, metric
        As for `graspforce.plan`. With `contacts` the surface is a mesh: a `MeshSurface`, or what it takes.
    feasible, min_distance, placement, max_candidates
        As for `graspforce.plan`.
    bounds : array_like
        (p, 2) finite lower and upper bounds of the starts and of the searches.
    starts : int or array_like
        Number of starts, or (S, p) the starts themselves. A drawn start without finite contacts is drawn
        again; a given one makes its search fail.
    best : int
        Largest number of distinct grasps to keep.
    distinct : float, optional
        Distance in m. Two grasps are the same if each contact of one is within it of its match in the other.
        By default it is a fiftieth of the extent of all contacts.
    seed : int
        Seed of the sequence. The same seed gives the same plans on every machine.
    target, time_limit : float, optional
        Stop as soon as an epsilon in N reaches the target, or after this many seconds.
    contacts : int, optional
        Number of contacts anywhere on a mesh. All other lengths then have defaults from its largest extent:
        `step` a fifth, `tolerance` a tenth of the step, `min_distance` a twentieth, ``length_scale`` half of
        it. `bounds` are the mesh's box, and ``origin`` is its centre of mass.
    progress : bool or callable
        True shows a progress bar (needs rich). A function is called as ``progress(done, total, epsilon)``
        after every search, with the best epsilon so far.
    **grasp_options
        As for `graspforce.plan`.

    Returns
    -------
    PlanSet
        At least one plan. A search that fails does not stop the others. Ctrl-C returns what was found.

    Raises
    ------
    InvalidInputError
        As for `graspforce.plan`. Also if no start is feasible.
    InvalidGraspError
        As for `graspforce.plan`, if every search fails.
    MissingExtraError
        SciPy, or rich for the progress bar, is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> import graspforce as gf
    >>> from graspforce.surfaces import contacts_on, ellipse
    >>> egg = contacts_on(ellipse(0.05, 0.03), ellipse(0.05, 0.03), ellipse(0.05, 0.03))
    >>> found = gf.plan_multistart(
    ...     egg, [(0, 2 * np.pi)] * 3, step=0.5, tolerance=0.05, starts=8, best=3, length_scale=0.05
    ... )
    >>> len(found.plans), found.best.quality.closure
    (3, 'force')

    Contacts anywhere on a mesh:

    >>> import trimesh
    >>> can = trimesh.creation.cylinder(radius=0.03, height=0.1)
    >>> gf.plan_multistart(can, contacts=3, starts=3, best=1).best.quality.closure
    'force'
    """
    surface, bounds, step, tolerance, min_distance, grasp_options = with_lengths(
        surface, contacts, bounds, step, tolerance, min_distance, grasp_options
    )
    best = whole_number("best", best, least=1)
    seed = whole_number("seed", seed, least=0)
    if distinct is not None:
        distinct = real_number("distinct", distinct, least=0, finite=False)
    began = time.monotonic()
    deadline = deadline_after(time_limit)
    problem = SearchProblem.of(
        plan_multistart, surface, grasp_options, feasible, min_distance, placement=placement,
        criterion=criterion, rtol=rtol, external_wrench=external_wrench, metric=metric,
    )  # fmt: skip
    points = _feasible_starts(problem.source, bounds, starts, seed)
    order, near = ranked(problem, points)
    points = points[order]
    epsilon = np.full(len(points), np.nan)
    plans: list[Plan] = []
    failures: dict[int, str] = {}
    first_error: GraspForceError | None = None
    stopped: Stopped = "tolerance"
    with reporting(progress, "planning", "best epsilon") as report:
        try:
            for row, start in enumerate(points):
                found: Plan | None
                try:
                    found = pattern_search(
                        problem, start, step, tolerance, bounds, target, deadline, max_candidates
                    )
                except GraspForceError as error:
                    failures[row] = str(error)
                    first_error = first_error or error
                    found = cast("Plan | None", error.partial)
                if found is not None:
                    plans.append(found)
                    epsilon[row] = -found.history[-1].rho
                if report is not None:
                    best_so_far = float(np.nanmax(epsilon)) if plans else np.nan
                    report(row + 1, len(points), best_so_far)
                if found is not None and found.stopped not in ("tolerance", "error"):
                    stopped = found.stopped
                    break
        except KeyboardInterrupt:
            if not plans:
                raise
            stopped = "interrupted"
    if not plans:
        raise first_error or InvalidInputError("starts: no search was run")
    plans.sort(key=lambda plan: plan.history[-1].rho)
    same = near if distinct is None else distinct
    kept = distinct_plans(plans, best, same, interchangeable=interchangeable_contacts(problem.source))
    seconds = time.monotonic() - began
    return PlanSet(tuple(kept), read_only_copy(points), read_only_copy(epsilon), failures, stopped, seconds)


def _feasible_starts(source: CandidateSource, bounds: ArrayLike, starts: Starts, seed: int) -> Array:
    box = bounds_array(bounds)
    lower, upper = search_bounds(box, np.minimum(box[:, 0], box[:, 1]))
    if not isinstance(starts, int | np.integer):
        points = finite_array("starts", starts)
        if points.ndim == 0:
            raise InvalidInputError(
                f"starts: {starts!r} is neither a whole number nor an array (S, {len(box)})"
            )
        if points.ndim != 2 or points.shape[1] != len(box) or not len(points):
            raise InvalidInputError(f"starts: shape {points.shape}, expected (S, {len(box)})")
        for row, point in enumerate(points):
            search_bounds(box, point, f"starts, row {row}")
        return points
    starts = whole_number("starts", starts, least=1, most=_MAX_STARTS)
    sequence = _halton(len(box), seed)
    kept: list[Array] = []
    drawn = 0
    failure: GraspForceError | None = None
    while len(kept) < starts and drawn < _DRAWS * starts:
        points = lower + sequence.random(starts) * (upper - lower)
        drawn += len(points)
        contacts, failed = source.answered(points)
        if failed:
            failure = failure or next(iter(failed.values()))
            points = np.delete(points, list(failed), axis=0)
        if len(points):
            kept.extend(points[source.feasible(contacts)])
    if not kept:
        message = f"starts: all {drawn} drawn within the bounds were refused"
        message += f" by {source.conditions}" if source.conditions else ""
        message += f"; the surface has no contacts at some: {failure}" if failure else ""
        raise InvalidInputError(message) from failure
    return np.array(kept[:starts])


def _halton(size: int, seed: int) -> Any:
    qmc = optional("scipy.stats", "search").qmc
    generator = np.random.default_rng(seed)
    try:
        return qmc.Halton(size, scramble=True, rng=generator)
    except TypeError:  # SciPy before 1.15
        return qmc.Halton(size, scramble=True, seed=generator)


def ranked(problem: SearchProblem, points: Array) -> tuple[NDArray[np.intp], float]:
    """Return the order of the starts, and the distance in m up to which two grasps are the same."""
    contacts, failed = problem.source.answered(points)
    # Rows that are no grasp go last; their searches will say why.
    epsilon = np.full(len(points), -np.inf)
    if not contacts:
        return np.arange(len(points)), 0.0
    rtol = problem.quality_options["rtol"]
    coarse = {
        **problem.quality_options,
        "rtol": 1e-2 if rtol is None else max(real_number("rtol", rtol), 1e-2),
    }
    given: dict[str, Any] = {**problem.source.options, **contacts}
    answered = np.delete(np.arange(len(points)), list(failed))
    epsilon[answered] = np.nan_to_num(quality_many(**given, **coarse).epsilon, nan=-np.inf)
    return np.argsort(-epsilon, kind="stable"), default_distance(contacts["positions"])
