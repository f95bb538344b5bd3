"""Least forces beside general solvers, from Python: ``python benches/force.py``.

The paper's Example 2: four contacts with ten edges each on the tile, friction 0.68, limits of 10 N, under
the wrench of Fig. 6 sampled at 1 kHz over one period. Every solver gets the same linear program, one wrench
at a time and in order; solvers that can keep their data or their basis do. Everything is timed in one run,
so that ratios mean something on any machine. Solvers that are not installed are skipped:
``pip install --group bench`` brings them.
"""

from __future__ import annotations

import importlib
import statistics
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

import graspforce as gf
from graspforce.paper import TILE, TILE_WRENCHES
from graspforce.paper.tile import INFERRED_FRICTION

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Solve = Callable[[np.ndarray], float]
    Times = dict[str, tuple[float, float]]

RATE = 1000
BLOCK = 100


class LinearProgram:
    """``min t`` with forces ``W x = -w``, ``x >= 0`` and, for each contact, ``sum x <= t``."""

    def __init__(self, grasp: gf.Grasp) -> None:
        wrenches = grasp.primitive_wrenches
        count, dim = wrenches.shape
        contacts = grasp.num_contacts
        shares = np.repeat(np.eye(contacts), count // contacts, axis=1)
        self.dim = dim
        self.cost = np.append(np.zeros(count), 1.0)
        self.balance = sparse.csc_matrix(np.column_stack([wrenches.T, np.zeros(dim)]))
        self.limits = sparse.csc_matrix(np.column_stack([shares, -np.ones(contacts)]))


def scipy_linprog(problem: LinearProgram) -> Solve:
    from scipy.optimize import linprog  # noqa: PLC0415

    balance, limits, zeros = problem.balance, problem.limits, np.zeros(problem.limits.shape[0])
    tight = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}

    def solve(external: np.ndarray) -> float:
        found = linprog(problem.cost, limits, zeros, balance, -external, options=tight)
        assert found.status == 0, found.message
        return float(found.fun)

    return solve


def highs_warm(problem: LinearProgram) -> Solve:
    highspy: Any = importlib.import_module("highspy")
    rows = sparse.vstack([problem.balance, problem.limits]).tocsc()
    infinity = highspy.kHighsInf
    program = highspy.HighsLp()
    program.num_row_, program.num_col_ = rows.shape
    program.col_cost_ = problem.cost
    program.col_lower_ = np.zeros(rows.shape[1])
    program.col_upper_ = np.full(rows.shape[1], infinity)
    program.row_lower_ = np.where(np.arange(rows.shape[0]) < problem.dim, 0.0, -infinity)
    program.row_upper_ = np.zeros(rows.shape[0])
    program.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    program.a_matrix_.start_, program.a_matrix_.index_ = rows.indptr, rows.indices
    program.a_matrix_.value_ = rows.data
    highs = highspy.Highs()
    for option, value in {"output_flag": False, "threads": 1, "primal_feasibility_tolerance": 1e-10,
                          "dual_feasibility_tolerance": 1e-10}.items():  # fmt: skip
        highs.setOptionValue(option, value)
    highs.passModel(program)
    balanced = np.arange(problem.dim, dtype=np.int32)

    def solve(external: np.ndarray) -> float:
        highs.changeRowsBounds(problem.dim, balanced, -external, -external)
        highs.run()
        assert highs.getModelStatus() == highspy.HighsModelStatus.kOptimal
        return float(highs.getObjectiveValue())

    return solve


def clarabel_program(cost: np.ndarray, rows: sparse.csc_matrix, dim: int, cones: Callable[[Any], list[Any]],
                     *, keep: bool) -> Solve:  # fmt: skip
    clarabel: Any = importlib.import_module("clarabel")
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # what is presolved cannot be updated
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    quadratic = sparse.csc_matrix((len(cost), len(cost)))
    right = np.zeros(rows.shape[0])
    shapes = cones(clarabel)
    solver = clarabel.DefaultSolver(quadratic, cost, rows, right, shapes, settings)

    def solve(external: np.ndarray) -> float:
        nonlocal solver
        right[:dim] = -external
        if keep:
            solver.update(b=right)
        else:
            solver = clarabel.DefaultSolver(quadratic, cost, rows, right, shapes, settings)
        found = solver.solve()
        assert str(found.status) in {"Solved", "AlmostSolved"}, found.status
        return float(found.obj_val)

    return solve


def clarabel_linear(problem: LinearProgram, *, keep: bool) -> Solve:
    signs = -sparse.eye(len(problem.cost), format="csc")
    rows = sparse.vstack([problem.balance, problem.limits, signs]).tocsc()

    def cones(clarabel: Any) -> list[Any]:
        return [clarabel.ZeroConeT(problem.dim), clarabel.NonnegativeConeT(rows.shape[0] - problem.dim)]

    return clarabel_program(problem.cost, rows, problem.dim, cones, keep=keep)


def clarabel_true_cones(grasp: gf.Grasp, *, keep: bool) -> Solve:
    """``min t`` over forces f with ``G f = -w``, ``f_n <= f_U t`` and ``|f_t| <= mu f_n``."""
    contacts = grasp.num_contacts
    size = 3 * contacts
    balance = np.column_stack([grasp.grasp_matrix, np.zeros(grasp.wrench_dim)])
    normals = np.zeros((contacts, size + 1))
    normals[np.arange(contacts), np.arange(0, size, 3)] = 1 / TILE.max_normal_force
    normals[:, -1] = -1
    cone = -np.kron(np.eye(contacts), np.diag([INFERRED_FRICTION, 1, 1]))
    rows = sparse.csc_matrix(np.vstack([balance, normals, np.column_stack([cone, np.zeros(size)])]))

    def cones(clarabel: Any) -> list[Any]:
        friction = [clarabel.SecondOrderConeT(3)] * contacts
        return [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(contacts), *friction]

    return clarabel_program(np.append(np.zeros(size), 1.0), rows, 6, cones, keep=keep)


def ecos_linear(problem: LinearProgram) -> Solve:
    ecos: Any = importlib.import_module("ecos")
    signs = -sparse.eye(len(problem.cost), format="csc")
    rows = sparse.vstack([problem.limits, signs]).tocsc()
    right, dims = np.zeros(rows.shape[0]), {"l": rows.shape[0], "q": []}

    def solve(external: np.ndarray) -> float:
        found = ecos.solve(
            problem.cost, rows, right, dims, problem.balance, -external, verbose=False,
            abstol=1e-9, reltol=1e-9, feastol=1e-9,
        )  # fmt: skip
        assert found["info"]["exitFlag"] in {0, 10}, found["info"]
        return float(found["info"]["pcost"])

    return solve


def installed(name: str, make: Callable[[], Solve]) -> Solve | None:
    try:
        return make()
    except ImportError as error:
        print(f"{name} is skipped: {error} (pip install --group bench)")
        return None


def each(solve: Solve, wrenches: Sequence[np.ndarray]) -> tuple[float, np.ndarray]:
    """Median seconds a wrench, and the answers."""
    times, values = [], []
    for external in wrenches:
        start = time.perf_counter()
        values.append(solve(external))
        times.append(time.perf_counter() - start)
    return statistics.median(times), np.array(values)


def in_blocks(solve: Callable[[np.ndarray], object], wrenches: Sequence[np.ndarray]) -> tuple[float, float]:
    """Median and mean seconds a wrench over blocks of them: one call is too short for the clock."""
    times = []
    for first in range(0, len(wrenches), BLOCK):
        block = wrenches[first : first + BLOCK]
        start = time.perf_counter()
        for external in block:
            solve(external)
        times.append((time.perf_counter() - start) / len(block))
    return statistics.median(times), statistics.mean(times)


def ours(grasp: gf.Grasp, wrenches: np.ndarray, tol: float) -> tuple[Times, np.ndarray]:
    """Median and mean seconds a wrench by each call, and the objective values."""
    rows = list(wrenches)
    distributor = gf.ForceDistributor(grasp, "max", tol=tol)
    forces = np.empty((grasp.num_contacts, 3))
    batch_times = []
    for _ in range(5):
        start = time.perf_counter()
        batch = distributor.solve_many(wrenches)
        batch_times.append((time.perf_counter() - start) / len(wrenches))
    assert not batch.status.any()
    times: Times = {
        "solve_into": in_blocks(lambda external: distributor.solve_into(external, forces), rows),
        "solve": in_blocks(distributor.solve, rows),
        "solve_many, a row": (statistics.median(batch_times), statistics.mean(batch_times)),
    }
    values = np.array([distributor.solve_into(external, forces) for external in rows])
    np.testing.assert_allclose(batch.sigma_max, values, rtol=1e-12 if tol <= 1e-9 else 2 * tol)
    return times, values


def show(times: Times) -> None:
    print("\n| graspforce | median us | mean us |")
    print("|---|---|---|")
    for name, (median, mean) in times.items():
        print(f"| {name} | {1e6 * median:.3f} | {1e6 * mean:.3f} |")


def compare(name: str, seconds: float, times: Times, difference: float) -> None:
    ratios = [f"{seconds / median:.0f}" for median, _ in times.values()]
    print(f"| {name} | {1e6 * seconds:.1f} | {' | '.join(ratios)} | {difference:.1e} |", flush=True)


def heading() -> None:
    print("\n| peer | us | / solve_into | / solve | / solve_many | largest relative difference |")
    print("|---|---|---|---|---|---|")


def linear_programs(wrenches: np.ndarray) -> None:
    grasp = tile(TILE.edges)
    problem = LinearProgram(grasp)
    times, values = ours(grasp, wrenches, 1e-9)
    print(f"Linearised cones: {len(wrenches)} wrenches at {RATE} Hz, medians over blocks of {BLOCK}.")
    show(times)
    peers: dict[str, tuple[Callable[[], Solve], int, float]] = {
        "HiGHS, warm": (lambda: highs_warm(problem), 1, 1e-9),
        "ECOS": (lambda: ecos_linear(problem), 5, 1e-7),
        "Clarabel, kept": (lambda: clarabel_linear(problem, keep=True), 5, 1e-7),
        "Clarabel, fresh": (lambda: clarabel_linear(problem, keep=False), 5, 1e-7),
        "SciPy linprog": (lambda: scipy_linprog(problem), 20, 1e-9),
    }
    heading()
    for name, (make, stride, agreement) in peers.items():
        solve = installed(name, make)
        if solve is not None:
            median, found = each(solve, wrenches[::stride])
            difference = float(np.abs(found / values[::stride] - 1).max())
            compare(name, median, times, difference)
            assert difference < agreement, f"{name} disagrees"


def true_cones(wrenches: np.ndarray) -> None:
    grasp = tile(None)
    print("\nTrue cones, the same wrenches; relative gap 1e-6, differences measured at 1e-9.")
    times, _ = ours(grasp, wrenches, 1e-6)
    show(times)
    stride = 5
    exact = gf.ForceDistributor(grasp, "max", tol=1e-9).solve_many(wrenches[::stride])
    assert not exact.status.any()
    heading()
    for name, keep in (("Clarabel, kept", True), ("Clarabel, fresh", False)):
        solve = installed(name, lambda keep=keep: clarabel_true_cones(grasp, keep=keep))
        if solve is not None:
            median, found = each(solve, wrenches[::stride])
            difference = float(np.abs(found / exact.sigma_max - 1).max())
            compare(name, median, times, difference)
            assert difference < 1e-7, f"{name} disagrees"


def tile(edges: int | None) -> gf.Grasp:
    positions, normals = (x[0] for x in TILE.surface(np.array([TILE.published["max"].params])))
    limit = TILE.max_normal_force
    return gf.Grasp(positions, normals, friction=INFERRED_FRICTION, max_normal_force=limit, edges=edges)


def main() -> None:
    wrenches = TILE_WRENCHES[6].at(np.arange(TILE_WRENCHES[6].period * RATE) / RATE)
    linear_programs(wrenches)
    true_cones(wrenches)


if __name__ == "__main__":
    main()
