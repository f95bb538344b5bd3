"""What a solver of linear constraints costs where its pyramids come near to true cones.

``python -m benches.compare.fine_pyramids`` solves least squares and nearest forces of the tile over true
cones. DAQP gets the same wrenches over inscribed pyramids of more and more edges, Clarabel over true cones.
All take turns in blocks of 50 wrenches, each once untimed and once timed. The figures are medians of
processor time.
"""

from __future__ import annotations

import time
import warnings
from typing import TYPE_CHECKING

import numpy as np

import graspforce as gf

from .force_questions import jumps, tile, trajectory
from .least_squares import LeastSquares, clarabel_kept, daqp_kept
from .timing import UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

EDGES = (10, 128, 512, 2048)
BLOCK = 50
COUNT = 200


def ask(solve: Callable[[np.ndarray], float], wrenches: list[np.ndarray]) -> list[float]:
    """Return the answers, NaN where there is none."""
    answers = []
    for wrench in wrenches:
        try:
            answers.append(solve(wrench))
        except UnsolvedError:
            answers.append(np.nan)
    return answers


def measured(wrenches: list[np.ndarray], *, nearest: bool) -> list[tuple[str, float, float, int]]:
    """Return names, seconds of a call, the largest relative difference and unsolved calls, ours first."""
    distributor = gf.ForceDistributor(tile(None), "squares")
    forces = np.empty((tile(None).num_contacts, 3))
    call = distributor.nearest_into if nearest else distributor.solve_into
    solvers: dict[str, Callable[[np.ndarray], float]] = {"graspforce": lambda wrench: call(wrench, forces)}
    solvers["Clarabel, true cones"] = clarabel_kept(LeastSquares(tile(None), nearest=nearest))
    for edges in EDGES:
        solvers[f"DAQP, {edges:,} edges"] = daqp_kept(LeastSquares(tile(edges), nearest=nearest))
    exact = np.array([call(wrench, forces) for wrench in wrenches])
    answers: dict[str, list[float]] = {name: [] for name in solvers}
    spent: dict[str, list[float]] = {name: [] for name in solvers}
    for start in range(0, len(wrenches), BLOCK):
        block = wrenches[start : start + BLOCK]
        for name, solve in solvers.items():
            # Once untimed: the solver before left its own data in the processor's cache.
            ask(solve, block)
            before = time.process_time()
            answers[name] += ask(solve, block)
            spent[name].append((time.process_time() - before) / len(block))
    off = {name: np.abs(np.array(found) - exact) / exact for name, found in answers.items()}
    return [
        (name, float(np.median(spent[name])), float(np.nanmax(off[name])), int(np.isnan(off[name]).sum()))
        for name in solvers
    ]


def main() -> None:
    """Print a table for each family of wrenches."""
    warnings.simplefilter("ignore")
    path, jumped = trajectory(COUNT), jumps(7, COUNT)
    for name, wrenches, nearest in (
        ("squares, 1 kHz trajectory", path, False),
        ("squares, random jumps", jumped, False),
        ("nearest, twice the trajectory", [2 * wrench for wrench in path], True),
        ("nearest, jumps beyond the limits", [60 * wrench for wrench in jumped], True),
    ):
        print(f"| {name} | time of a call (us) | ratio | largest relative difference | not solved |")
        print("|---|---|---|---|---|")
        rows = measured(wrenches, nearest=nearest)
        for solver, seconds, off, unsolved in rows:
            print(f"| {solver} | {1e6 * seconds:.3g} | {seconds / rows[0][1]:.3g} | {off:.0e} | {unsolved} |")
        print()


if __name__ == "__main__":
    main()
