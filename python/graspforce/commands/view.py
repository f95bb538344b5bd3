"""``graspforce view``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from graspforce.files import load_grasp, load_mesh, load_wrenches

from .output import note

__all__ = ["view"]


def view(
    grasp: Annotated[Path, typer.Argument(help="Grasp file: YAML, JSON or NPZ.")],
    mesh: Annotated[
        Path | None, typer.Option(help="The object's mesh, if the grasp file names none.")
    ] = None,
    wrenches: Annotated[Path | None, typer.Option(help="External wrenches to play: CSV or NPY.")] = None,
    port: Annotated[int, typer.Option(help="Where the page is served, on this machine only.")] = 8080,
) -> None:
    """Show a spatial grasp in the browser: sliders for friction and limits, contacts to drag, forces to play.

    Example: `graspforce view cup.yaml --wrenches lift.csv`
    """
    from graspforce.viewer.scene import serve  # noqa: PLC0415 - viser only where it is asked for
    from graspforce.viewer.scene import view as start  # noqa: PLC0415

    file = load_grasp(grasp)
    where = mesh or file.mesh
    given = None if wrenches is None else load_wrenches(wrenches, file.grasp.wrench_dim).wrenches
    viewer = start(file.grasp, None if where is None else load_mesh(where), given, port=port)
    note(f"http://127.0.0.1:{viewer.port}  (Ctrl-C ends)")
    serve(viewer)
