"""Least squares of forces, and the nearest wrench: two quadratic programs over friction cones.

Clarabel and ECOS take true cones. DAQP, ProxQP and OSQP take linear constraints: they get inscribed pyramids.
Every solver keeps what it can; only the right-hand side changes with the wrench.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from .programs import cone_planes
from .quadratic import UNBOUNDED, osqp_again
from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

    import graspforce as gf

    Solve = Callable[[np.ndarray], float]

TOLERANCE = 1e-9
CONE_AGREEMENT = 1e-7
FIRST_ORDER = {"eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 20_000}


class LeastSquares:
    """``min x diag(squares) x / 2`` with ``balance x = -w``; x begins with forces, in their cones.

    The forces are those of ``objective="squares"``, or of ``nearest``. The latter has the residual
    ``r = G f + w`` at the end of x, squares it alone, and keeps ``f_n`` within the limits. Its answer is the
    distance.
    """

    def __init__(self, grasp: gf.Grasp, *, nearest: bool) -> None:
        self.dim, forces = grasp.wrench_dim, 3 * grasp.num_contacts
        self.contacts, self.nearest = grasp.num_contacts, nearest
        self.size = forces + self.dim * nearest
        normals = np.zeros((self.contacts * nearest, self.size))
        self.limits, self.bounds = normals, grasp.max_normal_force[: len(normals)]
        if nearest:
            torque = 1 / grasp.length_scale**2
            self.squares = np.concatenate([np.zeros(forces), [1, 1, 1, torque, torque, torque]])
            self.balance = np.column_stack([grasp.grasp_matrix, -np.eye(self.dim)])
            normals[np.arange(self.contacts), np.arange(0, forces, 3)] = 1
        else:
            self.squares = np.ones(forces)
            self.balance = grasp.grasp_matrix
        rest = np.zeros((forces, self.size - forces))
        cones = sparse.block_diag([np.diag([mu, 1, 1]) for mu in grasp.friction]).toarray()
        self.cones = np.column_stack([cones, rest])
        # Rows whose products with x are at most zero: no rows where cones are true.
        planes = sparse.block_diag(list(cone_planes(grasp))).toarray() if min(grasp.num_edges) else rest[:0]
        self.planes = np.zeros((len(planes), self.size))
        self.planes[:, : planes.shape[1]] = planes

    def answer(self, half_square: float) -> float:
        """Return the sum of squares over two, or the distance."""
        return float(np.sqrt(max(2 * half_square, 0.0))) if self.nearest else float(half_square)


def clarabel_kept(problem: LeastSquares) -> Solve:
    import clarabel  # noqa: PLC0415

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # what is presolved cannot be updated
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    inequalities = np.vstack([problem.limits, problem.planes])
    cones = [clarabel.ZeroConeT(problem.dim)]
    if len(inequalities):
        cones.append(clarabel.NonnegativeConeT(len(inequalities)))
    rows = [problem.balance, inequalities]
    if not len(problem.planes):
        rows.append(-problem.cones)
        cones += [clarabel.SecondOrderConeT(3)] * problem.contacts
    stacked = np.vstack(rows)
    right = np.zeros(len(stacked))
    right[problem.dim : problem.dim + len(problem.bounds)] = problem.bounds
    solver = clarabel.DefaultSolver(
        sparse.diags(problem.squares, format="csc"), np.zeros(problem.size), sparse.csc_matrix(stacked),
        right, cones, settings,
    )  # fmt: skip

    def solve(external: np.ndarray) -> float:
        right[: problem.dim] = -external
        solver.update(b=right)
        found = solver.solve()
        if found.status not in {clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved}:
            raise UnsolvedError
        return problem.answer(found.obj_val)

    return solve


def ecos_kept(problem: LeastSquares) -> Solve:
    """ECOS takes linear objectives: the norm instead of its square, as one more cone."""
    import ecos  # noqa: PLC0415

    size = problem.size
    counted = np.flatnonzero(problem.squares)
    norm = np.zeros((1 + len(counted), size + 1))
    norm[0, size] = -1
    norm[np.arange(1, len(norm)), counted] = -np.sqrt(problem.squares[counted])
    inequalities = np.vstack([problem.limits, problem.planes])
    cones = problem.cones if not len(problem.planes) else problem.cones[:0]
    without = np.vstack([inequalities, -cones])
    rows = sparse.csc_matrix(np.vstack([np.column_stack([without, np.zeros(len(without))]), norm]))
    balance = sparse.csc_matrix(np.column_stack([problem.balance, np.zeros(problem.dim)]))
    dims = {"l": len(inequalities), "q": [3] * (len(cones) // 3) + [len(norm)]}
    right, cost = np.zeros(rows.shape[0]), np.append(np.zeros(size), 1.0)
    right[: len(problem.bounds)] = problem.bounds

    def solve(external: np.ndarray) -> float:
        found = ecos.solve(
            cost, rows, right, dims, balance, -external,
            verbose=False, abstol=TOLERANCE, reltol=TOLERANCE, feastol=TOLERANCE,
        )  # fmt: skip
        if found["info"]["exitFlag"] not in {0, 10}:
            raise UnsolvedError
        return problem.answer(found["info"]["pcost"] ** 2 / 2)

    return solve


def daqp_kept(problem: LeastSquares) -> Solve:
    import daqp  # noqa: PLC0415

    dim, inequalities = problem.dim, len(problem.limits) + len(problem.planes)
    rows = np.vstack([problem.balance, problem.limits, problem.planes])
    low = np.concatenate([np.zeros(dim), np.full(inequalities, -UNBOUNDED)])
    high = np.concatenate([np.zeros(dim), problem.bounds, np.zeros(len(problem.planes))])
    sense = np.zeros(len(low), dtype=np.int32)
    sense[:dim] = 5  # an equality
    model = daqp.Model()
    model.setup(np.diag(problem.squares), np.zeros(problem.size), rows, high, low, sense)
    model.settings = {"primal_tol": 1e-9, "dual_tol": 1e-9}

    def solve(external: np.ndarray) -> float:
        low[:dim] = high[:dim] = -external
        model.update(bupper=high, blower=low)
        _, value, flag, _ = model.solve()
        if flag != 1:
            raise UnsolvedError
        return problem.answer(value)

    return solve


def proxqp_kept(problem: LeastSquares, guess: str) -> Solve:
    """Take the sparse backend: the dense one of 0.8.0 crashes when it is started warm.

    Started from the last solution it calls most jumps infeasible, and all that follow them.
    """
    from proxsuite import proxqp  # noqa: PLC0415

    rows = np.vstack([problem.limits, problem.planes])
    high = np.concatenate([problem.bounds, np.zeros(len(problem.planes))])
    solver = proxqp.sparse.QP(problem.size, problem.dim, len(rows))
    solver.settings.eps_abs, solver.settings.eps_rel = TOLERANCE, 0
    solver.settings.initial_guess = getattr(proxqp.InitialGuess, guess)
    zero, low = np.zeros(problem.size), np.full(len(rows), -np.inf)
    squares = sparse.diags(problem.squares, format="csc")
    balance, inequalities = sparse.csc_matrix(problem.balance), sparse.csc_matrix(rows)
    solver.init(squares, zero, balance, np.zeros(problem.dim), inequalities, low, high)

    def solve(external: np.ndarray) -> float:
        solver.update(b=-external)
        solver.solve()
        if solver.results.info.status != proxqp.QPSolverOutput.PROXQP_SOLVED:
            raise UnsolvedError
        return problem.answer(solver.results.info.objValue)

    return solve


def osqp_kept(problem: LeastSquares) -> Solve:
    import osqp  # noqa: PLC0415

    dim = problem.dim
    rows = sparse.csc_matrix(np.vstack([problem.balance, problem.limits, problem.planes]))
    low = np.concatenate([np.zeros(dim), np.full(rows.shape[0] - dim, -np.inf)])
    high = np.concatenate([np.zeros(dim), problem.bounds, np.zeros(len(problem.planes))])
    solver = osqp.OSQP()
    squares = sparse.diags(problem.squares, format="csc")
    solver.setup(squares, np.zeros(problem.size), rows, low, high, verbose=False, **FIRST_ORDER)
    return osqp_again(solver, low, high, dim, lambda found: problem.answer(found.info.obj_val))


def cone_calls(problem: LeastSquares) -> list[Call]:
    """Solvers that take the cones of the problem as they are, true or not."""
    return [
        Call("Clarabel, kept", "clarabel", lambda: clarabel_kept(problem), CONE_AGREEMENT),
        Call("ECOS", "ecos", lambda: ecos_kept(problem), CONE_AGREEMENT),
    ]


def linear_calls(problem: LeastSquares, where: str = "") -> list[Call]:
    """Solvers of linear constraints; ``where`` says on which cones if the question has others."""

    def call(name: str, package: str, make: Callable[[], Solve], tolerance: float) -> Call:
        solver, _, start = name.partition(", ")
        # The answers on other cones are others, by as much as is printed.
        return Call(f"{solver}{where}, {start}", package, make, np.inf if where else tolerance)

    def proxqp(guess: str) -> Callable[[], Solve]:
        return lambda: proxqp_kept(problem, guess)

    return [
        call("DAQP, kept", "daqp", lambda: daqp_kept(problem), 1e-9),
        call("ProxQP, warm", "proxsuite", proxqp("WARM_START_WITH_PREVIOUS_RESULT"), 1e-6),
        call("ProxQP, kept", "proxsuite", proxqp("EQUALITY_CONSTRAINED_INITIAL_GUESS"), 1e-6),
        call("OSQP, kept", "osqp", lambda: osqp_kept(problem), 1e-4),
    ]
