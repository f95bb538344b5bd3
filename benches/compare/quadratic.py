"""Quadratic solvers on the same linear program, with a zero quadratic term: DAQP, ProxQP and OSQP.

None of them is made for linear programs: DAQP and ProxQP regularise by proximal steps, OSQP is a first-order
method. "Kept" updates the right-hand side in place and starts from the last solution; "qpsolvers" sets up
anew each time, as its one function does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from .programs import LinearProgram

    Solve = Callable[[np.ndarray], float]

# Its defaults are 1e-3 and 4,000 steps; along the jumps even 50,000 do not bring it to 1e-6.
FIRST_ORDER = {"eps_abs": 1e-4, "eps_rel": 1e-4, "max_iter": 20_000}

# DAQP's unbounded, by its documentation.
UNBOUNDED = 1e30


def daqp_kept(problem: LinearProgram) -> Solve:
    import daqp  # noqa: PLC0415

    size, dim = problem.size, problem.dim
    rows = np.vstack([problem.balance, problem.limits])
    low = np.concatenate([np.zeros(size + dim), np.full(problem.contacts, -UNBOUNDED)])
    high = np.concatenate([np.full(size, UNBOUNDED), np.zeros(dim + problem.contacts)])
    balance = slice(size, size + dim)
    sense = np.zeros(len(low), dtype=np.int32)
    sense[balance] = 5  # an equality
    model = daqp.Model()
    model.setup(np.zeros((size, size)), problem.cost, rows, high, low, sense)
    model.settings = {"primal_tol": 1e-9, "dual_tol": 1e-9}

    def solve(external: np.ndarray) -> float:
        low[balance] = high[balance] = -external
        model.update(bupper=high, blower=low)
        x, _, flag, _ = model.solve()
        if flag != 1:
            raise UnsolvedError
        return float(x[-1])

    return solve


def proxqp_kept(problem: LinearProgram) -> Solve:
    """Take the sparse backend: the dense one of 0.8.0 crashes when it is started warm on this program.

    A few of its answers after a jump are feasible, reported as optimal, and are not.
    """
    from proxsuite import proxqp  # noqa: PLC0415

    size = problem.size
    rows = np.vstack([problem.limits, np.eye(size)])
    low = np.append(np.full(problem.contacts, -np.inf), np.zeros(size))
    high = np.append(np.zeros(problem.contacts), np.full(size, np.inf))
    solver = proxqp.sparse.QP(size, problem.dim, len(rows))
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-9, 0
    solver.settings.check_duality_gap = True
    solver.settings.eps_duality_gap_abs, solver.settings.eps_duality_gap_rel = 1e-9, 0
    solver.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
    balance, inequalities = sparse.csc_matrix(problem.balance), sparse.csc_matrix(rows)
    zero = sparse.csc_matrix((size, size))
    solver.init(zero, problem.cost, balance, np.zeros(problem.dim), inequalities, low, high)

    def solve(external: np.ndarray) -> float:
        solver.update(b=-external)
        solver.solve()
        if solver.results.info.status != proxqp.QPSolverOutput.PROXQP_SOLVED:
            raise UnsolvedError
        return float(solver.results.x[-1])

    return solve


def osqp_kept(problem: LinearProgram) -> Solve:
    import osqp  # noqa: PLC0415

    size, dim = problem.size, problem.dim
    rows = sparse.csc_matrix(np.vstack([problem.balance, problem.limits, np.eye(size)]))
    low = np.concatenate([np.zeros(dim), np.full(problem.contacts, -np.inf), np.zeros(size)])
    high = np.concatenate([np.zeros(dim + problem.contacts), np.full(size, np.inf)])
    solver = osqp.OSQP()
    solver.setup(sparse.csc_matrix((size, size)), problem.cost, rows, low, high, verbose=False, **FIRST_ORDER)
    return osqp_again(solver, low, high, dim, lambda found: float(found.x[-1]))


def osqp_again(solver, low: np.ndarray, high: np.ndarray, dim: int, answer: Callable[[Any], float]) -> Solve:
    """Return a function that solves again with other wrenches in the first ``dim`` rows."""

    def solve(external: np.ndarray) -> float:
        low[:dim] = high[:dim] = -external
        solver.update(l=low, u=high)
        found = solver.solve(raise_error=False)
        if found.info.status_val != 1:
            raise UnsolvedError
        return answer(found)

    return solve


def through_qpsolvers(problem: LinearProgram, solver: str, **options: Any) -> Solve:
    import qpsolvers  # noqa: PLC0415

    quadratic, limits, balance = np.zeros((problem.size, problem.size)), problem.limits, problem.balance
    if solver == "osqp":
        quadratic, limits, balance = (sparse.csc_matrix(m) for m in (quadratic, limits, balance))
    zeros, low = np.zeros(problem.contacts), np.zeros(problem.size)

    def solve(external: np.ndarray) -> float:
        program = qpsolvers.Problem(quadratic, problem.cost, limits, zeros, balance, -external, lb=low)
        found = qpsolvers.solve_problem(program, solver, **options)
        if not found.found:
            raise UnsolvedError
        return float(found.x[-1])

    return solve


def calls(problem: LinearProgram) -> list[Call]:
    return [
        Call("DAQP, kept", "daqp", lambda: daqp_kept(problem), 1e-6),
        Call("DAQP, qpsolvers", "qpsolvers",
             lambda: through_qpsolvers(problem, "daqp", primal_tol=1e-9, dual_tol=1e-9), 1e-6),
        Call("ProxQP, kept", "proxsuite", lambda: proxqp_kept(problem), 1e-5),
        Call("ProxQP, qpsolvers", "qpsolvers",
             lambda: through_qpsolvers(problem, "proxqp", eps_abs=1e-9, eps_rel=0.0), 1e-5),
        Call("OSQP, kept", "osqp", lambda: osqp_kept(problem), 2e-2),
        Call("OSQP, qpsolvers", "qpsolvers", lambda: through_qpsolvers(problem, "osqp", **FIRST_ORDER), 2e-2),
    ]  # fmt: skip
