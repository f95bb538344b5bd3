"""Example 1 of the paper, computed: both plans of both grasps, Table 1, and computing times."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np

from graspforce._core import ForceDistributor, Grasp
from graspforce.errors import InfeasibleWrenchError
from graspforce.planning import Plan, plan
from graspforce.typing import CRITERIA

from .completed import completed
from .examples import RACKET, RACKET_WRENCH, TABLE_1, PlanningProblem, PublishedForces

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from graspforce.typing import Criterion

_T = TypeVar("_T")

REPEATS = 5
NOTES = (
    "Rows d and e agree with the printed table. Both three-finger plans agree with the printed ones.",
    (
        "The four-finger sum plan has many equally good ends. The tie rule here ends at another one than the "
        "printed end. The printed end of the four-finger max plan is near the computed one, and is worse."
    ),
    (
        "Rows k and n do not follow from the printed inputs. Other directions of the normals do not give "
        "them either, nor do changes of one or two printed constants, as far as they were tried. The report "
        "shows both columns, and does not explain the difference."
    ),
)


@dataclass(frozen=True, slots=True)
class PlanRun:
    """One plan, with the printed one of the same problem."""

    problem: PlanningProblem
    plan: Plan
    seconds: float
    rho_at_published_end: float

    def forces(self, params: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return the least contact forces (m, 2) in N against Table 1's wrench, in contact frames.

        None where no forces balance it.
        """
        distributor = ForceDistributor(grasp_at(self.problem, params), self.plan.criterion)
        try:
            return distributor.solve(RACKET_WRENCH).forces
        except InfeasibleWrenchError:
            return None

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, ready for JSON."""
        published = self.problem.published[self.plan.criterion]
        return {
            "problem": self.problem.name,
            "criterion": self.plan.criterion,
            "history": [row.to_dict() for row in self.plan.history],
            "candidates": self.plan.num_candidates,
            "seconds": self.seconds,
            "published": {
                "params": list(published.params),
                "iterations": published.iterations,
                "seconds": published.seconds,
                "rho_here": self.rho_at_published_end,
            },
        }


@dataclass(frozen=True, slots=True)
class TableCell:
    """Normalised normal forces under one objective, and the time to compute them."""

    max: float
    sum: float
    milliseconds: float


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row of Table 1, with published and computed forces of the same grasp."""

    letter: str
    published: PublishedForces
    least_sum: TableCell
    least_max: TableCell

    def columns(self) -> tuple[tuple[str, tuple[float, float, float], TableCell], ...]:
        """(objective, published, computed) of both halves of the row."""
        return (
            ("least sum", self.published.least_sum, self.least_sum),
            ("least max", self.published.least_max, self.least_max),
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, ready for JSON."""
        return {
            "row": self.letter,
            "problem": self.published.problem,
            "params": list(self.published.params),
            **{
                objective.replace(" ", "_"): {
                    "published": dict(zip(("max", "sum", "milliseconds"), published, strict=True)),
                    "computed": {"max": cell.max, "sum": cell.sum, "milliseconds": cell.milliseconds},
                }
                for objective, published, cell in self.columns()
            },
        }


@dataclass(frozen=True, slots=True)
class RacketRun:
    """Example 1, computed."""

    plans: tuple[PlanRun, ...]
    table: tuple[TableRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, ready for JSON."""
        return {
            "plans": [run.to_dict() for run in self.plans],
            "table_1": {
                "external_wrench": list(RACKET_WRENCH),
                "rows": [row.to_dict() for row in self.table],
            },
            "notes": list(NOTES),
        }


def run_racket(*, repeats: int = REPEATS) -> RacketRun:
    """Plan both grasps by both criteria and fill Table 1; times are the median of `repeats` runs.

    Examples
    --------
    >>> from graspforce.paper.racket import run_racket
    >>> run = run_racket(repeats=1)
    >>> [(p.problem.name, p.plan.criterion, len(p.plan.history) - 1) for p in run.plans[:2]]
    [('three fingers', 'max', 4), ('three fingers', 'sum', 4)]
    """
    plans = tuple(
        _run_plan(problem, criterion, repeats) for problem in RACKET.values() for criterion in CRITERIA
    )
    table = tuple(_fill_row(letter, row, repeats) for letter, row in TABLE_1.items())
    return RacketRun(plans, table)


def grasp_at(problem: PlanningProblem, params: NDArray[np.float64] | tuple[float, ...]) -> Grasp:
    """Grasp of a planning problem at its parameters (m,)."""
    positions, normals = problem.surface(np.asarray(params, dtype=np.float64)[None])
    return Grasp(
        positions[0], normals[0], friction=problem.friction, max_normal_force=problem.max_normal_force
    )


def _run_plan(problem: PlanningProblem, criterion: Criterion, repeats: int) -> PlanRun:
    found, seconds = _timed(
        lambda: completed(
            plan(
                problem.surface,
                problem.initial,
                problem.step,
                problem.tolerance,
                problem.bounds,
                criterion,
                friction=problem.friction,
                max_normal_force=problem.max_normal_force,
            )
        ),
        repeats,
    )
    published_end = grasp_at(problem, problem.published[criterion].params)
    return PlanRun(problem, found, seconds, published_end.quality(criterion).rho)


def _fill_row(letter: str, published: PublishedForces, repeats: int) -> TableRow:
    grasp = grasp_at(RACKET[published.problem], published.params)

    def cell(objective: Literal["max", "sum"]) -> TableCell:
        distributor = ForceDistributor(grasp, objective)
        solution, seconds = _timed(lambda: distributor.solve(RACKET_WRENCH), repeats)
        return TableCell(solution.sigma_max, solution.sigma_sum, 1e3 * seconds)

    return TableRow(letter, published, cell("sum"), cell("max"))


def _timed(run: Callable[[], _T], repeats: int) -> tuple[_T, float]:
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = run()
        seconds.append(time.perf_counter() - start)
    return result, statistics.median(seconds)
