"""``graspforce quality``."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

from graspforce._core import Quality
from graspforce.files import GraspFile
from graspforce.files.wrench_file import COLUMNS

from .grasp_options import about_a_grasp, wrench_of
from .output import AsJson, Plot, print_json, print_table, save, vector
from .progress import progress


@about_a_grasp()
def quality(
    file: GraspFile,
    external_wrench: Annotated[
        str | None,
        typer.Option(
            help="Constant external wrench, such as the weight, in N and N m: fx,fy,tau or fx,fy,fz,tx,ty,tz."
        ),
    ] = None,
    rtol: Annotated[
        float | None, typer.Option(help="Relative width of the bracket at which the computation stops.")
    ] = None,
    as_json: AsJson = False,
    plot: Plot = None,
) -> None:
    """Compute the quality of a grasp by both criteria: the largest wrench it resists in the worst direction.

    Example: `graspforce quality cup.yaml --external-wrench 0,0,-3,0,0,0 --plot cup.png`
    """
    wrench = None
    if external_wrench is not None:
        wrench = wrench_of("--external-wrench", external_wrench, file.grasp.wrench_dim)
    with progress("measuring"):
        found = [file.grasp.quality(criterion, rtol, wrench) for criterion in ("max", "sum")]
    if as_json:
        numbers = {f"rho_{q.criterion}": q.to_dict() for q in found}
        given = None if wrench is None else wrench.tolist()
        print_json(
            {"file": str(file.path), "grasp": file.grasp.to_dict(), "external_wrench": given, **numbers}
        )
    else:
        _print(file, found)
    if plot is not None:
        from graspforce.plotting import quality_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        figure = quality_figure(
            file.grasp, found, title=file.name, outline=file.outline, mesh=file.object_mesh()
        )
        save(figure, plot)


def _print(file: GraspFile, found: list[Quality]) -> None:
    grasp = file.grasp
    rows = [
        ("epsilon (N)", *(f"{q.epsilon:.9g}" for q in found)),
        ("rho (N)", *(f"{q.rho:.9g}" for q in found)),
        ("proven within (N)", *(f"{q.upper - q.lower:.1e}" for q in found)),
        ("closure", *(q.closure for q in found)),
        ("converged", *("yes" if q.converged else "no" for q in found)),
    ]
    for i, name in enumerate(COLUMNS[grasp.wrench_dim]):
        label = f"weakest along {name}" if i == 0 else f"{name:>{len('weakest along ') + len(name)}}"
        rows.append((label, *(f"{round(float(q.direction[i]), 6) + 0.0:.6f}" for q in found)))
    kind = "planar" if grasp.wrench_dim == 3 else "spatial"
    title = f"{file.name}: {kind}, {grasp.num_contacts} contacts, length scale {grasp.length_scale:g} m"
    if np.abs(grasp.origin).max() > 1e-12 * grasp.length_scale:
        title += f", torques about {vector(grasp.origin, grasp.length_scale)} m"
    if found[0].external_wrench is not None:
        title += f", on top of {vector(found[0].external_wrench)}"
    print_table(title, ("", "max", "sum"), rows)
    if found[0].hint is not None:
        print(f"hint: {found[0].hint}")
