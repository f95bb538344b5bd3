"""The command line: ``graspforce`` and ``python -m graspforce``.

The commands are modules of `graspforce.cli`. Without the ``cli`` extra only ``reproduce`` works; the other
commands say what to install.
"""

from __future__ import annotations

import argparse
import importlib.util
import io
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from graspforce import __version__
from graspforce._internal.printable import printable
from graspforce.errors import GraspForceError
from graspforce.paper.reproduce import EXAMPLES, reproduce

from .exit_codes import FAILED, MISUSED

if TYPE_CHECKING:
    from collections.abc import Sequence

_NEEDED = ("typer", "rich", "pydantic", "yaml")
_INSTALL = "pip install 'graspforce[cli]', or in a clone pip install '.[cli]'"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code, one of `graspforce.cli.exit_codes`."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    # A terminal may know less letters than a name has.
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors in ("strict", "surrogateescape"):
        sys.stdout.reconfigure(errors="backslashreplace")
    if all(importlib.util.find_spec(package) for package in _NEEDED):
        from .app import run  # noqa: PLC0415

        return run(given)
    return _bare(given)


def _bare(arguments: list[str]) -> int:
    parser = _parser()
    if arguments and not arguments[0].startswith("-") and arguments[0] != "reproduce":
        print(f"graspforce: {arguments[0]!a} needs more packages: {_INSTALL}", file=sys.stderr)
        return FAILED
    options = parser.parse_args(arguments)
    if options.command is None:
        parser.print_help()
        return MISUSED
    if options.json is not None and options.json.parent != options.out:
        try:
            _in_a_folder(str(options.json))
        except argparse.ArgumentTypeError as error:
            parser.error(f"argument --json: {error}")
    try:
        reproduce(options.example, json_file=options.json, out=options.out)
    except (GraspForceError, OSError) as error:
        print(printable(f"graspforce: {error}", keep="\n"), file=sys.stderr)
        return FAILED
    return 0


def _in_a_folder(text: str) -> Path:
    path = Path(text)
    if not path.parent.is_dir():
        message = printable(f"{path}: the folder {path.parent} does not exist; make it first")
        raise argparse.ArgumentTypeError(message)
    return path


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="graspforce",
        description="Quality, contact planning and force distribution for multifingered grasps.",
        epilog=f"More commands with: {_INSTALL}",
    )
    parser.add_argument("--version", action="version", version=f"graspforce {__version__}")
    commands = parser.add_subparsers(dest="command", title="commands")
    description = "Compute an example of the paper and print it beside the published numbers."
    command = commands.add_parser("reproduce", help=description, description=description)
    command.add_argument("example", choices=list(EXAMPLES))
    command.add_argument("--json", type=Path, metavar="FILE", help="write the numbers into FILE")
    command.add_argument(
        "--out", type=_in_a_folder, metavar="DIR", help="write the numbers and pictures into DIR"
    )
    return parser
