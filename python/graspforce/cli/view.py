"""``graspforce view``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from graspforce.files import GraspFile, load_mesh, load_wrenches

from .grasp_options import about_a_grasp
from .output import note


@about_a_grasp
def view(
    file: GraspFile,
    mesh: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The object's mesh in m, if the grasp file names none."),
    ] = None,
    wrenches: Annotated[
        Path | None, typer.Option(help="File of external wrenches to play, one a row (CSV, NPY).")
    ] = None,
    host: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Address to listen at; only this machine reaches the default."),
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=1, max=65535, help="Port of the page; the next free port if it is taken.")
    ] = 8080,
) -> None:
    """Show a spatial grasp in the browser, with sliders for friction and limits and contacts to drag.

    Open the printed address. It ends with a token that the page needs.

    Example: `graspforce view cup.yaml --wrenches lift.csv`
    """
    from graspforce.viewer import scene  # noqa: PLC0415 - viser only where it is asked for
    from graspforce.viewer.guard import is_loopback  # noqa: PLC0415 - the same

    surface = file.object_mesh() if mesh is None else load_mesh(mesh)
    given = None if wrenches is None else load_wrenches(wrenches, file.grasp.wrench_dim).wrenches
    with warnings.catch_warnings(action="ignore"):
        viewer = scene.view(file.grasp, surface, given, host=host, port=port)
    if not is_loopback(host):
        note(f"warning: {scene.exposure(host)}")
    scene.serve(viewer, lambda: note(f"{viewer.address}  (Ctrl-C ends)"))
