"""``graspforce plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from graspforce.files import load_problem

from .output import AsJson, Criterion, print_json, print_table, save, vector
from .progress import progress

__all__ = ["plan"]


def plan(
    problem: Annotated[Path, typer.Argument(help="Plan file: YAML or JSON.")],
    criterion: Criterion = "max",
    as_json: AsJson = False,
    plot: Annotated[Path | None, typer.Option(help="Draw the search into FILE (png, pdf, svg).")] = None,
) -> None:
    """Search for the best contact positions by the paper's pattern search.

    Example: `graspforce plan disc.yaml --criterion sum`
    """
    file = load_problem(problem)
    with progress("planning"):
        found = file.plan(criterion)
    if as_json:
        print_json(found.to_dict())
    else:
        rows = [
            (str(k), vector(row.params), f"{row.rho:.9g}", vector(row.step))
            for k, row in enumerate(found.history)
        ]
        title = f"{file.name}: least rho_{criterion}, {found.num_candidates} candidates"
        print_table(title, ("iteration", "parameters", f"rho_{criterion}", "steps after"), rows)
        print(f"closure {found.quality.closure}, epsilon {found.quality.epsilon:.9g}")
    if plot is not None:
        from graspforce.plotting import history_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        save(history_figure(found, title=file.name, outline=file.outline), plot)
