"""Optimal grasp planning: the pattern search of section 3.4.

Python makes the candidates of an iteration. The core picks the best of them in one call. It rejects most by
the support function along directions that were critical before.
"""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Unpack

import numpy as np

from graspforce._internal.checks import finite_vector, real_number, search_bounds, whole_number
from graspforce.errors import GraspForceError, InvalidInputError

from .plan_result import Blocks, Iterate, Plan
from .problem import SearchProblem, deadline_after, read_only_copy
from .progress import Report, reporting

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce.typing import Criterion, Feasible, GraspOptions, Stopped, Surface

    from .placement_noise import PlacementNoise

    Array = NDArray[np.float64]


def plan(
    surface: Surface,
    initial: ArrayLike,
    step: ArrayLike,
    tolerance: ArrayLike,
    bounds: ArrayLike,
    criterion: Criterion = "max",
    *,
    rtol: float | None = None,
    external_wrench: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    feasible: Feasible | None = None,
    min_distance: float = 0.0,
    placement: PlacementNoise | None = None,
    target: float | None = None,
    time_limit: float | None = None,
    max_candidates: int = 729,
    prune: bool = True,
    progress: bool | Report = False,
    **grasp_options: Unpack[GraspOptions],
) -> Plan:
    r"""Search for the contact positions that minimise rho, by the OGP algorithm of section 3.4.

    Each iteration compares all combinations of every parameter one step down, unchanged and one step up,
    clipped to the bounds. It moves to the best and halves the step of each parameter that stayed. The search
    stops when every step is within its tolerance.

    Safe to call from several threads if `surface` and `feasible` are.

    Parameters
    ----------
    surface : callable
        Maps parameters (B, p) to positions (B, m, dim) in m and normals (B, m, dim) into the object, of any
        length. Spatial surfaces may return tangents (B, m, 3), too. See `graspforce.surfaces` for curves,
        surfaces, meshes and ties between contacts.
    initial : array_like
        (p,) parameters of the start, within the bounds.
    step, tolerance : array_like
        (p,) or scalar, positive: the first steps, and the steps at which the search ends. No tolerance may
        exceed its first step.
    bounds : array_like
        (p, 2) finite lower and upper bounds.
    criterion : {"max", "sum"}
        Normalised normal forces that are limited to 1: each of them (``rho_max``), or their sum
        (``rho_sum``).
    rtol, external_wrench, metric : optional
        As for `Grasp.quality`: the relative width of each bracket, the external wrench (d,) that always acts,
        and the norm of wrenches.
    feasible : callable, optional
        Maps positions and normals (B, m, dim) to (B,) bool, True for grasps that the hand can take. Only
        those are compared.
    min_distance : float
        Least distance between any two contacts, in m.
    placement : PlacementNoise, optional
        Compare grasps by their quality under this noise instead of the nominal one. The ``rho`` of the
        iterates is then that of the noisy grasps; `Plan.quality` stays nominal.
    target : float, optional
        Stop as soon as epsilon (``-rho``) reaches this value in N.
    time_limit : float, optional
        Stop after this many seconds, at the end of an iteration.
    max_candidates : int
        Largest number of candidates in one pattern. If all parameters together would make more, they move
        block by block; see `Plan.blocks`.
    prune : bool
        True rejects candidates that provably lose without computing their quality. False gives the same plan
        more slowly.
    progress : bool or callable
        True shows a progress bar (needs rich). A function is called as ``progress(done, total, epsilon)``
        after every iteration: how often the largest step, in units of its tolerance, was halved, how often it
        has to be, and the best epsilon so far.
    **grasp_options
        ``friction``, ``max_normal_force``, ``edges``, ``torsion``, ``tangents``, ``origin``,
        ``length_scale``, ``friction_margin`` and ``extreme_forces`` of `Grasp`.

    Returns
    -------
    Plan
        The best grasp found, its quality and the iterates. Ctrl-C ends the search and returns the best
        so far.

    Raises
    ------
    InvalidInputError
        An argument has the wrong shape or is not finite. A step or tolerance is not positive, or a tolerance
        exceeds its step. Bounds are
        reversed, or the start is outside them. The surface returns contacts that are not finite. No candidate
        is feasible. The error's attribute ``partial`` is the `Plan` found before it, or None.
    InvalidGraspError
        The contacts do not make a grasp, for example by a zero normal or a negative friction.

    Notes
    -----
    Section 3.4 leaves ties open. Here candidates are numbered with offsets in the order (-, 0, +), the last
    parameter fastest. Among those within 1e-9 (relative) of the best, the centre wins, else the lowest
    number. Step 2's upper offset reads :math:`\phi_i^{(k)} + \Delta\phi_i`. The end is a local optimum of the
    pattern: other starts and steps may end better (`graspforce.plan_multistart`).

    For any unit direction z, epsilon is at most the support function p(z). A direction that is critical for
    one candidate therefore bounds all others. A candidate is rejected only if it is proven worse than the
    best by more than ties, brackets and rounding leave open. Pruning changes nothing where brackets converge.

    Examples
    --------
    Two fingers squeeze a disc of radius 0.1 m; the search finds them opposite each other.

    >>> import numpy as np
    >>> import graspforce as gf
    >>> def disc(angles):
    ...     outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ...     return 0.1 * outward, -outward
    >>> found = gf.plan(disc, [0.0, 2.0], step=0.5, tolerance=1e-3, bounds=[(0, 1), (1, 4)], friction=0.6)
    >>> bool(abs(found.params[1] - found.params[0] - np.pi) < 2e-3)
    True
    >>> found.history[0].rho > 0 > found.quality.rho
    True
    """
    problem = SearchProblem.of(
        plan, surface, grasp_options, feasible, min_distance, placement=placement, prune=prune,
        criterion=criterion, rtol=rtol, external_wrench=external_wrench, metric=metric,
    )  # fmt: skip
    deadline = deadline_after(time_limit)
    with reporting(progress, "planning", "best epsilon") as report:
        return pattern_search(
            problem, initial, step, tolerance, bounds, target, deadline, max_candidates, report
        )


@dataclass(slots=True)
class _State:
    """Parameters, steps and iterates of a search."""

    center: NDArray[np.float64]
    steps: NDArray[np.float64]
    rho: float | None = None
    history: list[Iterate] = field(default_factory=list)


def pattern_search(
    problem: SearchProblem,
    initial: ArrayLike,
    step: ArrayLike,
    tolerance: ArrayLike,
    bounds: ArrayLike,
    target: float | None,
    deadline: float,
    max_candidates: int,
    report: Report | None = None,
) -> Plan:
    """Run the search of `plan`; `deadline` is a `time.monotonic` value."""
    source = problem.source
    center = finite_vector("initial", initial)
    steps = finite_vector("step", step, size=center.size, positive=True)
    tolerances = finite_vector("tolerance", tolerance, size=center.size, positive=True)
    if (tolerances > steps).any():
        at = int(np.argmax(tolerances > steps))
        raise InvalidInputError(f"tolerance, entry {at}: {tolerances[at]} exceeds the step {steps[at]}")
    halvings = _halvings(steps, tolerances)
    lower, upper = search_bounds(bounds, center)
    goal = np.inf if target is None else real_number("target", target, finite=False)
    # Fewer leave no room for the three candidates of one parameter.
    max_candidates = whole_number("max_candidates", max_candidates, least=3)
    blocks: Blocks = (tuple(range(center.size)),)
    if 3**center.size > max_candidates:
        num_contacts = source.contacts(center[None])["positions"].shape[1]
        blocks = _choose_blocks(center.size, num_contacts, max_candidates)

    state = _State(center, steps)
    stopped: Stopped = "tolerance"
    start = source.counts

    def result(stopped: Stopped) -> Plan:
        grasp, quality = problem.answer(state.center)
        history, criterion = tuple(state.history), problem.quality_options["criterion"]
        params, counts = read_only_copy(state.center), source.counts - start
        return Plan(params, quality, grasp, history, criterion, counts, blocks, stopped)

    try:
        while True:
            _sweep(state, problem, lower, upper, blocks)
            if report is not None:
                best = np.nan if state.rho is None else -state.rho
                report(halvings - _halvings(state.steps, tolerances), halvings, best)
            if np.all(state.steps <= tolerances):
                break
            if state.rho is not None and -state.rho >= goal:
                stopped = "target"
                break
            if time.monotonic() >= deadline:
                stopped = "time"
                break
    except KeyboardInterrupt:
        if state.rho is None:
            raise
        stopped = "interrupted"
    except GraspForceError as error:
        error.partial = result("error") if state.rho is not None else None
        raise
    if state.rho is None:
        tried = (source.counts - start).candidates
        raise InvalidInputError(
            f"{source.conditions}: refused all {tried} candidates; give another start or larger steps"
        )
    return result(stopped)


def _halvings(steps: Array, tolerances: Array) -> int:
    """How often all steps have to be halved to be within their tolerances."""
    return max(0, math.ceil(float((np.log2(steps) - np.log2(tolerances)).max())))


def _sweep(
    state: _State,
    problem: SearchProblem,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    blocks: Blocks,
) -> None:
    """One iterate: every block in turn moves to its best candidate."""
    before, center, rho = state.center, state.center, state.rho
    for block in blocks:
        candidates, at = _pattern(center, state.steps, lower, upper, block)
        choice = problem.source.best(candidates, at, rho, problem.score)
        if not state.history:
            first = np.inf if choice is None else choice.center_rho
            state.history.append(Iterate(read_only_copy(center), first, read_only_copy(state.steps)))
        if choice is not None:
            center, rho = candidates[choice.index].copy(), choice.rho
    state.steps = np.where(center == before, state.steps / 2, state.steps)
    state.center, state.rho = center, rho
    last = np.inf if rho is None else rho
    state.history.append(Iterate(read_only_copy(center), last, read_only_copy(state.steps)))


def _choose_blocks(num_params: int, num_contacts: int, max_candidates: int) -> Blocks:
    """Group variables so that no group's pattern has more than `max_candidates` candidates.

    All variables at once where their 3^p candidates fit; else the variables of each contact where parameters
    divide evenly among contacts; else as many neighbours as fit.

    Examples
    --------
    >>> from graspforce.planning.pattern_search import _choose_blocks
    >>> _choose_blocks(4, 4, 729)
    ((0, 1, 2, 3),)
    >>> _choose_blocks(8, 4, 729)
    ((0, 1), (2, 3), (4, 5), (6, 7))
    """
    if 3**num_params <= max_candidates:
        return (tuple(range(num_params)),)
    size, left_over = divmod(num_params, num_contacts)
    if left_over or 3**size > max_candidates:
        size = 1
        while 3 ** (size + 1) <= max_candidates:
            size += 1
    return tuple(tuple(range(start, min(start + size, num_params))) for start in range(0, num_params, size))


def _pattern(
    center: Array, steps: Array, lower: Array, upper: Array, block: tuple[int, ...]
) -> tuple[Array, int]:
    """All candidates (B, p) that move the block, last variable fastest, and which of them is the centre."""
    moving = list(block)
    here = center[moving]
    down = np.maximum(lower[moving], here - steps[moving])
    up = np.minimum(upper[moving], here + steps[moving])
    # At a bound, or where a step is lost to rounding, two offsets coincide and one candidate is enough.
    axes = [sorted(set(values)) for values in zip(down.tolist(), here.tolist(), up.tolist(), strict=True)]
    moves = np.array(list(itertools.product(*axes)))
    candidates = np.tile(center, (len(moves), 1))
    candidates[:, moving] = moves
    at = 0
    for axis, value in zip(axes, here.tolist(), strict=True):
        at = at * len(axis) + axis.index(value)
    return candidates, at
