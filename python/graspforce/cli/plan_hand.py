"""``graspforce plan-hand``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer

from graspforce.errors import InvalidFileError, InvalidInputError
from graspforce.files import load_mesh
from graspforce.hands import Hand, plan_hand, preset, presets
from graspforce.surfaces.mesh_checks import metres

from .grasp_options import wrench_of
from .output import AsJson, Criterion, for_a_file, note, print_json, print_table, save, vector
from .progress import progress

if TYPE_CHECKING:
    from graspforce.hands import HandPlanSet


MeshUnit = Annotated[
    Literal["m", "dm", "cm", "mm", "in", "ft"], typer.Option("--unit", help="Unit of the mesh's vertices.")
]


def plan_hand_command(
    hand: Annotated[
        str,
        typer.Argument(
            metavar="HAND", help="Hand file (YAML, JSON), or shadow, allegro-right, allegro-left."
        ),
    ],
    mesh: Annotated[Path, typer.Argument(metavar="OBJECT", help="Mesh of the object (GLB, OBJ, STL, ...).")],
    criterion: Criterion = "max",
    unit: MeshUnit = "m",
    fingers: Annotated[
        str | None, typer.Option(help="Numbers of the fingertips that touch: 0,1,2.  \\[default: all]")
    ] = None,
    friction: Annotated[float, typer.Option(help="Coulomb coefficient.")] = 0.6,
    torsion: Annotated[float, typer.Option(help="Torsional coefficient in m.")] = 0.02,
    preload: Annotated[float, typer.Option(help="Least normal force in N of each finger at rest.")] = 2.0,
    external_wrench: Annotated[
        str | None, typer.Option(help="Constant load, such as the weight, in N and N m: fx,fy,fz,tx,ty,tz.")
    ] = None,
    rank: Annotated[
        Literal["slip onset", "quality"], typer.Option(help="What decides among plans.")
    ] = "slip onset",
    seeds: Annotated[
        Literal["palms", "contacts", "both"], typer.Option(help="Where the search begins.")
    ] = "palms",
    starts: Annotated[int, typer.Option(help="Poses that are put onto the surface.")] = 60,
    simulate: Annotated[bool, typer.Option(help="Try the best plans in simulation.")] = True,
    best: Annotated[int, typer.Option(help="Number of plans to keep.")] = 5,
    time_limit: Annotated[float | None, typer.Option(help="Seconds after which the search ends.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the search.")] = 0,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the best plan into FILE (json).", callback=for_a_file),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draw the best plan into FILE (png, pdf, svg).", callback=for_a_file
        ),
    ] = None,
) -> None:
    """Plan how a hand grasps an object: palm pose, joints, contacts and how hard to squeeze.

    Example: `graspforce plan-hand allegro-right mug.obj --unit mm --out plan.json --plot plan.png`
    """
    load = None if external_wrench is None else wrench_of("--external-wrench", external_wrench, 6)
    made = hand_named(hand)
    vertices, faces = object_mesh(mesh, unit)
    try:
        with progress("planning"):
            found = plan_hand(
                made, (vertices, faces), _numbers(fingers), criterion, friction=friction, torsion=torsion,
                preload=preload, external_wrench=load, rank=rank, seeds=seeds,
                starts=starts, simulate=simulate, best=best, time_limit=time_limit, seed=seed,
            )  # fmt: skip
    except InvalidInputError as error:
        raise InvalidInputError(str(error).replace("scale it to m", "give its unit by --unit")) from None
    if as_json:
        print_json({"mesh": str(mesh), **found.to_dict()})
    else:
        _print(mesh.name, found)
    if out is not None:
        found.best.save(out, mesh=mesh, unit=unit)
        note(f"wrote {out}")
    if plot is not None:
        from graspforce.plotting import hand_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        save(hand_figure(found.best, (vertices, faces), title=mesh.name), plot)


def hand_named(name: str) -> Hand:
    """Return the preset of a name, or the hand of a file."""
    if name in presets():
        return preset(name)
    if not Path(name).exists():
        raise InvalidFileError(
            Path(name), f"no such hand file, and no preset; presets are {', '.join(presets())}"
        )
    return Hand.load(name)


def object_mesh(path: Path, unit: str) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Vertices in m and faces of a mesh file."""
    vertices, faces = load_mesh(path)
    return vertices * metres(unit), faces


def _numbers(text: str | None) -> list[int] | None:
    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise typer.BadParameter(
            f"{text!r}, expected numbers such as 0,1,2", param_hint="--fingers"
        ) from None


def _print(name: str, found: HandPlanSet) -> None:
    rows = [
        (
            str(k), f"{p.onset:.3g}", f"{p.quality.epsilon:.4g}", f"{p.contact_error * 1e3:.2f}",
            f"{p.penetration * 1e3:.2f}", f"{np.degrees(p.pad_angle):.0f}",
            f"{np.abs(p.torques()).max():.2f}",
        )
        for k, p in enumerate(found)
    ]  # fmt: skip
    epsilon = f"epsilon_{found.best.quality.criterion} (N)"
    heads = ("plan", "slip onset (N)", epsilon, "off by (mm)", "overlap (mm)", "pads (deg)", "torque (N m)")
    hand = found.best.hand
    print_table(
        f"{name}: {hand.name}, {found.counts['usable']} of {found.counts['tried']} poses usable", heads, rows
    )
    best = found.best
    tips = [
        (hand.fingertips[f].name, vector(position), f"{force:.3g}")
        for f, position, force in zip(
            best.fingers, best.grasp.positions, best.resting_forces[:, 0], strict=True
        )
    ]
    print_table("best plan", ("fingertip", "position (m)", "presses (N)"), tips)
    print(f"palm at {vector(best.palm[:3, 3])} m; planned in {found.seconds:.2f} s")
    lost = found.counts.get("lost in simulation", 0)
    if lost and not found.counts.get("held in simulation"):
        print(f"none of the {lost} plans that were tried in simulation held every push; see graspforce shake")
    if found.stopped != "done":
        print(f"stopped by {found.stopped}")
