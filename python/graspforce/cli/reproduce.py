"""``graspforce reproduce``."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from graspforce.paper import reproduce as reproduction

from .output import has_folder, in_a_folder
from .progress import progress

_Example = StrEnum("_Example", list(reproduction.EXAMPLES))  # type: ignore[misc] # choices for the help


def reproduce(
    example: Annotated[
        _Example,
        typer.Argument(
            metavar="EXAMPLE", help="racket: Example 1, in the plane; tile: Example 2, planning in space."
        ),
    ],
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write the numbers into FILE, which may lie in --out."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the numbers and pictures into DIR.", callback=in_a_folder)
    ] = None,
) -> None:
    """Compute an example of the paper and print it beside the published numbers.

    Example: `graspforce reproduce racket --out out`
    """
    if json_file is not None and json_file.parent != out:
        has_folder(json_file)
    with progress("computing"):
        reproduction.reproduce(str(example), json_file=json_file, out=out)
