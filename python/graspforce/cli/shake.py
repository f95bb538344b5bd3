"""``graspforce shake``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from graspforce.errors import InvalidFileError
from graspforce.hands import shake
from graspforce.hands.hand_plan import loaded_plan

from .output import AsJson, print_json, print_table
from .plan_hand import hand_named, object_mesh
from .progress import progress

_DIRECTIONS = ("+x", "-x", "+y", "-y", "+z", "-z")


def shake_command(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="Plan of a hand, as plan-hand --out writes it.")
    ],
    mesh: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The object's mesh in m, in place of the plan's.")
    ] = None,
    hand: Annotated[str | None, typer.Option(help="Hand file or preset, in place of the plan's.")] = None,
    mass: Annotated[float, typer.Option(help="Mass of the object in kg.")] = 0.1,
    acceleration: Annotated[float, typer.Option(help="Push divided by the mass, in m/s^2.")] = 10.0,
    control: Annotated[
        Literal["squeeze", "servo", "torque"],
        typer.Option(
            help="A fixed squeeze, or forces distributed at 500 Hz: on top of servos, or as torques."
        ),
    ] = "squeeze",
    closing: Annotated[
        bool, typer.Option("--closing", help="Start from the pregrasp, with a free object.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Hold an object in simulation and push it along the six axes.

    Example: `graspforce shake plan.json --closing`
    """
    given = None if hand is None else hand_named(hand)
    loaded, named = loaded_plan(plan, given)
    if mesh is None and named is None:
        raise InvalidFileError(plan, "names no mesh of the object; pass --mesh")
    path, unit = (mesh, "m") if mesh is not None else named  # type: ignore[misc] # one of them is there
    with progress("shaking"):
        trial = shake(
            loaded, object_mesh(path, unit), mass, control=control, closing=closing, acceleration=acceleration
        )
    if as_json:
        print_json({"plan": str(plan), **trial.to_dict()})
        return
    rows = [
        (direction, "held" if held else "lost", f"{moved * 1e3:.2f}", f"{np.degrees(turned):.2f}")
        for direction, held, moved, turned in zip(
            _DIRECTIONS, trial.held, trial.displacement, trial.rotation, strict=True
        )
    ]
    title = f"{plan.name}: {mass * acceleration:g} N along each axis, {control}"
    print_table(title, ("push", "object", "moved (mm)", "turned (deg)"), rows)
    print(
        f"after closing the object had moved {trial.settled_displacement * 1e3:.2f} mm and "
        f"{np.degrees(trial.settled_rotation):.2f} degrees; normal forces off by at most "
        f"{trial.normal_error:.2f} N"
    )
    if not np.isfinite(trial.settled_displacement):
        print("the simulation diverged before any push; more damping or armature of the joints may help")
