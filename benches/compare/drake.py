"""Drake's ``MathematicalProgram`` on the same programs, kept: only the right-hand side changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from .programs import ConeProgram, LinearProgram

    Solve = Callable[[np.ndarray], float]


# Its feasibility tolerance stays at its default of 1e-7.
CLP_AGREEMENT = 1e-5


def stated(problem: LinearProgram | ConeProgram) -> tuple[Any, Any, Any]:
    """Return the program without its cones, its variables, and the balance of wrenches to update."""
    from pydrake.solvers import MathematicalProgram  # noqa: PLC0415

    program = MathematicalProgram()
    x = program.NewContinuousVariables(problem.size)
    program.AddLinearCost(problem.cost, 0.0, x)
    balance = program.AddLinearEqualityConstraint(problem.balance, np.zeros(problem.dim), x)
    below = np.full(problem.contacts, -np.inf)
    program.AddLinearConstraint(problem.limits, below, np.zeros(problem.contacts), x)
    return program, x, balance.evaluator()


def solved_by(
    name: str, problem: LinearProgram | ConeProgram, program: Any, balance: Any, tol: float
) -> Solve:
    from pydrake import solvers  # noqa: PLC0415

    solver, options = getattr(solvers, name)(), solvers.SolverOptions()
    if name == "ClarabelSolver":
        for option in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            options.SetOption(solver.solver_id(), option, tol)

    def solve(external: np.ndarray) -> float:
        balance.UpdateCoefficients(problem.balance, -external)
        found = solver.Solve(program, None, options)
        if not found.is_success():
            raise UnsolvedError
        return float(found.get_optimal_cost())

    return solve


def linear(problem: LinearProgram, name: str) -> Solve:
    program, x, balance = stated(problem)
    program.AddBoundingBoxConstraint(0, np.inf, x)
    return solved_by(name, problem, program, balance, 1e-9)


def cones(problem: ConeProgram, tol: float) -> Solve:
    program, x, balance = stated(problem)
    for rows in problem.cones.reshape(problem.contacts, 3, -1):
        program.AddLorentzConeConstraint(rows, np.zeros(3), x)
    return solved_by("ClarabelSolver", problem, program, balance, tol)


def linear_calls(problem: LinearProgram) -> list[Call]:
    return [
        Call("Drake, Clarabel", "drake", lambda: linear(problem, "ClarabelSolver"), 1e-7),
        Call("Drake, CLP", "drake", lambda: linear(problem, "ClpSolver"), CLP_AGREEMENT),
    ]


def cone_calls(problem: ConeProgram, tol: float) -> list[Call]:
    return [Call("Drake, Clarabel", "drake", lambda: cones(problem, tol), 100 * tol)]
