"""Ask where the best grasp is: the whole problem, with a bound of what nobody can exceed."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

import graspforce as gf
from graspforce.paper import RACKET

from .asking import Answers, Question, Run
from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from graspforce.paper.examples import PlanningProblem

    Array = np.ndarray

GAP = 1e-3
SAMPLES = 100  # a parameter
CANDIDATES = 20  # for each contact
QUICK = 6  # of both, to see that it runs
DIFFERENT = 0.05  # what grids may miss


def questions(run: Run) -> Iterator[Question]:
    yield Question(
        "Which grasp is the best of all?",
        f"Three contacts on the racket of the paper. `plan_global` proves its answer to {GAP:.1%} over all "
        f"parameters. Dense sampling measures all combinations of {SAMPLES:,} places of each contact. The "
        f"mixed-integer program chooses one of {CANDIDATES} places for each contact. HiGHS maximises the "
        "least support along a set of directions. The set grows by the worst direction of each choice until "
        "the choice is as good as its bound. Both know nothing of what is between their places.",
        best_grasp(run),
    )


def best_grasp(run: Run) -> Iterator[Answers]:
    samples, candidates = (QUICK, QUICK) if run.quick else (SAMPLES, CANDIDATES)
    different = 1.0 if run.quick else DIFFERENT
    calls = [
        Call("plan_global", "graspforce", lambda: proven, GAP, reference=True),
        Call(
            "dense sampling by quality_many", "graspforce", lambda: partial(sampled, count=samples), different
        ),
        Call("HiGHS, mixed integers", "scipy", lambda: partial(chosen, places=candidates), different),
    ]
    problem = RACKET["three fingers"]
    yield run.ask("best grasp of three fingers, maximum", calls, [problem], headline=True, warm_up=False)


def options(problem: PlanningProblem) -> dict[str, Any]:
    return {"friction": problem.friction, "max_normal_force": problem.max_normal_force}


def proven(problem: PlanningProblem) -> float:
    found = gf.plan_global(problem.surface, problem.bounds, "max", gap=GAP, **options(problem))
    return found.quality.epsilon


def sampled(problem: PlanningProblem, *, count: int) -> float:
    lines = [np.linspace(low, high, count) for low, high in problem.bounds]
    params = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    best = -np.inf
    for part in np.array_split(params, 20):
        best = max(best, gf.quality_many(*problem.surface(part), **options(problem)).epsilon.max())
    return float(best)


def chosen(problem: PlanningProblem, *, places: int) -> float:
    from scipy.optimize import Bounds, LinearConstraint, milp  # noqa: PLC0415

    lines = np.array([np.linspace(low, high, places) for low, high in problem.bounds]).T
    positions, normals = problem.surface(lines)
    count = positions.shape[1]
    wrenches = wrenches_of(positions, normals, problem)
    directions: list[Array] = [z * sign for z in np.eye(3) for sign in (1, -1)]
    one_each = LinearConstraint(
        np.hstack([np.kron(np.eye(count), np.ones(places)), np.zeros((count, 1))]), 1, 1
    )
    size, best = count * places, 0.0
    while True:
        reach = np.array([np.maximum(wrenches @ z, 0).max(axis=-1).T.reshape(-1) for z in directions])
        support = LinearConstraint(np.hstack([reach, -np.ones((len(reach), 1))]), 0, np.inf)
        found = milp(
            np.r_[np.zeros(size), -1.0],
            constraints=[one_each, support],
            integrality=np.r_[np.ones(size), 0],
            bounds=Bounds(0, np.r_[np.ones(size), np.inf]),
        )
        if found.status != 0:
            raise UnsolvedError
        at = found.x[:size].reshape(count, places).argmax(axis=1)
        grasp = gf.Grasp(positions[at, range(count)], normals[at, range(count)], **options(problem))
        quality = grasp.quality("max")
        best = max(best, quality.epsilon)
        if -found.fun <= best * (1 + GAP):
            return best
        directions.append(quality.direction / np.linalg.norm(quality.direction))


def wrenches_of(positions: Array, normals: Array, problem: PlanningProblem) -> Array:
    """Extreme wrenches (candidate, contact, edge, 3) of all places."""
    across = np.stack([-normals[..., 1], normals[..., 0]], axis=-1)
    friction = np.broadcast_to(problem.friction, positions.shape[1])[:, None]
    forces = np.stack([normals + sign * friction * across for sign in (1, -1)], axis=-2)
    forces = forces * np.broadcast_to(problem.max_normal_force, positions.shape[1])[:, None, None]
    places = positions[..., None, :]
    torques = places[..., 0] * forces[..., 1] - places[..., 1] * forces[..., 0]
    return np.concatenate([forces, torques[..., None]], axis=-1)
