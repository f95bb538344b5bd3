"""``graspforce forces``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import numpy as np
import typer

from graspforce._core import ForceDistributor
from graspforce._internal.html import FORCE_COMPONENTS
from graspforce._internal.normal_limits import normal_limits
from graspforce.files import GraspFile, load_wrenches

from .exit_codes import INFEASIBLE, PAST_LIMITS
from .grasp_options import about_a_grasp, wrench_of
from .output import AsJson, Objective, Plot, for_a_file, note, print_json, print_table, rounded, save, vector
from .progress import progress
from .trajectory import Trajectory, solve_trajectory

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce._core import ForceSolution

_NO_MARGIN = 5e-5
_ON_THE_CONE = (
    "slip margin 0: the force lies on its friction cone, as least forces do; a friction_margin of 1.5 in the "
    "file keeps a third of the friction in reserve"
)


@about_a_grasp()
def forces(
    file: GraspFile,
    wrench: Annotated[
        str | None, typer.Option(help="External wrench in N and N m: fx,fy,tau or fx,fy,fz,tx,ty,tz.")
    ] = None,
    wrenches: Annotated[
        Path | None, typer.Option(help="File of external wrenches, one a row (CSV, NPY).")
    ] = None,
    objective: Objective = "max",
    nearest: Annotated[
        bool,
        typer.Option(
            "--nearest",
            help="Keep the limits. If no forces within them balance the wrench, give the nearest ones.",
        ),
    ] = False,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write all contact forces into FILE (npz).", callback=for_a_file),
    ] = None,
    plot: Plot = None,
) -> None:
    """Compute the least contact forces that balance one or many external wrenches.

    Example: `graspforce forces cup.yaml --wrench 0,0,-5,0,0,0`
    """
    if (wrench is None) == (wrenches is None):
        raise typer.BadParameter("give either --wrench or --wrenches")
    distributor = ForceDistributor(file.grasp, objective)
    if wrench is not None:
        against = wrench_of("--wrench", wrench, file.grasp.wrench_dim)
        solution = distributor.nearest(against) if nearest else distributor.solve(against)
        _one(file, against, solution, objective, nearest=nearest, as_json=as_json, plot=plot)
        found = Trajectory.of_one(against, solution)
    else:
        given = load_wrenches(cast("Path", wrenches), file.grasp.wrench_dim)
        with progress("distributing", len(given.wrenches)) as done:
            found = solve_trajectory(distributor, given, done, nearest=nearest)
        sought = "nearest forces" if nearest else f"least {objective}"
        _many(file, found, objective, sought, as_json=as_json, plot=plot)
    if out is not None:
        with out.open("wb") as stream:
            np.savez(stream, **found.arrays())
        note(f"wrote {out}")
    if found.infeasible.any():
        raise typer.Exit(INFEASIBLE)
    if not found.within_limits.all():
        raise typer.Exit(PAST_LIMITS)


def _one(
    file: GraspFile,
    wrench: NDArray[np.float64],
    solution: ForceSolution,
    objective: str,
    *,
    nearest: bool,
    as_json: bool,
    plot: Path | None,
) -> None:
    sought = "nearest forces" if nearest else f"least {objective}"
    title = f"{file.name}: {sought} against {vector(wrench)}"
    if as_json:
        print_json(solution.to_dict())
    else:
        columns = zip(solution.forces, solution.shares, solution.slip_margin, strict=True)
        scale = float(np.abs(solution.forces).max())
        rows = [
            (str(i), vector(force, scale), rounded(share), rounded(margin))
            for i, (force, share, margin) in enumerate(columns)
        ]
        names = FORCE_COMPONENTS[file.grasp.force_dim]
        print_table(title, ("contact", f"force {names} (N)", "share of limit", "slip margin"), rows)
        if (solution.slip_margin < _NO_MARGIN).any():
            print(_ON_THE_CONE)
        limits = "within limits" if solution.within_limits else "ABOVE THE LIMITS"
        print(f"sigma_max {solution.sigma_max:.6g}, sigma_sum {solution.sigma_sum:.6g}: {limits}")
        if nearest:
            left = f"{solution.distance:.6g} from balance: {vector(solution.residual)} stays unbalanced"
            print("balanced" if solution.balanced else left)
    if plot is not None:
        from graspforce.plotting import solution_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        figure = solution_figure(solution, title=title, outline=file.outline, mesh=file.object_mesh())
        save(figure, plot)


def _many(
    file: GraspFile, found: Trajectory, objective: str, sought: str, *, as_json: bool, plot: Path | None
) -> None:
    if as_json:
        print_json({"objective": objective, **found.to_dict()})
    else:
        answered = ~found.infeasible
        rows = [
            ("wrenches", str(len(found.infeasible))),
            ("cannot be balanced", str(int(found.infeasible.sum()))),
        ]
        if answered.any():
            worst = int(np.nanargmax(found.sigma_max))
            rows += [
                ("above the limits", str(int((answered & ~found.within_limits).sum()))),
                ("largest sigma_max", f"{found.sigma_max[worst]:.6g} (row {worst})"),
                ("largest sigma_sum", f"{np.nanmax(found.sigma_sum):.6g}"),
                ("median sigma_max", f"{np.nanmedian(found.sigma_max):.6g}"),
            ]
            apart = answered & ~found.balanced
            if apart.any():
                worst = int(np.nanargmax(found.distance))
                rows += [
                    ("not balanced", str(int(apart.sum()))),
                    ("largest distance from balance", f"{found.distance[worst]:.6g} (row {worst})"),
                ]
        if found.infeasible.any():
            rows.append(("first that cannot be balanced", f"row {int(np.argmax(found.infeasible))}"))
        print_table(f"{file.name}: {sought}", ("", ""), rows)
    if plot is not None:
        from graspforce.plotting import trajectory_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        limits, title = normal_limits(file.grasp), f"{file.name}: {sought}"
        figure = trajectory_figure(found.forces[:, :, 0], limits, times=found.times, title=title)
        save(figure, plot)
