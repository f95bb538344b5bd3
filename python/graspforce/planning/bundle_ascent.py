"""Gradient refinement: improve a grasp by gradients, or show that it is stationary.

At a good grasp several directions are equally bad, and epsilon has no gradient. `graspforce.quality_many`
gives the gradients along the most critical directions, with the supports there. Each step is the best one
for the linear pieces that they are (see `linear_pieces`).

A step that fails shows that a piece is missing, as beyond an edge of a mesh: the bundle there joins that of
the grasp, and contacts stay on their side of the edge (see `walls`). Where no step succeeds, random grasps
nearby are tried. Further ascents start from random grasps
around the best one, as long as grasps are cheap to measure.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias, Unpack

import numpy as np

from graspforce._internal.checks import finite_vector, real_number, search_bounds, whole_number
from graspforce._internal.html import vector
from graspforce._internal.restored import expect_instance, expect_number, expect_search_result, expect_whole
from graspforce._internal.to_dict import Record
from graspforce.errors import GraspForceError, InvalidInputError

from .problem import SearchProblem, deadline_after, read_only_copy
from .support_pieces import DIFFERENCE, SupportPieces
from .walls import Walls, within

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp, Quality
    from graspforce.typing import Criterion, Feasible, GraspOptions, Surface

    from .linear_pieces import LinearPieces
    from .support_pieces import Surroundings

    Array = NDArray[np.float64]

RefinementStopped: TypeAlias = Literal["tolerance", "iterations", "target", "time", "interrupted", "error"]

_TIMES = (0.2, 0.06, 0.02, 6e-3, 1e-3)  # of the range, over the longest slope: times of steps that are tried
_LENGTHS = (0.2, 0.07, 0.02, 5e-3, 1e-3)  # of the range: lengths of further ones
_NEAR = 1e-4  # of the range: the slope is that of the pieces that so short a step meets
_SHORT = (3e-4, 1e-4, 3e-5, 1e-5, 1e-6)  # the same after a failure, as close to an edge of a mesh
_SAMPLED = 3  # random places whose bundles join that of the grasp after a failure
_RADII = (1e-3, 1e-2, 1e-4, 1e-5)  # of the range: where they are, after the first failure and later ones
_EXPLORED = (1e-5, 0.2)  # of the range: how far away random grasps are measured after a failure
_FAILURES = 6  # iterations in a row without an increase that end an ascent; one ends it below the best grasp
_HOPS, _IDLE_HOPS = 32, 16  # further ascents; so many in a row without an increase end the refinement
_HOPPED = ((3e-3, 0.03), (0.1, 0.5), (0.01, 0.3))  # of the range: how far away they start
_WORK = 1e8  # and none after so many grasps, times the square of the points that a polytope takes
_ALIKE = 1e-3  # slopes that differ by less, relative to the longest, lead the same way
_WORTHWHILE = 1e-6  # relative increase below which a step does not count
_CURVED = 10.0  # of the longest slope, by the range: curvature that may make a place better than promised
_FIRST, _ENOUGH = 4, 0.5  # places measured first; the share of what the others promise that ends the choice
_BESIDE = 0.03  # of the range: steps no longer than this show edges
_MARGIN = 2 * DIFFERENCE  # of the range: how near contacts come to an edge that they do not cross


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
        True if no direction within the bounds increases the supports along all critical directions, to the
        tolerance.
    slope : float
        Length of the shortest vector in the hull of the last gradients of critical directions: change of
        epsilon per full range of the parameters.
    iterations, evaluations : int
        Number of grasps that were to be improved by gradients, and of all grasps measured.
    unique : bool
        True if epsilon has a gradient at the end.
    stopped : {"tolerance", "iterations", "target", "time", "interrupted", "error"}
        Why the refinement ended. "tolerance": the grasp is stationary, or neither a step nor a random point
        nearby increases epsilon. "iterations": `max_iterations` was reached. "error": an error ended
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

    def __repr__(self) -> str:
        at, epsilon = vector(self.params, digits=6), f"{self.quality.epsilon:.6g}"
        return f"Refinement(params={at}, epsilon={epsilon}, gain={self.gain:.3g}, stopped={self.stopped!r})"

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
    max_iterations: int = 300,
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
        before each bundle of gradients and each set of candidates.
    max_iterations : int
        Largest number of grasps whose gradients are computed in order to improve them.
    tolerance : float
        A slope counts as zero if it changes epsilon by less than this share over the full range of the
        parameters.
    seed : int
        Seed of the points that are tried where gradients lead no further.

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
        self._source, self._score, self._tolerance = problem.source, problem.score, tolerance
        self._quality_options = problem.quality_options
        self._lower, self._upper, self._range = lower, upper, upper - lower
        self._random = np.random.default_rng(seed)
        self._support = SupportPieces(problem, lower, upper)
        self._free = self._support.free
        self._walls: Walls | None = None
        self._start = start
        self._deadline = np.inf
        self.evaluations = 0

    def run(self, max_iterations: int, goal: float = np.inf, deadline: float = np.inf) -> Refinement:
        params = self._start
        quality = first = self._quality(params)
        best, slope, iterations = (params, quality), 0.0, 0
        # The grasp that was found stationary, if it is the best.
        flattest = None if len(self._free) else quality
        pieces, failures, hops, idle, highest = None, 0, 0, 0, -np.inf
        # The quality of the start, above, is computed in any case.
        self._deadline = deadline

        def result(stopped: RefinementStopped) -> Refinement:
            end, reached = best
            return Refinement(
                read_only_copy(end), reached, reached.grasp, reached.epsilon - first.epsilon,
                reached is flattest, slope, iterations, self.evaluations, reached.gradient.unique, stopped,
            )  # fmt: skip

        try:
            while len(self._free):
                if quality.epsilon >= goal:
                    return result("target")
                if pieces is None:
                    if iterations >= max_iterations:
                        return result("iterations")
                    iterations += 1
                    around = self._surroundings(params[None], params, quality.epsilon)
                    pieces = around.pieces
                uphill = float(np.linalg.norm(pieces.near(_NEAR).direction(1.0, *self._bounds_met(params))))
                flat = uphill <= self._tolerance * max(abs(quality.epsilon), 1e-12)
                if quality is best[1]:
                    slope, flattest = uphill, quality if flat else None
                places = self._tried(pieces, around, params, uphill, failures)
                better = self._better(places, params, quality, around.pieces)
                if better is not None:
                    (params, quality), pieces, failures = better, None, 0
                    best = better if quality.epsilon > best[1].epsilon else best
                    continue
                failures += 1
                self._look_for_walls(around, places, params)
                if quality is best[1] and failures < (_FAILURES // 2 if flat else _FAILURES):
                    radius = _RADII[(failures - 1) % len(_RADII)]
                    sample = self._nearby(params, _SAMPLED, (radius / 10, radius))
                    pieces = pieces.with_others(self._surroundings(sample, params, quality.epsilon).pieces)
                    continue
                idle = 0 if best[1].epsilon > highest else idle + 1
                highest = best[1].epsilon
                if hops == _HOPS or idle > _IDLE_HOPS or self.evaluations * best[1].supports ** 2 > _WORK:
                    break
                params, quality = hopped = self._hopped(best[0], _HOPPED[hops % len(_HOPPED)])
                hops += 1
                pieces, failures = None, 0
                best = hopped if quality.epsilon > best[1].epsilon else best
        except _TimeOverError:
            return result("time")
        except KeyboardInterrupt:
            return result("interrupted")
        except GraspForceError as error:
            error.partial = result("error")
            raise
        return result("tolerance")

    def _count(self, grasps: int = 1) -> None:
        if time.monotonic() >= self._deadline:
            raise _TimeOverError
        self.evaluations += grasps

    def _quality(self, params: Array) -> Quality:
        self._count()
        return self._source.grasp(params).quality(**self._quality_options)

    def _better(
        self, places: Array, params: Array, quality: Quality, pieces: LinearPieces
    ) -> tuple[Array, Quality] | None:
        """Return the best of the places and its quality, if it is better than that at the parameters."""
        enough = _WORTHWHILE * abs(quality.epsilon)
        moves = (places - params)[:, self._free] / self._range[self._free]
        promised = pieces.least(moves, self._free)
        # Curvature, of which the pieces know nothing, grows with the square of the way.
        reached = promised + _CURVED * pieces.steepest * (moves * moves).sum(axis=1)
        order = np.argsort(-promised, kind="stable")
        order = order[reached[order] > enough]
        place, rho = params, quality.rho
        for some in (order[:_FIRST], order[_FIRST:]):
            # Places that promise much less than others gained are not worth a look.
            if not len(some) or quality.rho - rho > _ENOUGH * promised[some].max():
                break
            self._count(len(some))
            choice = self._source.best(np.vstack([place, places[some]]), 0, rho, self._score)
            if choice is not None and choice.index > 0:
                place, rho = places[some[choice.index - 1]], choice.rho
        if place is params:
            return None
        for end in (self._source.settled(place, self._lower, self._upper), place):
            found = self._quality(end)
            if found.epsilon > quality.epsilon + enough:
                return end, found
        return None

    def _hopped(self, params: Array, distances: tuple[float, float]) -> tuple[Array, Quality]:
        """Return the best of random places around the parameters, and its quality."""
        places = self._nearby(params, len(self._free) + 2, distances)
        self._count(len(places))
        choice = self._source.best(places, 0, None, self._score)
        place = params if choice is None else places[choice.index]
        return place, self._quality(place)

    def _steps(
        self,
        pieces: LinearPieces,
        around: Surroundings,
        params: Array,
        further: tuple[float, ...],
        walls: tuple[Array, Array] | None = None,
    ) -> Array:
        """Places (n, p) that the pieces promise to be better, on this side of the walls."""
        bounds = self._bounds_met(params)
        times = [time / pieces.steepest for time in (*_TIMES, *further)]
        directions = pieces.directions(times, *bounds, walls)
        sizes = np.maximum(np.linalg.norm(directions[len(_TIMES) :], axis=1), 1e-300)
        lengths = np.concatenate([times[: len(_TIMES)], np.array(further) / sizes])
        moves = lengths[:, None] * directions
        if walls is not None:
            moves = within(walls, moves)
        return np.clip(params + around.moved(moves * self._range), self._lower, self._upper)

    def _tried(
        self, pieces: LinearPieces, around: Surroundings, params: Array, uphill: float, failures: int
    ) -> Array:
        """Places (n, p) that may be better: by steps of the pieces, along edges, coarse or random ones."""
        lengths = (*_LENGTHS, *_SHORT) if failures else _LENGTHS
        places = [self._steps(pieces, around, params, lengths) if uphill > 0 else params[None]]
        walls = self._walls.beside(around.here) if self._walls and uphill > 0 else ()
        if walls:
            limits = walls.limits(around.here, around.moves, _MARGIN)
            places.append(self._steps(pieces, around, params, lengths, limits))
        if failures:
            places.append(self._nearby(params, 2 * (len(self._free) + 2), _EXPLORED))
        elif not around.coarse.is_like(pieces, _ALIKE):
            places.append(self._steps(around.coarse, around, params, _LENGTHS))
        return np.concatenate(places)

    def _surroundings(self, places: Array, params: Array, epsilon: float) -> Surroundings:
        self._count(len(places))
        return self._support.at(places, params, epsilon)

    def _look_for_walls(self, around: Surroundings, places: Array, params: Array) -> None:
        """Remember the edges that steps to places (n, p) have met."""
        steps = (places - params)[:, self._free] / self._range[self._free]
        short = places[np.linalg.norm(steps, axis=1) <= _BESIDE]
        if len(short) and around.flat.any():
            walls = self._walls or Walls.none(around.here["positions"].shape[-1])
            self._walls = walls.with_crossed(around.here, around.flat, self._source.contacts(short))

    def _bounds_met(self, params: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        edge = 1e-12 * self._range
        return params <= self._lower + edge, params >= self._upper - edge

    def _nearby(self, params: Array, count: int, distances: tuple[float, float]) -> Array:
        """Random places (n, p), of the range of distances; every other one moves a few parameters only."""
        free = len(self._free)
        moves = self._random.normal(size=(count, free))
        moves[::2] *= self._random.random((len(moves[::2]), free)) < max(0.25, 1 / free)
        nearest, furthest = np.log(distances)
        lengths = np.exp(self._random.uniform(nearest, furthest, size=(count, 1)))
        moves *= lengths / np.maximum(np.linalg.norm(moves, axis=1, keepdims=True), 1e-300)
        places = np.repeat(params[None], count, axis=0)
        places[:, self._free] += moves * self._range[self._free]
        return np.clip(places, self._lower, self._upper)
