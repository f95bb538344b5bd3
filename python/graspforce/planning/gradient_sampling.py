"""Gradient refinement: improve a grasp by gradients, or show that it is stationary.

Epsilon is a minimum of smooth functions, and at a good grasp several of them are equal. Epsilon has no
gradient there. Gradient sampling (Burke, Lewis and Overton, 2005) collects gradients in a neighbourhood. The
shortest vector in their convex hull is an ascent direction for all of them. If it vanishes, the point is
stationary for that neighbourhood.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias, Unpack

import numpy as np

from graspforce._core import unwarned_grasp
from graspforce._internal.checks import finite_vector, real_number, search_bounds, whole_number
from graspforce._internal.optional_imports import optional
from graspforce._internal.restored import expect_instance, expect_number, expect_search_result, expect_whole
from graspforce._internal.to_dict import Record
from graspforce._internal.vectors import unit
from graspforce.errors import GraspForceError, InvalidInputError, NotConvergedError

from .problem import SearchProblem, deadline_after, read_only_copy

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp, Quality
    from graspforce.typing import Criterion, Feasible, GraspOptions, Surface

    from .scoring import Contacts

    Array = NDArray[np.float64]

RefinementStopped: TypeAlias = Literal["tolerance", "iterations", "target", "time", "interrupted", "error"]

_DIFFERENCE = 1e-6  # of the parameters' range: the surface's derivatives by central differences
_FIRST_RADIUS, _LAST_RADIUS, _SHRINK = 1e-2, 1e-5, 0.2  # of the range: where gradients are sampled
_BUNDLES = 3  # samples of a neighbourhood before a smaller one is tried
_SUFFICIENT = 1e-4  # share of the predicted increase that a step must deliver (Armijo)


@dataclass(frozen=True, slots=True, eq=False)
class Refinement(Record):
    """The result of a refinement.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the grasp; those of the start if nothing better was found.
    quality, grasp : Quality, Grasp
        Its quality and the grasp itself. Epsilon is never below that of the start.
    gain : float
        Increase of epsilon in N.
    stationary : bool
        True if no direction within the bounds increases epsilon for all gradients sampled nearby, to the
        tolerance.
    slope : float
        Length of the shortest vector in the hull of the last gradients: change of epsilon per full range of
        the parameters.
    iterations, evaluations : int
        Number of steps, and of qualities and gradients computed.
    unique : bool
        True if epsilon has a gradient at the end.
    stopped : {"tolerance", "iterations", "target", "time", "interrupted", "error"}
        Why the refinement ended. "tolerance": the grasp is stationary, or no step in the smallest
        neighbourhood increases epsilon. "iterations": `max_iterations` was reached. "error": an error ended
        the refinement and carries this result as its ``partial``.
    """

    params: NDArray[np.float64]
    quality: Quality
    grasp: Grasp
    gain: float
    stationary: bool
    slope: float
    iterations: int
    evaluations: int
    unique: bool
    stopped: RefinementStopped

    def _check(self) -> None:
        expect_search_result(self)
        expect_number("gain", self.gain, least=0)
        expect_number("slope", self.slope, least=0)
        for name in ("stationary", "unique"):
            expect_instance(name, getattr(self, name), bool)
        for name in ("iterations", "evaluations"):
            expect_whole(name, getattr(self, name))


def refine(
    surface: Surface,
    params: ArrayLike,
    bounds: ArrayLike,
    criterion: Criterion = "max",
    *,
    rtol: float | None = None,
    external_wrench: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    feasible: Feasible | None = None,
    min_distance: float = 0.0,
    target: float | None = None,
    time_limit: float | None = None,
    max_iterations: int = 100,
    tolerance: float = 1e-3,
    seed: int = 0,
    **grasp_options: Unpack[GraspOptions],
) -> Refinement:
    """Improve a grasp by gradients of epsilon, within the bounds.

    Safe to call from several threads if `surface` and `feasible` are.

    Parameters
    ----------
    surface, bounds, criterion, rtol, external_wrench, metric, feasible, min_distance, **grasp_options
        As for `graspforce.plan`.
    params : array_like
        (p,) parameters of the start, such as `Plan.params`.
    target, time_limit : float, optional
        Stop as soon as epsilon in N reaches the target, or after this many seconds. The time is checked
        before each quality and each gradient.
    max_iterations : int
        Largest number of iterations. Each computes about ``p`` gradients and a few qualities.
    tolerance : float
        A slope counts as zero if it changes epsilon by less than this share over the full range of the
        parameters.
    seed : int
        Seed of the points where gradients are sampled.

    Returns
    -------
    Refinement
        The improved grasp; never worse than the start. Ctrl-C ends the refinement and returns the best so
        far.

    Raises
    ------
    InvalidInputError
        As for `graspforce.plan`, with a `Refinement` as ``partial``. Also if the start is infeasible.
    NotConvergedError
        SciPy did not solve a least-squares problem. The error carries the `Refinement` so far as ``partial``.
    MissingExtraError
        SciPy is not installed.

    Examples
    --------
    Two fingers on a disc are nearly opposite; gradients make them exactly opposite.

    >>> import numpy as np
    >>> import graspforce as gf
    >>> def disc(angles):
    ...     outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ...     return 0.1 * outward, -outward
    >>> better = gf.refine(disc, [0.0, 3.0], [(0, 1), (1, 4)], friction=0.6)
    >>> bool(abs(better.params[1] - better.params[0] - np.pi) < 1e-3), better.gain > 0
    (True, True)
    """
    deadline = deadline_after(time_limit)
    goal = np.inf if target is None else real_number("target", target, finite=False)
    start = finite_vector("params", params)
    lower, upper = search_bounds(bounds, start, "params")
    tolerance = real_number("tolerance", tolerance, positive=True)
    max_iterations = whole_number("max_iterations", max_iterations, least=0)
    seed = whole_number("seed", seed, least=0)
    problem = SearchProblem.of(
        refine, surface, grasp_options, feasible, min_distance,
        criterion=criterion, rtol=rtol, external_wrench=external_wrench, metric=metric,
    )  # fmt: skip
    if not problem.source.feasible(problem.source.contacts(start[None]))[0]:
        raise InvalidInputError(
            f"params: {start.tolist()} refused by {problem.source.conditions}; start from a feasible grasp"
        )
    return _Ascent(problem, start, lower, upper, tolerance, seed).run(max_iterations, goal, deadline)


class _TimeOverError(Exception):
    """The deadline has passed."""


class _Ascent:
    """Refinement in unit parameters: each runs from 0 to 1 over its bounds."""

    def __init__(
        self, problem: SearchProblem, start: Array, lower: Array, upper: Array, tolerance: float, seed: int
    ) -> None:
        self._source, self._tolerance = problem.source, tolerance
        self._quality_options = problem.quality_options
        self._lower, self._upper, self._range = lower, upper, upper - lower
        self._random = np.random.default_rng(seed)
        # A parameter whose bounds are so close that rounding swallows the difference has nowhere to go.
        rounding = np.spacing(np.maximum(np.abs(lower), np.abs(upper)))
        self._free = np.flatnonzero(_DIFFERENCE * self._range >= rounding)
        self._start = start
        self._deadline = np.inf
        self.evaluations = 0

    def run(self, max_iterations: int, goal: float = np.inf, deadline: float = np.inf) -> Refinement:
        params = self._start
        quality = first = self._quality(params)
        radius, slope, stationary, iterations = _FIRST_RADIUS, 0.0, not len(self._free), 0
        gradients = np.zeros((0, len(params)))
        # The quality of the start, above, is computed in any case.
        self._deadline = deadline

        def result(stopped: RefinementStopped) -> Refinement:
            gain = quality.epsilon - first.epsilon
            return Refinement(
                read_only_copy(params), quality, quality.grasp, gain, stationary, slope, iterations,
                self.evaluations, quality.gradient.unique, stopped,
            )  # fmt: skip

        try:
            while len(self._free):
                if quality.epsilon >= goal:
                    return result("target")
                if iterations >= max_iterations:
                    return result("iterations")
                iterations += 1
                gradients = np.concatenate([gradients, self._gradients_near(params, radius)])
                direction = self._uphill(gradients, params)
                slope = float(np.linalg.norm(direction))
                flat = slope <= self._tolerance * max(abs(quality.epsilon), 1e-12)
                moved = None if flat else self._line_search(params, quality.epsilon, direction, slope)
                if moved is not None:
                    params, quality = moved
                    gradients = gradients[:0]
                    continue
                # A direction that fails shows that a piece is missing: look again before looking closer.
                if not flat and len(gradients) < _BUNDLES * (len(self._free) + 2):
                    continue
                if radius <= _LAST_RADIUS:
                    stationary = flat
                    break
                radius *= _SHRINK
                gradients = gradients[:0]
        except _TimeOverError:
            return result("time")
        except KeyboardInterrupt:
            return result("interrupted")
        except GraspForceError as error:
            error.partial = result("error")
            raise
        return result("tolerance")

    def _count(self) -> None:
        if time.monotonic() >= self._deadline:
            raise _TimeOverError
        self.evaluations += 1

    def _quality(self, params: Array) -> Quality:
        self._count()
        return self._source.grasp(params).quality(**self._quality_options)

    def _gradients_near(self, params: Array, radius: float) -> Array:
        """Gradients (n, p) by unit parameters, here and at random places within the radius."""
        places = [params]
        for _ in range(len(self._free) + 1):
            offset = self._random.uniform(-radius, radius, len(params)) * self._range
            places.append(np.clip(params + offset, self._lower, self._upper))
        return np.array([self._gradient(place) for place in places])

    def _gradient(self, params: Array) -> Array:
        """Chain rule: how contacts move with each parameter, and epsilon with the contacts."""
        self._count()
        quality_options = {name: value for name, value in self._quality_options.items() if name != "rtol"}
        gradient = self._source.grasp(params)._gradient(**quality_options)  # noqa: SLF001 - the quality is not wanted
        step = _DIFFERENCE * self._range[self._free]
        moves = np.zeros((len(self._free), len(params)))
        moves[np.arange(len(self._free)), self._free] = step
        ends = [np.clip(params + sign * moves, self._lower, self._upper) for sign in (1, -1)]
        spans = (ends[0] - ends[1]).sum(axis=1) / self._range[self._free]
        after, before = (self._source.contacts(np.atleast_2d(end)) for end in ends)
        slopes = np.zeros(len(params))
        positions = after["positions"] - before["positions"]
        normals = unit(after["normals"]) - unit(before["normals"])
        rise = (positions * gradient.positions).sum(axis=(1, 2)) + (normals * gradient.normals).sum(
            axis=(1, 2)
        )
        if np.any(gradient.spins):
            rise += self._spins(after, before) @ gradient.spins
        slopes[self._free] = rise / spans
        return slopes

    def _spins(self, after: Contacts, before: Contacts) -> Array:
        """Angles (B, m) by which contact frames spin about their normals beyond the smallest rotation."""
        new, old = self._frames(after), self._frames(before)
        n_new, n_old, o_old = new[:, :, 0], old[:, :, 0], old[:, :, 1]
        # The smallest rotation from n_old to n_new, applied to o_old.
        axis = np.cross(n_old, n_new)
        cosine = (n_old * n_new).sum(axis=-1, keepdims=True)
        along = (axis * o_old).sum(axis=-1, keepdims=True)
        carried = o_old * cosine + np.cross(axis, o_old) + axis * along / (1 + cosine)
        sine = (np.cross(carried, new[:, :, 1]) * n_new).sum(axis=-1)
        angles: Array = np.arctan2(sine, (carried * new[:, :, 1]).sum(axis=-1))
        return angles

    def _frames(self, contacts: Contacts) -> Array:
        """Contact frames (B, m, 3, 3) of all rows, as one grasp of many contacts: true cones cost least."""
        shape = contacts["positions"].shape
        tangents = contacts.get("tangents", self._source.options.get("tangents"))
        if tangents is not None:
            tangents = np.broadcast_to(np.asarray(tangents, dtype=np.float64), shape).reshape(-1, 3)
        places, normals = (contacts[name].reshape(-1, 3) for name in ("positions", "normals"))
        return unwarned_grasp(places, normals, edges=None, tangents=tangents).frames.reshape(*shape, 3)

    def _uphill(self, gradients: Array, params: Array) -> Array:
        """Shortest vector of the gradients' hull, what points out of the bounds removed.

        The minimum over weights of the gradients and over multipliers of the bounds met is a nonnegative
        least squares problem once the weights' sum is a heavy equation.
        """
        optimize = optional("scipy.optimize", "search")
        edge = 1e-12 * self._range
        at_lower = np.flatnonzero(params <= self._lower + edge)
        at_upper = np.flatnonzero(params >= self._upper - edge)
        identity = np.eye(len(params))
        # At a lower bound a negative slope is no way to go: its multiplier takes it away; upper ones
        # likewise.
        outward = np.concatenate([identity[at_lower], -identity[at_upper]])
        scale = max(np.abs(gradients).max(), 1e-300)
        heavy = 1e4
        columns = np.concatenate([gradients / scale, outward]).T
        sums = np.concatenate([np.full(len(gradients), heavy), np.zeros(len(outward))])
        try:
            weights, _ = optimize.nnls(np.vstack([columns, sums]), np.append(np.zeros(len(params)), heavy))
        except RuntimeError as error:
            raise NotConvergedError(f"the shortest vector in the hull of the gradients: {error}") from error
        shares = weights[: len(gradients)] / weights[: len(gradients)].sum()
        direction = shares @ gradients
        direction[at_lower] = np.maximum(direction[at_lower], 0.0)
        direction[at_upper] = np.minimum(direction[at_upper], 0.0)
        return np.asarray(direction)

    def _line_search(
        self, params: Array, epsilon: float, direction: Array, slope: float
    ) -> tuple[Array, Quality] | None:
        step = 0.1
        while step > 1e-9:
            move = step * direction / slope
            place = np.clip(params + move * self._range, self._lower, self._upper)
            if self._source.feasible(self._source.contacts(place[None]))[0]:
                quality = self._quality(place)
                if quality.epsilon > epsilon + _SUFFICIENT * step * slope:
                    return place, quality
            step *= 0.3
        return None
