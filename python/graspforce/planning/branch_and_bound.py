"""Branch and bound: the best grasp within a box of a few parameters, or on meshes, with a certified gap.

Bounds of boxes need the curvature of wrenches. It follows from formulas for the curves and surfaces of
`graspforce.surfaces`, and the caller may give it for others; both make the bound a proof. Otherwise the
curvature of each box is estimated by second differences along its axes, times `safety`. A bump that is narrow
against the box escapes them: such a bound is an estimate, and the result says so. Meshes with face normals
need no curvature.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Unpack

import numpy as np

from graspforce._internal.checks import (
    bounds_array,
    finite_vector,
    real_number,
    search_bounds,
    whole_number,
)
from graspforce.errors import GraspForceError, InvalidInputError

from .box_tree import BoxTree
from .contact_groups import contact_groups
from .contact_wrenches import ContactWrenches
from .face_products import FaceProducts, meshes_of
from .global_optimum import GlobalOptimum
from .incumbent import Incumbent
from .multistart import plan_multistart, ranked
from .problem import SearchProblem, deadline_after, read_only_copy
from .progress import Report, reporting
from .search_scales import force_ceiling, longest_wrench, parameter_rates
from .separable_bounds import SeparableBounds
from .wrench_curvature import (
    Departures,
    FormulaCurvature,
    GivenCurvature,
    checked_curvature,
    estimated_departures,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from graspforce.surfaces import MeshSurface
    from graspforce.typing import Criterion, Feasible, GraspOptions, Surface

    from .global_optimum import Ended

    Array = NDArray[np.float64]
    Indices = NDArray[np.int64]

_MAX_PARAMS = 4
_STARTS = 100
_SECONDS_OF_PLANS = 10.0
_OPEN = 1e-6  # of the longest wrench of a normal force: an epsilon below it is none


def plan_global(
    surface: Surface,
    bounds: ArrayLike | None = None,
    criterion: Criterion = "max",
    *,
    gap: float = 0.01,
    initial: ArrayLike | None = None,
    curvature: ArrayLike | Callable[[Array, Array], Array] | None = None,
    safety: float = 1.5,
    rtol: float | None = None,
    external_wrench: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    feasible: Feasible | None = None,
    min_distance: float = 0.0,
    max_opening: float | None = None,
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
        As for `graspforce.plan`. Arrangements of `graspforce.surfaces` tell which contacts have parameters of
        their own; those are bounded apart, which is faster. With a function of your own, the contact frames
        must vary smoothly: where the default tangents switch axes (normals with ``|n_x|`` about 0.7), give
        ``tangents``.
    bounds : array_like, optional
        (p, 2) finite lower and upper bounds, p at most 4. Contacts that are all on meshes need none: they may
        be anywhere on faces that are `allowed`. Their normals must be those of the faces.
    gap : float
        Stop when the relative gap between the best grasp and the upper bound is this small.
    initial : array_like, optional
        (p,) parameters of a good grasp, such as `Plan.params`. The search starts with this quality as the
        incumbent; by default it starts in the middle of the bounds.
    curvature : array_like or callable, optional
        (m, p) upper bounds of the norms of the second derivatives of contact i's primitive wrenches by
        parameter j, valid everywhere within the bounds; or a function of lower and upper corners of boxes
        (B, p) that returns (B, m, p) bounds valid within each. They make the result a proof. For curves and
        surfaces of `graspforce.surfaces` formulas give the curvature: the result is a proof, too. For other
        functions it is estimated box by box by default, and the result ends as an "estimate".
    safety : float
        Factor of the estimated curvature: it multiplies the largest second difference along the box's axes.
    max_opening : float, optional
        Largest distance in m between any two contacts, as of a parallel gripper. On meshes the upper bound
        accounts for it, elsewhere it holds for wider grasps, too.
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
        parameters, if a mesh has interpolated normals, or if the search met no feasible grasp.
    InvalidGraspError
        As for `graspforce.plan`.
    TooLargeError
        Meshes have too many faces for the memory, or for a search without `time_limit`. The message says what
        it would take.

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

    A parallel gripper anywhere on a box: nothing beats the grasp found by more than 1%.

    >>> import trimesh
    >>> from graspforce.surfaces import MeshSurface, contacts_on
    >>> box = MeshSurface(trimesh.creation.box((0.06, 0.04, 0.02)), normals="face")
    >>> gripper = {"friction": 0.5, "torsion": 0.005, "length_scale": 0.03, "max_opening": 0.05}
    >>> found = gf.plan_global(contacts_on(box, box), **gripper)
    >>> found.stopped, found.proven
    ('tolerance', True)
    """
    meshes = meshes_of(surface)
    box = _mesh_bounds(meshes, bounds) if meshes else bounds_array(_given(bounds))
    if not meshes and not 1 <= len(box) <= _MAX_PARAMS:
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
    opening = np.inf if max_opening is None else real_number("max_opening", max_opening, positive=True)
    problem = SearchProblem.of(
        plan_global, surface, grasp_options, feasible, min_distance, max_opening=opening,
        criterion=criterion, rtol=rtol, external_wrench=external_wrench, metric=metric,
    )  # fmt: skip
    source = problem.source
    first = source.grasp(start)
    wrenches = ContactWrenches(problem, start)
    incumbent = Incumbent(problem, gap, _OPEN * longest_wrench(first, problem.quality_options["metric"]))
    search: BoxTree | FaceProducts
    if meshes:
        if curvature is not None:
            raise InvalidInputError("curvature: meshes with face normals have none")
        free = feasible is None and min_distance == 0
        search = FaceProducts(
            wrenches, meshes, opening, lambda sample, seconds: _planned(problem, box, sample, seconds),
            ceiling=force_ceiling(first, problem.quality_options["metric"], criterion),
            adopt=free, limited=np.isfinite(deadline),
        )  # fmt: skip
        proven = True
    else:
        known = _curvature(surface, curvature, wrenches, lower, upper)
        search = _box_tree(problem, incumbent, wrenches, known, safety, (start, lower, upper))
        proven = known is not None

    def result(stopped: Ended) -> GlobalOptimum | None:
        if incumbent.best is None:
            return None
        grasp, quality = problem.answer(incumbent.best)
        top = max(search.top, quality.epsilon)
        ended: Ended = "estimate" if stopped in ("tolerance", "open") and not proven else stopped
        return GlobalOptimum(
            read_only_copy(incumbent.best), quality, grasp, top, _relative(top, quality.epsilon),
            search.boxes, proven, ended, time.monotonic() - began,
        )  # fmt: skip

    try:
        with reporting(progress, "bounding", "upper bound of epsilon") as report:
            if isinstance(search, FaceProducts):
                incumbent.attempt(start[None])
                stopped = search.run(incumbent, max_boxes, deadline, report)
            else:
                stopped = search.run(start, lower, upper, max_boxes, deadline, report)
    except GraspForceError as error:
        error.partial = result("error")
        raise
    found = result(stopped)
    if found is None:
        raise InvalidInputError(f"{source.conditions}: refused all {source.counts.candidates} grasps tried")
    return found


def _planned(problem: SearchProblem, box: Array, sample: Array, seconds: float) -> Array:
    """Return parameters (1, p) of the best plan from the best of a sample (B, p); (0, p) if none is feasible.

    The starts are feasible, and one search that fails ends no other: what is raised is the caller's to know.
    """
    source, options = problem.source, problem.quality_options
    # Places on faces are rounded.
    sample = np.clip(sample, *box.T)
    starts = sample[source.feasible(source.contacts(sample))]
    if not len(starts):
        return starts

    def allowed(positions: Array, normals: Array) -> NDArray[np.bool_]:
        return source.feasible({"positions": positions, "normals": normals})

    size = float(np.ptp(box, axis=1).max())
    deadline = deadline_after(min(seconds, _SECONDS_OF_PLANS))
    starts = starts[ranked(problem, starts)[0][:_STARTS]]
    # From many starts, and then closely from the best end.
    for step, tolerance in ((0.2, 0.01), (0.01, 1e-4)):
        found = plan_multistart(
            problem.surface, box, step * size, tolerance * size, options["criterion"], starts=starts, best=1,
            feasible=allowed, time_limit=max(0.0, deadline - time.monotonic()),
            external_wrench=options["external_wrench"], metric=options["metric"], **source.options,
        )  # fmt: skip
        if found.stopped == "interrupted":
            raise KeyboardInterrupt
        starts = np.clip(found.best.params[None], *box.T)
    return starts


def _box_tree(
    problem: SearchProblem,
    incumbent: Incumbent,
    wrenches: ContactWrenches,
    known: GivenCurvature | FormulaCurvature | None,
    safety: float,
    box: tuple[Array, Array, Array],
) -> BoxTree:
    """Return the search of a box with a start, a lower and an upper corner."""
    start, lower, upper = box
    rates = parameter_rates(problem.source, lower, upper)
    tree = BoxTree(problem, incumbent, problem.source.grasp(start), known, safety, rates)
    groups = contact_groups(problem.surface, wrenches.num_contacts, len(lower))
    if len(groups) > 1:

        def departures(low: Array, high: Array, contacts: Indices, axes: Indices) -> Departures:
            if known is not None:
                return known.over(low, high, contacts, axes)
            return estimated_departures(wrenches, low, high, contacts, axes, safety)

        tree.separable = SeparableBounds(wrenches, departures, groups, start, lower, upper, rates)
    return tree


def _given(bounds: ArrayLike | None) -> ArrayLike:
    if bounds is None:
        raise InvalidInputError("bounds: None is possible for contacts on meshes only; give (p, 2) bounds")
    return bounds


def _mesh_bounds(meshes: tuple[MeshSurface, ...], bounds: ArrayLike | None) -> Array:
    """Return the box around the meshes of all contacts (3 m, 2); that of the caller must hold it."""
    whole = np.concatenate([mesh.bounds for mesh in meshes])
    if bounds is not None:
        box = bounds_array(bounds)
        if box.shape != whole.shape or (box[:, 0] > whole[:, 0]).any() or (box[:, 1] < whole[:, 1]).any():
            raise InvalidInputError(
                f"bounds: shape {box.shape}, expected {whole.shape} that hold the whole meshes, or None; use "
                "`allowed` of MeshSurface to leave out faces"
            )
    return whole


def _curvature(
    surface: Surface,
    curvature: ArrayLike | Callable[[Array, Array], Array] | None,
    wrenches: ContactWrenches,
    lower: Array,
    upper: Array,
) -> GivenCurvature | FormulaCurvature | None:
    if curvature is None:
        return FormulaCurvature.of(surface, wrenches, lower, upper)
    if not callable(curvature):
        curvature = checked_curvature(curvature, (wrenches.num_contacts, len(lower)))
    return GivenCurvature(curvature, wrenches.num_contacts)


def _relative(top: float, epsilon: float) -> float:
    """Return by which share of epsilon the upper bound exceeds it."""
    if top == epsilon:
        return 0.0
    return (top - epsilon) / abs(epsilon) if epsilon else np.inf
