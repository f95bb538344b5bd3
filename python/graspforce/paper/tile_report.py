"""Text report of Example 2: iterates, printed ends, computing times of the plans, and forces."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from .examples import TILE, TILE_FORCE_MILLISECONDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from .tile import TilePlanRun, TileRun

_NOTES = """\
With the printed friction of 0.2, neither printed end is force closure: rho is positive there. At the end
for the maximum, no forces balance the wrenches of Figs. 6 and 7 at any time. The search finds force closure
elsewhere, after about twice the printed number of iterations.

Friction 0.68 is inferred. With it the printed psi_1 are local optima, and least forces behave as in Figs. 6
and 7. The computed ends still differ from the printed ones. The report does not explain the difference."""


def tile_report(run: TileRun) -> str:
    """Return the whole report, lines of at most 100 characters."""
    return "\n\n".join(section(run) for section in SECTIONS)


def _plans(run: TileRun) -> str:
    return "\n\n".join(_plan(result) for result in run.plans)


def _plan(run: TilePlanRun) -> str:
    criterion = run.plan.criterion
    published = TILE.published[criterion]
    label = "as printed" if run.as_printed else "inferred"
    lines = [
        f"Tile, least rho_{criterion}, friction {run.friction:g} ({label})",
        f"  {'k':>2}  {'phi_1, psi_1, phi_3, psi_3 (m)':<40} {'rho_' + criterion:>10}   largest step after",
    ]
    for k, row in enumerate(run.plan.history):
        lines.append(f"  {k:>2}  {_numbers(row.params)} {_rho(row.rho)}   {row.step.max():.6f}")
    lines.append(f"  published end, {published.iterations} iterations:")
    verdict = "force closure" if run.published_closure == "force" else "not force closure"
    lines.append(f"      {_numbers(published.params)} {_rho(run.published_rho)}   (rho here: {verdict})")
    return "\n".join(lines)


def _costs(run: TileRun) -> str:
    lines = [
        "Cost of a plan, one call from Python",
        "  friction criterion   published       here candidates  rejected polytopes converged",
    ]
    for result in run.plans:
        criterion, counts = result.plan.criterion, result.plan.counts
        minutes = f"{TILE.published[criterion].seconds / 60:.2f} min"
        lines.append(
            f"  {result.friction:<8g} {criterion:<9} {minutes:>11} {1e3 * result.seconds:>7.1f} ms "
            f"{counts.candidates:>10} {counts.rejected:>9} {counts.polytopes:>9} {counts.converged:>9}"
        )
    return "\n".join(lines)


def _forces(run: TileRun) -> str:
    lines = [
        "Least forces over one period at the printed optimum for the maximum, 1 kHz, smallest to largest",
        "  Fig.  friction objective     max(f_n / f_U)     sum(f_n / f_U) past limit  published      here",
    ]
    for result in run.forces:
        published = TILE_FORCE_MILLISECONDS.get((result.figure, result.objective))
        head = f"  {result.figure:<5} {result.friction:<8g} {result.objective:<9}"
        if result.balanced > 0:
            cost = f"{published:.2f} ms" if published else ""
            lines.append(
                f"{head} {_range(result.largest)} {_range(result.total)} {result.past_limit:>10.1%} "
                f"{cost:>10} {1e6 * result.seconds:>6.2f} us"
            )
        else:
            lines.append(f"{head} no forces balance the wrench at any time")
    return "\n".join(lines)


def _range(values: NDArray[np.float64]) -> str:
    return f"{np.nanmin(values):.4f} to {np.nanmax(values):.4f}".rjust(18)


def _notes(_: TileRun) -> str:
    notes = _NOTES.split("\n\n")
    return "\n".join(textwrap.fill(note, 98, initial_indent="- ", subsequent_indent="  ") for note in notes)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:9.6f}" for value in values)


def _rho(value: float) -> str:
    return f"{np.round(value, 6) + 0.0:11.6f}"


SECTIONS: list[Callable[[TileRun], str]] = [_plans, _costs, _forces, _notes]
"""What the report consists of, in order: each section makes its text from the run."""
