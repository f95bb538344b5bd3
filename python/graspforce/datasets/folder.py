"""The folder of results: of which question and which source its parts are."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from typing import TYPE_CHECKING, Any

from graspforce._core import __version__
from graspforce.errors import ResumeError

from .writing import LOCK, appearing, clear_leftovers

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from .options import GradeOptions
    from .source import SourceFile

__all__ = ["graded_parts", "identity", "prepare"]

_MANIFEST = "_grade.json"
"""Readers of Parquet folders pass over names that begin with an underscore or a dot."""

_PARTS = "part-*.parquet"
_PART_NAME = re.compile(r"part-\d{6,}\.parquet")
_FORMAT = 1
_MAX_TOLD = 5


def prepare(
    out: Path,
    root: Path,
    files: list[SourceFile],
    options: GradeOptions,
    rows_per_part: int,
    *,
    overwrite: bool,
) -> None:
    """Make the folder ready for a run of this question on this source, or refuse it."""
    asked = {
        "format": _FORMAT,
        "graspforce": __version__,
        "options": {**dataclasses.asdict(options), "criteria": list(options.criteria)},
        "rows_per_part": rows_per_part,
        "files": [file.identity(root) for file in files],
    }
    manifest = out / _MANIFEST
    # Only by our names: whether the folder is ours is not yet known.
    clear_leftovers(out, (_PARTS, _MANIFEST))
    if overwrite and manifest.exists():
        # The manifest last: a kill in between leaves a folder that still says whose parts it holds.
        for path in (*graded_parts(out), manifest):
            path.unlink(missing_ok=True)
    if manifest.exists():
        _compare(out, _read(manifest), asked)
        return
    others = sorted(path.name for path in out.iterdir() if path.name != LOCK)
    if others:
        raise ResumeError(f"{out}: holds {others[0]}, which is not of a graded dataset; name another folder")
    with appearing(manifest) as stream:
        stream.write(json.dumps(asked, indent=1).encode())


def identity(out: Path) -> str | None:
    """Return what tells the run that a folder is of from others; None where it is of none."""
    try:
        return hashlib.blake2b((out / _MANIFEST).read_bytes(), digest_size=16).hexdigest()
    except FileNotFoundError:
        return None


def graded_parts(out: Path) -> list[Path]:
    """Find the files of parts that are done."""
    return [path for path in out.glob(_PARTS) if _PART_NAME.fullmatch(path.name)]


def _read(manifest: Path) -> dict[str, Any]:
    try:
        found = json.loads(manifest.read_text("utf-8"))
    except ValueError as error:
        raise ResumeError(f"{manifest}: {error}") from error
    if not isinstance(found, dict):
        raise ResumeError(f"{manifest}: not what a run writes")
    return found


def _compare(out: Path, found: dict[str, Any], asked: dict[str, Any]) -> None:
    differences = [*_differences(found, asked)]
    if differences:
        told = "; ".join(differences[:_MAX_TOLD])
        left = len(differences) - _MAX_TOLD
        more = f"; and {left} more" if left > 0 else ""
        raise ResumeError(
            f"{out}: holds the results of another run: {told}{more}. Name another folder, or delete "
            "them and start over with overwrite=True (--overwrite)"
        )


def _differences(found: dict[str, Any], asked: dict[str, Any]) -> Iterator[str]:
    for name in ("format", "graspforce", "rows_per_part"):
        if found.get(name) != asked[name]:
            yield f"{name} was {found.get(name)}, is {asked[name]}"
    options = found.get("options", {})
    for name, value in asked["options"].items():
        if options.get(name) != value:
            yield f"{name} was {options.get(name)}, is {value}"
    before = {file["name"]: file for file in found.get("files", ())}
    now = {file["name"]: file for file in asked["files"]}
    for name in sorted(before.keys() | now.keys()):
        if name not in now:
            yield f"{name} is gone"
        elif name not in before:
            yield f"{name} is new"
        elif before[name] != now[name]:
            yield f"{name} has changed{_or_anew(before[name], now[name])}"


def _or_anew(before: dict[str, Any], now: dict[str, Any]) -> str:
    alike = {**before, "modified": None} == {**now, "modified": None}
    return ", or was written or copied anew" if alike else ""
