"""Text report of Example 1: iterations, Table 1 with published and computed columns, times."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from .examples import RACKET_WRENCH
from .racket import NOTES, REPEATS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .racket import PlanRun, RacketRun, TableRow


def racket_report(run: RacketRun) -> str:
    """Return the whole report, lines of at most 100 characters."""
    sections = [_plan(result) for result in run.plans]
    sections += [_times(run.plans), _table(run.table)]
    sections.append(
        "\n".join(textwrap.fill(note, 98, initial_indent="- ", subsequent_indent="  ") for note in NOTES)
    )
    return "\n\n".join(sections)


def _plan(run: PlanRun) -> str:
    criterion = run.plan.criterion
    published = run.problem.published[criterion]
    width = 10 * len(published.params)
    lines = [
        f"Racket, {run.problem.name}, least rho_{criterion}",
        f"  k  {'parameters':<{width}} {'rho_' + criterion:>10}   steps after",
    ]
    for k, row in enumerate(run.plan.history):
        lines.append(f"  {k}  {_numbers(row.params)} {row.rho:10.6f}   {_numbers(row.step)}")
    lines.append(f"  published end, {published.iterations} iterations:")
    lines.append(
        f"     {_numbers(published.params)} {run.rho_at_published_end:10.6f}   (rho as computed here)"
    )
    return "\n".join(lines)


def _times(plans: Iterable[PlanRun]) -> str:
    lines = [
        f"Time of a plan, median of {REPEATS} calls from Python",
        f"  {'grasp':<14} {'criterion':<10} {'published':>12} {'here':>12} {'candidates':>12}",
    ]
    for run in plans:
        criterion, milliseconds = run.plan.criterion, 1e3 * run.seconds
        published = run.problem.published[criterion].seconds
        times = f"{published:>10.2f} s {milliseconds:>9.2f} ms"
        lines.append(f"  {run.problem.name:<14} {criterion:<10} {times} {run.plan.num_candidates:>12}")
    return "\n".join(lines)


def _table(rows: Iterable[TableRow]) -> str:
    wrench = ", ".join(f"{x:g}" for x in RACKET_WRENCH)
    pair = f"{'published':>10} {'computed':>10}"
    lines = [
        f"Table 1: normalised normal forces against the external wrench [{wrench}] (N, N m)",
        f"  {'':<5} {'':<10} {'max(f_n / f_U)':>21}  {'sum(f_n / f_U)':>21}  {'time (ms)':>21}",
        f"  {'grasp':<5} {'objective':<10} {pair}  {pair}  {pair}",
    ]
    for row in rows:
        for objective, published, cell in row.columns():
            columns = [
                f"{published[0]:>10.4f} {cell.max:>10.4f}",
                f"{published[1]:>10.4f} {cell.sum:>10.4f}",
                f"{published[2]:>10.2f} {cell.milliseconds:>10.4f}",
            ]
            lines.append(f"  {row.letter:<5} {objective:<10} {'  '.join(columns)}")
    return "\n".join(lines)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:9.6f}" for value in values)
