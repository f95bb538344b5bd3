"""Prints both examples beside the published numbers. Only the pictures need an optional package."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from graspforce._internal.optional_imports import optional

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path


def reproduce(example: str, *, json_file: Path | None = None, out: Path | None = None) -> None:
    """Compute and print one of `EXAMPLES`; write its numbers to a file and its pictures into a folder."""
    # A missing extra is reported before minutes of computing, not after.
    if out is not None:
        optional("matplotlib", "plot")
        out.mkdir(exist_ok=True)
    report, numbers, draw = EXAMPLES[example]()
    print(report)
    written = draw(out) if out is not None else []
    files = dict.fromkeys([json_file, out and out / f"{example}.json"])
    for path in (file for file in files if file is not None):
        path.write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")
        written = [path, *written]
    for path in written:
        print(f"wrote {path}", file=sys.stderr)


def _racket() -> tuple[str, dict[str, Any], Callable[[Path], list[Path]]]:
    from .racket import run_racket  # noqa: PLC0415
    from .racket_report import racket_report  # noqa: PLC0415

    run = run_racket()

    def draw(folder: Path) -> list[Path]:
        from .racket_drawing import save_plan_figures  # noqa: PLC0415

        return save_plan_figures(run, folder)

    return racket_report(run), run.to_dict(), draw


def _tile() -> tuple[str, dict[str, Any], Callable[[Path], list[Path]]]:
    from .tile import run_tile  # noqa: PLC0415
    from .tile_report import tile_report  # noqa: PLC0415

    run = run_tile()

    def draw(folder: Path) -> list[Path]:
        from .tile_drawing import save_tile_figures  # noqa: PLC0415

        return save_tile_figures(run, folder)

    return tile_report(run), run.to_dict(), draw


EXAMPLES: Mapping[str, Callable[[], tuple[str, dict[str, Any], Callable[[Path], list[Path]]]]] = {
    "racket": _racket,
    "tile": _tile,
}
"""By name: a function that returns the report, the same numbers, and what draws them into a folder."""
