"""Output of the commands: tables, JSON and pictures."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console
from rich.table import Table

from graspforce._internal import html
from graspforce._internal.optional_imports import optional
from graspforce._internal.printable import printable
from graspforce.errors import GraspForceError, InvalidFileError, InvalidInputError
from graspforce.files import save_grasp

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.figure import Figure

    from graspforce._core import Grasp

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")]
Criterion = Annotated[
    Literal["max", "sum"],
    typer.Option(
        help="Quality of the grasp: each normalised normal force is at most 1 (max), or their sum (sum)."
    ),
]
Objective = Annotated[
    Literal["max", "sum", "squares"],
    typer.Option(
        help="Minimise the largest normalised normal force (max), the sum of all of them (sum), or the sum "
        "of squared forces (squares)."
    ),
]

_PIPED_WIDTH = 100


def print_json(value: dict[str, Any]) -> None:
    """Print one JSON object."""
    # Everything else that a terminal might obey is escaped already.
    print(json.dumps(value, indent=2, allow_nan=False).replace("\x7f", "\\u007f"))


def print_table(title: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table with its first column to the left and numbers to the right."""
    table = Table(box=None, pad_edge=False)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right", no_wrap=i > 0)
    for row in rows:
        table.add_row(*map(printable, row))
    # Brackets are vectors here, not markup.
    console = Console(markup=False, highlight=False)
    if not console.is_terminal:
        # A pipe has no width of its own, and should not depend on the terminal beside it.
        console.width = _PIPED_WIDTH
    console.print(printable(title), style="bold")
    console.print(table)


def note(text: str) -> None:
    """Print a message on the error stream."""
    print(printable(text), file=sys.stderr)


def in_a_folder(path: Path | None) -> Path | None:
    """Refuse an output path without a folder before any work is done."""
    if path is not None:
        has_folder(path)
    return path


def for_a_file(path: Path | None, option: typer.CallbackParam) -> Path | None:
    """Refuse an output file without a folder, or a picture of unknown format, before any work is done."""
    if path is not None:
        has_folder(path)
        if path.is_dir():
            raise typer.BadParameter(printable(f"{path} is a folder; name a file in it"))
        if option.name == "plot":
            known = optional("matplotlib.figure", "plot").Figure().canvas.get_supported_filetypes()
            if path.suffix.lower().removeprefix(".") not in known:
                message = f"{path}: no picture of a known format; known are {', '.join(known)}"
                raise typer.BadParameter(printable(message))
    return path


Plot = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Draw the result into FILE (png, pdf, svg).", callback=for_a_file),
]


def has_folder(path: Path) -> None:
    """Refuse an output path whose folder does not exist."""
    if not path.parent.is_dir():
        raise typer.BadParameter(printable(f"{path}: the folder {path.parent} does not exist; make it first"))


def save_best(path: Path, grasp: Grasp, **options: Any) -> None:
    """Write the grasp file that ``--out`` names."""
    try:
        save_grasp(path, grasp, **options)
    except InvalidFileError as error:
        raise GraspForceError(f"--out: {error}") from error
    note(f"wrote {path}")


def save(figure: Figure, path: Path) -> None:
    """Write a picture in the format of its suffix."""
    from matplotlib.text import Text  # noqa: PLC0415 - matplotlib only where it is asked for

    for text in figure.findobj(Text):
        text.set_text(printable(text.get_text(), keep="\n"))
    try:
        figure.savefig(path)
    except ValueError as error:
        raise InvalidInputError(f"--plot: {error}") from None
    note(f"wrote {path}")


def rounded(value: float) -> str:
    """Four digits after the point, and no zero with a sign."""
    return f"{0.0 if abs(value) < 5e-5 else value:.4f}"


def vector(values: Iterable[float], scale: float | None = None) -> str:
    """Write numbers as a list of four digits each."""
    return html.vector(values, scale, digits=4)
