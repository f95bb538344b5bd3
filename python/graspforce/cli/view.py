"""``graspforce view``."""

from __future__ import annotations

import contextlib
import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from graspforce._internal.safe_read import limited_bytes
from graspforce.errors import InvalidInputError
from graspforce.files import GraspFile, load_mesh, load_wrenches

from .grasp_options import about_a_grasp, grasp_from, refuse_with_a_file
from .output import note

if TYPE_CHECKING:
    from graspforce._core import Grasp
    from graspforce.hands import HandPlan

_LARGEST_FILE = 1 << 24
"""Size in bytes up to which a JSON file may be a hand's plan."""


def _grasp_or_plan(
    path: Path, at: list[str] | None, unit: str | None, **options: float | None
) -> GraspFile | Path:
    """Read a grasp, or return the path of a hand's plan."""
    if not _is_plan(path):
        return grasp_from(path, at, unit, **options)
    refuse_with_a_file(at=at, unit=unit, **options)
    return path


@about_a_grasp(_grasp_or_plan)
def view(
    file: GraspFile | Path,
    mesh: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The object's mesh in m, if the file names none."),
    ] = None,
    wrenches: Annotated[
        Path | None, typer.Option(help="File of external wrenches to play, one a row (CSV, NPY).")
    ] = None,
    host: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Address to listen at; only this machine reaches the default."),
    ] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Port of the page; 0 for any.  \\[default: 8080, or the next free one]",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Show a spatial grasp, or the plan of a hand, in the browser.

    Sliders change friction and limits, and contacts can be dragged. A hand moves from pregrasp to squeeze.
    Open the printed address. It ends with a token that the page needs.

    Example: `graspforce view cup.yaml --wrenches lift.csv`
    """
    from graspforce.viewer import scene  # noqa: PLC0415 - viser only where it is asked for
    from graspforce.viewer.guard import exposure, is_loopback  # noqa: PLC0415 - the same

    grasp, surface, title = _shown(file)
    surface = surface if mesh is None else load_mesh(mesh)
    dim = getattr(grasp, "wrench_dim", 6)
    given = None if wrenches is None else load_wrenches(wrenches, dim)
    with warnings.catch_warnings(action="ignore"), _blamed_on_options():
        viewer = scene.view(
            grasp, surface, None if given is None else given.wrenches,
            times=None if given is None else given.times, title=title, host=host, port=port,
        )  # fmt: skip
    if not is_loopback(host):
        note(f"warning: {exposure(host)}")
    scene.serve(viewer, lambda: note(f"{viewer.address}  (Ctrl-C ends)"))


def _is_plan(path: Path) -> bool:
    if path.suffix.lower() != ".json":
        return False
    try:
        content = json.loads(limited_bytes(path, _LARGEST_FILE))
    except (ValueError, RecursionError):
        return False  # the reader of grasp files says what is wrong
    return isinstance(content, dict) and content.get("kind") == "hand plan"


def _shown(file: GraspFile | Path) -> tuple[Grasp | HandPlan, Any, str]:
    """Return what is shown, the object's mesh or None, and the title of the page."""
    if isinstance(file, GraspFile):
        return file.grasp, file.object_mesh(), file.path.name
    from graspforce.hands.hand_plan import loaded_plan  # noqa: PLC0415 - MuJoCo only where it is asked for

    from .plan_hand import object_mesh  # noqa: PLC0415 - the same

    plan, named = loaded_plan(file)
    return plan, None if named is None else object_mesh(*named), file.name


@contextlib.contextmanager
def _blamed_on_options() -> Any:
    """Say of a wrong port or address which option gave it."""
    try:
        yield
    except InvalidInputError as error:
        name, _, message = str(error).partition(": ")
        if name not in ("host", "port"):
            raise
        raise typer.BadParameter(message, param_hint=f"--{name}") from None
