"""General linear solvers on the least-maximum program: HiGHS, SciPy, Clarabel and ECOS.

Solvers that can keep their data or their basis do; the right-hand side is all that changes with the wrench.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from .programs import ConeProgram, LinearProgram

    Solve = Callable[[np.ndarray], float]

SIMPLEX_AGREEMENT = 1e-9
INTERIOR_AGREEMENT = 1e-7
TIGHT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def scipy_linprog(problem: LinearProgram) -> Solve:
    from scipy.optimize import linprog  # noqa: PLC0415

    balance, limits = sparse.csc_array(problem.balance), sparse.csc_array(problem.limits)
    zeros = np.zeros(problem.contacts)

    def solve(external: np.ndarray) -> float:
        found = linprog(problem.cost, limits, zeros, balance, -external, options=TIGHT)
        if found.status != 0:
            raise UnsolvedError
        return float(found.fun)

    return solve


def highs_model(cost: np.ndarray, rows: np.ndarray, low: np.ndarray, high: np.ndarray) -> Any:
    """Pass HiGHS a program over ``x >= 0`` with bounds on its rows."""
    import highspy  # noqa: PLC0415

    columns = sparse.csc_array(rows)
    program = highspy.HighsLp()
    program.num_row_, program.num_col_ = rows.shape
    program.col_cost_ = cost
    program.col_lower_ = np.zeros(rows.shape[1])
    program.col_upper_ = np.full(rows.shape[1], highspy.kHighsInf)
    program.row_lower_, program.row_upper_ = low, high
    program.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    program.a_matrix_.start_, program.a_matrix_.index_ = columns.indptr, columns.indices
    program.a_matrix_.value_ = columns.data
    highs = highspy.Highs()
    for option, value in {"output_flag": False, "threads": 1, **TIGHT}.items():
        highs.setOptionValue(option, value)
    highs.passModel(program)
    return highs


def highs_warm(problem: LinearProgram) -> Solve:
    import highspy  # noqa: PLC0415

    zeros, infinite = np.zeros(problem.dim), np.full(problem.contacts, -highspy.kHighsInf)
    low, high = np.concatenate([zeros, infinite]), np.zeros(problem.dim + problem.contacts)
    highs = highs_model(problem.cost, np.vstack([problem.balance, problem.limits]), low, high)
    balanced = np.arange(problem.dim, dtype=np.int32)
    optimal = highspy.HighsModelStatus.kOptimal

    def solve(external: np.ndarray) -> float:
        highs.changeRowsBounds(problem.dim, balanced, -external, -external)
        highs.run()
        if highs.getModelStatus() != optimal:
            raise UnsolvedError
        return float(highs.getObjectiveValue())

    return solve


def clarabel_kept(cost: np.ndarray, rows: np.ndarray, dim: int, cones: list[Any], tol: float) -> Solve:
    """``rows x + s = (-w, 0)`` with s in the cones, the first of which is zero."""
    import clarabel  # noqa: PLC0415

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # what is presolved cannot be updated
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tol
    right = np.zeros(len(rows))
    empty = sparse.csc_matrix((len(cost), len(cost)))
    solver = clarabel.DefaultSolver(empty, cost, sparse.csc_matrix(rows), right, cones, settings)

    def solve(external: np.ndarray) -> float:
        right[:dim] = -external
        solver.update(b=right)
        found = solver.solve()
        if found.status not in {clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved}:
            raise UnsolvedError
        return float(found.obj_val)

    return solve


def clarabel_linear(problem: LinearProgram) -> Solve:
    import clarabel  # noqa: PLC0415

    rows = np.vstack([problem.balance, problem.limits, -np.eye(problem.size)])
    cones = [clarabel.ZeroConeT(problem.dim), clarabel.NonnegativeConeT(len(rows) - problem.dim)]
    return clarabel_kept(problem.cost, rows, problem.dim, cones, 1e-9)


def clarabel_cones(problem: ConeProgram, tol: float) -> Solve:
    import clarabel  # noqa: PLC0415

    rows = np.vstack([problem.balance, problem.limits, -problem.cones])
    friction = [clarabel.SecondOrderConeT(3)] * problem.contacts
    cones = [clarabel.ZeroConeT(problem.dim), clarabel.NonnegativeConeT(problem.contacts), *friction]
    return clarabel_kept(problem.cost, rows, problem.dim, cones, tol)


def ecos_kept(
    cost: np.ndarray, balance: np.ndarray, rows: np.ndarray, dims: dict[str, Any], tol: float
) -> Solve:
    """ECOS keeps no workspace between calls; only its matrices are made beforehand."""
    import ecos  # noqa: PLC0415

    equalities, inequalities = sparse.csc_matrix(balance), sparse.csc_matrix(rows)
    right = np.zeros(len(rows))

    def solve(external: np.ndarray) -> float:
        found = ecos.solve(
            cost, inequalities, right, dims, equalities, -external,
            verbose=False, abstol=tol, reltol=tol, feastol=tol,
        )  # fmt: skip
        if found["info"]["exitFlag"] not in {0, 10}:
            raise UnsolvedError
        return float(found["info"]["pcost"])

    return solve


def ecos_linear(problem: LinearProgram) -> Solve:
    rows = np.vstack([problem.limits, -np.eye(problem.size)])
    return ecos_kept(problem.cost, problem.balance, rows, {"l": len(rows), "q": []}, 1e-9)


def ecos_cones(problem: ConeProgram, tol: float) -> Solve:
    rows = np.vstack([problem.limits, -problem.cones])
    dims = {"l": problem.contacts, "q": [3] * problem.contacts}
    return ecos_kept(problem.cost, problem.balance, rows, dims, tol)


def linear_calls(problem: LinearProgram) -> list[Call]:
    return [
        Call("HiGHS, warm", "highspy", lambda: highs_warm(problem), SIMPLEX_AGREEMENT),
        Call("SciPy linprog (HiGHS)", "scipy", lambda: scipy_linprog(problem), SIMPLEX_AGREEMENT),
        Call("Clarabel, kept", "clarabel", lambda: clarabel_linear(problem), INTERIOR_AGREEMENT),
        Call("ECOS", "ecos", lambda: ecos_linear(problem), INTERIOR_AGREEMENT),
    ]


def cone_calls(problem: ConeProgram, tol: float) -> list[Call]:
    agreement = 100 * tol
    return [
        Call("Clarabel, kept", "clarabel", lambda: clarabel_cones(problem, tol), agreement),
        Call("ECOS", "ecos", lambda: ecos_cones(problem, tol), agreement),
    ]
