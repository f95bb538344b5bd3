"""The files of parts: their names, and the run that wrote each of them."""

from __future__ import annotations

import json
import re
import stat
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

ORIGIN = b"graspforce"
"""Key of a part's metadata that names its run and its rows."""

READERS = 16
"""Number of files read in parallel: network file systems have a long latency for each file."""

_PARTS = "part-*.parquet"
_PART_NAME = re.compile(r"part-\d{6,}\.parquet")


def part_name(index: int) -> str:
    """Return the name of the file of a part."""
    return f"part-{index:06d}.parquet"


def is_part_name(name: str) -> bool:
    """Whether a part may have this name."""
    return _PART_NAME.fullmatch(name) is not None


def is_regular(path: Path) -> bool:
    """Whether the path is a regular file: a run writes neither links nor pipes."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:
        return False


def graded_parts(out: Path) -> list[Path]:
    """Find the files that have the names of parts."""
    return [path for path in out.glob(_PARTS) if is_part_name(path.name) and is_regular(path)]


def origin_of(schema: pa.Schema) -> dict[str, Any]:
    """Return the run and the rows that a part's metadata names; empty if it names none."""
    try:
        found = json.loads((schema.metadata or {}).get(ORIGIN, b"{}"))
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def own_parts(out: Path, runs: Collection[str], *, any_run: bool) -> set[str]:
    """Return the names of the parts that one of these runs wrote, by their metadata.

    `any_run` is True if a manifest cannot be read. Then the parts of one other run are included.
    """
    paths = graded_parts(out)
    with ThreadPoolExecutor(READERS) as pool:
        found = dict(zip((path.name for path in paths), pool.map(_run_of, paths), strict=True))
    others = {run for run in found.values() if run is not None and run not in runs}
    accepted = {*runs, *(others if any_run and len(others) == 1 else ())}
    return {name for name, run in found.items() if run in accepted}


def _run_of(path: Path) -> str | None:
    try:
        origin = origin_of(pq.read_schema(path))
    except (pa.ArrowException, OSError, ValueError):  # also names that are no text
        return None
    run, index = origin.get("run"), origin.get("part")
    # A copy under another number is the user's.
    own = isinstance(run, str) and type(index) is int and part_name(index) == path.name
    return run if own else None
