"""Options of a mesh that stands in place of a grasp or plan file."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

import typer

from graspforce._internal.printable import printable
from graspforce.errors import InvalidFileError, InvalidInputError
from graspforce.files import GraspFile, MeshPlanFile, load_grasp
from graspforce.files.grasp_file import grasp_of
from graspforce.files.mesh_plan_file import mesh_problem
from graspforce.files.schema import GraspModel
from graspforce.files.wrench_file import numbers_of, parse_wrench
from graspforce.files.yaml_document import Document
from graspforce.surfaces.mesh_file import FORMATS, unreadable_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np
    from numpy.typing import NDArray

    from graspforce.surfaces import MeshSurface

PANEL = "With a mesh in place of a file"
_DOCUMENTS = ("", "json", "npz", "txt", "yaml", "yml")
_OTHER_MESHES = (
    "3ds",
    "blend",
    "dae",
    "fbx",
    "iges",
    "igs",
    "msh",
    "step",
    "stp",
    "usd",
    "usdz",
    "vtk",
    "wrl",
    "x3d",
)

GraspArgument = Annotated[
    Path, typer.Argument(metavar="GRASP", help="Grasp file (YAML, JSON, NPZ), or a mesh with --at.")
]
At = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X,Y,Z",
        help="Point in m; the nearest point of the mesh is a contact. Repeat the option for each contact.",
        rich_help_panel=PANEL,
    ),
]
Unit = Annotated[
    Literal["m", "dm", "cm", "mm", "in", "ft"] | None,
    typer.Option(help="Unit of the mesh's vertices.  \\[default: m]", rich_help_panel=PANEL),
]
Friction = Annotated[
    float | None, typer.Option(help="Coulomb coefficient.  \\[default: 0.5]", rich_help_panel=PANEL)
]
MaxNormalForce = Annotated[
    float | None,
    typer.Option(help="Limit of each normal force in N.  \\[default: 1]", rich_help_panel=PANEL),
]
Edges = Annotated[
    int | None,
    typer.Option(
        help="Edges of the linearised friction cones; 0 for true cones.  \\[default: 8]",
        rich_help_panel=PANEL,
    ),
]
Torsion = Annotated[
    float | None,
    typer.Option(
        help="Torsional coefficient in m; soft fingers where positive.  \\[default: 0]", rich_help_panel=PANEL
    ),
]
LengthScale = Annotated[
    float | None,
    typer.Option(
        help="Length in m by which torques are divided in the norm of wrenches.  "
        "\\[default: half the mesh's extent]",
        rich_help_panel=PANEL,
    ),
]


CONTACT_OPTIONS: dict[str, Any] = {
    "friction": Friction, "max_normal_force": MaxNormalForce, "edges": Edges, "torsion": Torsion,
    "length_scale": LengthScale,
}  # fmt: skip
"""Of all contacts on a mesh, in every command that takes one."""


def about_a_grasp(
    read: Callable[..., object] | None = None,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command of a `GraspFile` the argument GRASP and the options of a mesh in its place.

    The command's first parameter is what `read`, or by default `grasp_from`, returns.
    """
    added = {"at": At, "unit": Unit, **CONTACT_OPTIONS}

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def run(grasp: Path, at: list[str] | None, unit: str | None, **options: Any) -> None:
            given = {name: options.pop(name) for name in CONTACT_OPTIONS}
            command((read or grasp_from)(grasp, at, unit, **given), **options)

        _, *own = inspect.signature(command, eval_str=True).parameters.values()
        kind = inspect.Parameter.KEYWORD_ONLY
        parameters = [
            inspect.Parameter("grasp", kind, annotation=GraspArgument),
            *(parameter.replace(kind=kind) for parameter in own),
            *(inspect.Parameter(n, kind, default=None, annotation=option) for n, option in added.items()),
        ]
        # Typer reads both.
        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        del run.__wrapped__
        return run

    return decorated


def is_mesh(path: Path, *, as_mesh: bool = False) -> bool:
    """Whether a file is a mesh, by its suffix; what is not there, or cannot be read, is refused.

    Of a file that must be a mesh, `as_mesh`, other suffixes are refused.
    """
    kind = path.suffix.lower().removeprefix(".")
    if not path.exists():
        raise InvalidFileError(path, "No such file or directory")
    if kind in FORMATS:
        return True
    if kind in _OTHER_MESHES or (as_mesh and kind not in _DOCUMENTS):
        raise InvalidFileError(path, unreadable_kind(kind))
    return False


def grasp_from(path: Path, at: list[str] | None, unit: str | None, **options: float | None) -> GraspFile:
    """Read a grasp file, or a mesh with the contacts and options of the command line."""
    if not is_mesh(path, as_mesh=bool(at)):
        refuse_with_a_file(at=at, unit=unit, **options)
        return load_grasp(path)
    if not at:
        raise typer.BadParameter("a mesh has no contacts: give x,y,z of each contact", param_hint="--at")
    contacts = [{"point": _point(text)} for text in at]
    document = _document(path, unit, {"contacts": contacts, **_given(options)})
    with _blamed_on({"contacts": "--at"}, options):
        file = grasp_of(document, document.parsed(GraspModel))
    surface = cast("MeshSurface", file.surface)
    measured: dict[str, Any] = {"origin": surface.center}
    if options["length_scale"] is None:
        measured["length_scale"] = surface.length_scale
    return dataclasses.replace(file, grasp=file.grasp.replace(**measured))


def mesh_problem_from(path: Path, unit: str | None, **options: float | None) -> MeshPlanFile:
    """Make the planning problem on a mesh that the command line's options describe."""
    with _blamed_on({}, options):
        return mesh_problem(_document(path, unit, _given(options)))


def wrench_of(flag: str, text: str, wrench_dim: int) -> NDArray[np.float64]:
    """Read a wrench that an option of this name gives."""
    try:
        return parse_wrench(text, wrench_dim, flag)
    except InvalidInputError as error:
        message = printable(str(error).removeprefix(f"{flag}: "))
        raise typer.BadParameter(message, param_hint=flag) from None


@contextlib.contextmanager
def _blamed_on(flags: dict[str, str], options: dict[str, float | None]) -> Iterator[None]:
    """Say of a wrong field which option gave it."""
    try:
        yield
    except InvalidFileError as error:
        name = str(error.field[0]) if error.field else ""
        if name not in flags and name not in options:
            raise
        message = str(error).removeprefix(f"{error.path}: ").partition(": ")[2]
        if name == "contacts" and len(error.field) > 1:
            message = f"contact {error.field[1]}: {message}"
        raise typer.BadParameter(printable(message), param_hint=flags.get(name, _flag(name))) from None


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def refuse_with_a_file(**options: object) -> None:
    """Refuse options that only go with a mesh: what a file says is said there."""
    for name, value in options.items():
        if value is not None and value != []:
            message = "only with a mesh; a grasp or plan file has a field for it"
            raise typer.BadParameter(message, param_hint=_flag(name))


def _document(path: Path, unit: str | None, fields: dict[str, Any]) -> Document:
    mesh = {"file": path.name} | ({} if unit is None else {"unit": unit})
    return Document(path, {"mesh": mesh, **fields}, {}, mesh=path)


def _given(options: dict[str, float | None]) -> dict[str, Any]:
    given: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    if given.get("edges") == 0:
        given["edges"] = None
    return given


def _point(text: str) -> list[float]:
    try:
        return list(map(float, numbers_of("--at", text, ("x", "y", "z"))))
    except InvalidInputError as error:
        message = printable(str(error).removeprefix("--at: "))
        raise typer.BadParameter(message, param_hint="--at") from None
