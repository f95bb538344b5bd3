"""Ask how hard each finger must press."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

import graspforce as gf

from . import centroidal, certificates, drake, equilibria, general, least_squares, ours, quadratic
from .asking import Answers, Question, Run
from .problems import any_grasps, closed_grasps, jumps, tile, trajectory
from .programs import ConeProgram, LinearProgram
from .table import power

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

UP = (0.0, 0.0, 1.0)
# Everybody's time is per wrench, and blocks are long enough that what others left in caches does not count.
BLOCK = 500
EDGES = 16  # of the pyramids that stand for true cones


def questions(run: Run) -> Iterator[Question]:
    yield Question(
        "Do the contacts hold a weight, and with how little force?",
        "The same grasps under 1 N through the origin. Nothing is kept between them. HiGHS computes the "
        "least sum of normal forces, too; Klampt computes some forces in the same cones.",
        equilibrium(run),
    )
    yield Question(
        "How hard must each finger press, along a trajectory and after a jump?",
        'The linear program of the least maximum, one wrench at a time. "Warm" peers keep their basis '
        'between wrenches, "kept" peers their data; both return the objective alone. `solve_into` writes '
        "the forces. `solve` returns them with multipliers, gap and margins. `solve_many` takes 500 "
        "wrenches a call. DAQP, ProxQP and OSQP solve a quadratic program whose quadratic term is zero.",
        linear_programs(run),
    )
    yield Question(
        "The same with true friction cones?",
        "Second-order cone programs. Every program gets the same tolerance and applies it in its own "
        "norm; differences of a hundred times the tolerance are allowed. They are measured from this "
        "library's answers at 1e-10.",
        true_cones(run),
    )
    yield Question(
        "Which forces have the least squares?",
        "Half the sum of the squares of all forces, with friction cones and without limits. ECOS minimises "
        "the norm. DAQP, ProxQP and OSQP need linear constraints: beside true cones they get inscribed "
        f"pyramids of {EDGES} edges, with larger answers. In the tables of pyramids everybody gets them. "
        '"Warm" starts from the last solution.',
        squares(run, nearest=False),
    )
    yield Question(
        "Which forces come nearest to balance?",
        "Wrenches beyond what the contacts balance within their limits: twice the trajectory, and jumps 60 "
        "times as large. The answer is the distance from balance. Peers look for the distance alone; "
        "`nearest` also finds the least of the forces that reach it.",
        squares(run, nearest=True),
    )


def equilibrium(run: Run) -> Iterator[Answers]:
    grasps = any_grasps(19, run.number(1000), 8)
    external = np.array([*UP, 0.0, 0.0, 0.0])
    calls = [*ours.least_sum_calls(external), *equilibria.least_sum_calls(external)]
    least = run.ask("least sum under a weight", calls, grasps)
    yield least
    calls = [*ours.held_calls(external), *equilibria.held_calls(UP), *centroidal.held_calls()]
    answers = run.ask("a weight held or not", calls, grasps, headline=True)
    answers.note = equilibria.klampt_forces(answers, grasps, least.reference, UP)
    yield answers


def linear_programs(run: Run) -> Iterator[Answers]:
    small, large = tile(), closed_grasps(3, 1, 8, 16)[0].grasp
    families = [
        ("tile, 1 kHz trajectory", small, trajectory(run.number(10_000))),
        ("tile, random jumps", small, jumps(7, run.number(2000))),
        ("8 contacts, 16 edges, random jumps", large, jumps(8, run.number(2000))),
    ]
    for name, grasp, wrenches in families:
        program = LinearProgram(grasp)
        peers = [*general.linear_calls(program), *quadratic.calls(program), *drake.linear_calls(program)]
        calls = [*ours.force_calls(grasp, 1e-9), *peers]
        answers = run.ask(f"least maximum, {name}", calls, wrenches, headline=True, block=BLOCK)
        answers.refuted = partial(not_the_least_maximum, grasp, wrenches)
        yield answers


def not_the_least_maximum(
    grasp: gf.Grasp, wrenches: Sequence[np.ndarray], number: int, answer: float
) -> bool:
    return certificates.least_maximum_is_not(gf.ForceDistributor(grasp, "max"), wrenches[number], answer)


def true_cones(run: Run) -> Iterator[Answers]:
    grasp = tile(None)
    program = ConeProgram(grasp)
    families = [
        ("tile, 1 kHz trajectory", trajectory(run.number(10_000))),
        ("tile, random jumps", jumps(7, run.number(2000))),
    ]
    for tol in (1e-6, 1e-9):
        peers = [*general.cone_calls(program, tol), *drake.cone_calls(program, tol)]
        for name, wrenches in families:
            calls = [*ours.force_calls(grasp, tol), *peers]
            problem = f"least maximum, true cones to {power(tol)}, {name}"
            answers = run.ask(problem, calls, wrenches, headline=tol == 1e-9, block=BLOCK)
            exact = gf.ForceDistributor(grasp, "max", rtol=1e-10).solve_many(np.array(wrenches))
            answers.reference = exact.sigma_max
            yield answers


def squares(run: Run, *, nearest: bool) -> Iterator[Answers]:
    path, jumped = trajectory(run.number(10_000)), jumps(7, run.number(2000))
    families = [("tile, 1 kHz trajectory", path), ("tile, random jumps", jumped)]
    if nearest:
        families = [
            ("tile, twice the trajectory", [2 * wrench for wrench in path[: len(jumped)]]),
            ("tile, jumps beyond the limits", [60 * wrench for wrench in jumped]),
        ]
    question = "nearest forces" if nearest else "least squares"
    grasps = tile(None), tile(EDGES)
    true, pyramids = (least_squares.LeastSquares(grasp, nearest=nearest) for grasp in grasps)
    inscribed = least_squares.linear_calls(pyramids, f" on {EDGES} edges")
    for name, wrenches in families:
        calls = [*ours.squares_calls(grasps[0], nearest=nearest), *least_squares.cone_calls(true), *inscribed]
        yield run.ask(f"{question}, true cones, {name}", calls, wrenches, headline=True, block=BLOCK)
        peers = [*least_squares.cone_calls(pyramids), *least_squares.linear_calls(pyramids)]
        calls = [*ours.squares_calls(grasps[1], nearest=nearest), *peers]
        yield run.ask(f"{question}, {EDGES} edges, {name}", calls, wrenches, block=BLOCK)
