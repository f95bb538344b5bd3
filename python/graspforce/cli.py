"""The command line: ``graspforce`` and ``python -m graspforce``.

It stands on the standard library alone, so that the bare wheel has it; only figures need the ``plot`` extra.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import __version__
from .errors import GraspForceError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 done, 1 failed, 2 misused."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.command is None:
        parser.print_help()
        return 2
    try:
        reproduce = _reproduce_racket if options.example == "racket" else _reproduce_tile
        reproduce(options.json, options.out)
    except (GraspForceError, OSError) as error:
        print(f"graspforce: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="graspforce", description="Multifingered grasps: quality, planning, forces."
    )
    parser.add_argument("--version", action="version", version=f"graspforce {__version__}")
    commands = parser.add_subparsers(dest="command", title="commands")
    reproduce = commands.add_parser(
        "reproduce",
        help="compute an example of the paper and print it beside the published numbers",
        description="Compute an example of the paper and print it beside the published numbers.",
    )
    reproduce.add_argument(
        "example",
        choices=["racket", "tile"],
        help="racket: Example 1, planning and contact forces; tile: Example 2, the same in space",
    )
    reproduce.add_argument("--json", type=Path, metavar="FILE", help="write the same numbers to FILE")
    reproduce.add_argument("--out", type=Path, metavar="DIR", help="draw PNGs into DIR (needs matplotlib)")
    return parser


def _reproduce_racket(json_file: Path | None, out: Path | None) -> None:
    _require_matplotlib(out)

    from .report import racket_report  # noqa: PLC0415
    from .reproduction import run_racket  # noqa: PLC0415

    run = run_racket()
    print(racket_report(run))
    _write_json(json_file, run.as_dict())
    if out is not None:
        from .plotting import save_plan_figures  # noqa: PLC0415

        for path in save_plan_figures(run, out):
            print(f"wrote {path}")


def _reproduce_tile(json_file: Path | None, out: Path | None) -> None:
    _require_matplotlib(out)

    from .tile import run_tile  # noqa: PLC0415
    from .tile_report import tile_report  # noqa: PLC0415

    run = run_tile()
    print(tile_report(run))
    _write_json(json_file, run.as_dict())
    if out is not None:
        from .tile_drawing import save_tile_figures  # noqa: PLC0415

        for path in save_tile_figures(run, out):
            print(f"wrote {path}")


def _require_matplotlib(out: Path | None) -> None:
    # Before minutes of someone's attention are spent: a missing extra is known from the start.
    if out is not None and importlib.util.find_spec("matplotlib") is None:
        message = (
            "--out draws figures with matplotlib, which is not installed: pip install 'graspforce[plot]'"
        )
        raise GraspForceError(message)


def _write_json(json_file: Path | None, numbers: dict[str, Any]) -> None:
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")
        print(f"\nwrote {json_file}")
