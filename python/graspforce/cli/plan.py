"""``graspforce plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from graspforce.files import MeshPlanFile, PlanFile, load_problem

from .grasp_options import (
    PANEL,
    Edges,
    Friction,
    LengthScale,
    MaxNormalForce,
    Torsion,
    Unit,
    is_mesh,
    mesh_problem_from,
    refuse_with_a_file,
)
from .output import AsJson, Criterion, Plot, for_a_file, print_json, print_table, save, save_best, vector
from .plan_mesh import plan_on_mesh
from .progress import progress


def plan(
    problem: Annotated[
        Path,
        typer.Argument(metavar="PROBLEM", help="Plan file (YAML, JSON), or a mesh (GLB, OBJ, STL, ...)."),
    ],
    criterion: Criterion = "max",
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write the best grasp into FILE as a grasp file (json).",
            callback=for_a_file,
        ),
    ] = None,
    plot: Plot = None,
    contacts: Annotated[
        int | None, typer.Option(help="Number of contacts.  \\[default: 3]", rich_help_panel=PANEL)
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option(
            help="Number of searches, from starts all over the mesh.  \\[default: 100]", rich_help_panel=PANEL
        ),
    ] = None,
    best: Annotated[
        int | None,
        typer.Option(help="Number of distinct grasps to keep.  \\[default: 3]", rich_help_panel=PANEL),
    ] = None,
    unit: Unit = None,
    friction: Friction = None,
    max_normal_force: MaxNormalForce = None,
    edges: Edges = None,
    torsion: Torsion = None,
    length_scale: LengthScale = None,
    refine: Annotated[
        bool | None,
        typer.Option(
            "--refine/--no-refine",
            help="Refine the grasps by gradients.  \\[default: refine]",
            rich_help_panel=PANEL,
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the starts.  \\[default: 0]", rich_help_panel=PANEL)
    ] = None,
) -> None:
    """Search for the contact positions of the best quality, on curves, surfaces or a mesh.

    Example: `graspforce plan disc.yaml --criterion sum`
    """
    options = {
        "contacts": contacts, "starts": starts, "best": best, "friction": friction, "edges": edges,
        "max_normal_force": max_normal_force, "torsion": torsion, "length_scale": length_scale,
        "refine": refine, "seed": seed,
    }  # fmt: skip
    if is_mesh(problem):
        file: PlanFile | MeshPlanFile = mesh_problem_from(problem, unit, **options)
    else:
        refuse_with_a_file(unit=unit, **options)
        file = load_problem(problem)
    if isinstance(file, MeshPlanFile):
        plan_on_mesh(file, criterion, as_json=as_json, out=out, plot=plot)
    else:
        _plan_on_places(file, criterion, as_json=as_json, out=out, plot=plot)


def _plan_on_places(
    file: PlanFile, criterion: Criterion, *, as_json: bool, out: Path | None, plot: Path | None
) -> None:
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
        print_table(title, ("iteration", "parameters", f"rho_{criterion} (N)", "steps after"), rows)
        print(f"closure {found.quality.closure}, epsilon {found.quality.epsilon:.9g} N")
    if out is not None:
        save_best(out, found.grasp, name=file.name)
    if plot is not None:
        from graspforce.plotting import history_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        save(history_figure(found, title=file.name, **file.drawing()), plot)
