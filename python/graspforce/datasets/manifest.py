"""The manifest of a folder of results: the options and the source of its parts.

The digest of the manifest identifies the run. Each part stores it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from graspforce._core import __version__
from graspforce.errors import InvalidInputError, ResumeError

from .atomic_files import LOCK, appearing, clear_leftovers, is_leftover, sync
from .part_files import graded_parts, is_part_name, is_regular, own_parts, part_name
from .replacement import HIDDEN, complete, discard, finished, in_work, is_folder

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from .options import GradeOptions
    from .parquet_source import SourceFile

_MANIFEST = "_grade.json"
"""Readers of Parquet folders skip names that begin with an underscore or a dot."""

_FORMAT = 2
_MAX_DIFFERENCES = 5
"""Largest number of differences that an error message lists."""


@dataclass(frozen=True, slots=True)
class RunFolder:
    """The folder into which a run writes.

    Attributes
    ----------
    folder : pathlib.Path
        Folder of the parts: the folder of results, or a hidden one in it if the run replaces older results.
    run : str
        Identity of the run: the digest of its manifest.
    replaces : bool
        True if the parts replace those of an earlier run when all are done.
    recovered : bool
        True if a replacement that a killed run had begun was completed first.
    """

    folder: Path
    run: str
    replaces: bool
    recovered: bool


def refuse_other_folder(out: Path) -> None:
    """Refuse a folder that holds files but no results of a run, before anything is written there."""
    if out.is_dir() and not is_folder(finished(out)) and not _exists(out / _MANIFEST):
        _refuse(out, _others(out, set()))


def prepare(
    out: Path,
    root: Path,
    files: list[SourceFile],
    options: GradeOptions,
    rows_per_part: int,
    *,
    overwrite: bool,
    writable: bool,
) -> RunFolder:
    """Prepare the folder for a run with these options on this source.

    A folder that does not fit is refused, and nothing in it changes.
    """
    asked = {
        "format": _FORMAT,
        "graspforce": __version__,
        "options": {**dataclasses.asdict(options), "criteria": list(options.criteria)},
        "rows_per_part": rows_per_part,
        "files": [file.identity(root) for file in files],
    }
    begun = is_folder(finished(out))
    begun_manifest = finished(out) / _MANIFEST
    manifest = begun_manifest if begun and _exists(begun_manifest) else out / _MANIFEST
    waiting = in_work(out) if is_folder(in_work(out)) else None
    goes_on = waiting is not None and _holds(waiting, asked)
    replaces = goes_on or (overwrite and _exists(manifest))
    if not _exists(manifest):
        _refuse(out, _others(out, set()))
    elif not replaces:
        _compare(out, _read(manifest), asked)
    elif not goes_on and not is_regular(manifest):
        raise ResumeError(f"{manifest}: not a regular file, so no run wrote it; name another folder")
    if begun or replaces:
        _refuse_foreign(out, manifest, *([] if waiting is None or not replaces else [waiting]))
    folder = in_work(out) if replaces else out
    if not writable:
        if begun or replaces or not _exists(manifest):
            raise InvalidInputError(f"out: {out} is not writable")
        return RunFolder(out, _digest(manifest.read_bytes()), replaces=False, recovered=False)
    if begun:
        _complete(out)
    clear_leftovers(out)
    if waiting is not None and replaces and not goes_on:
        discard(out, _MANIFEST, graded_parts(waiting))
    if replaces:
        folder.mkdir(exist_ok=True)
        clear_leftovers(folder)
    if not (folder / _MANIFEST).exists():
        with appearing(folder / _MANIFEST) as stream:
            stream.write(json.dumps(asked, indent=1).encode())
    run = identity(folder)
    if run is None:
        raise ResumeError(
            f"{folder / _MANIFEST}: deleted while the run started; another program uses this folder"
        )
    return RunFolder(folder, run, replaces=replaces, recovered=begun)


def publish(out: Path, place: RunFolder) -> None:
    """Replace the parts of an earlier run by the finished parts of this one."""
    if place.replaces:
        others = _others(out, _own_parts(out, {out / _MANIFEST}))
        _refuse(out, set(filter(is_part_name, others)))
        place.folder.replace(finished(out))
        sync(out)
        _complete(out)


def identity(out: Path) -> str | None:
    """Return the identity of the run whose manifest a folder holds; None if it holds no manifest."""
    try:
        return _digest((out / _MANIFEST).read_bytes())
    except FileNotFoundError:
        return None


def _digest(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def _complete(out: Path) -> None:
    source = finished(out)
    manifest = source / _MANIFEST
    found = _read(manifest if manifest.exists() else out / _MANIFEST)
    successors = set(map(part_name, range(_num_parts(found))))
    old = [path for path in graded_parts(out) if path.name not in successors]
    complete(out, _MANIFEST, graded_parts(source), old)


def _num_parts(found: dict[str, Any]) -> int:
    each = found["rows_per_part"]
    return sum(max(1, -(-file["rows"] // each)) for file in found["files"])


def _own_parts(folder: Path, manifests: set[Path]) -> set[str]:
    """Return the names of the parts in a folder that the runs of these manifests wrote."""
    known = [path for path in manifests if is_regular(path)]
    runs = {_digest(path.read_bytes()) for path in known}
    return own_parts(folder, runs, any_run=not all(map(_is_readable, known)))


def _exists(path: Path) -> bool:
    # A link to a file that is gone counts: a run must not overwrite it.
    return path.exists() or path.is_symlink()


def _others(folder: Path, ours: set[str]) -> set[str]:
    """Return the names in a folder that belong to no run."""
    names = {path.name for path in folder.iterdir() if not is_leftover(path.name)}
    return names - ours - {LOCK, _MANIFEST, *HIDDEN}


def _refuse(folder: Path, others: set[str]) -> None:
    if others:
        raise ResumeError(f"{folder}: holds {min(others)}, which no run of grade wrote; name another folder")


def _refuse_foreign(out: Path, manifest: Path, *of_runs: Path) -> None:
    """Refuse files that no run wrote, beside the results and in the hidden folders.

    Hidden files beside the results may stay.
    """
    others = _others(out, _own_parts(out, {manifest, out / _MANIFEST}))
    _refuse(out, {name for name in others if not name.startswith(".")})
    if is_folder(finished(out)):
        _refuse(finished(out), _others(finished(out), _own_parts(finished(out), {manifest})))
    for folder in of_runs:
        _refuse(folder, _others(folder, _own_parts(folder, {folder / _MANIFEST})))


def _is_readable(manifest: Path) -> bool:
    try:
        return bool(_read(manifest))
    except ResumeError:
        return False


def _holds(folder: Path, asked: dict[str, Any]) -> bool:
    try:
        return bool(_read(folder / _MANIFEST) == json.loads(json.dumps(asked)))
    except (OSError, ResumeError):
        return False


def _read(manifest: Path) -> dict[str, Any]:
    try:
        if not is_regular(manifest):
            raise ResumeError(f"{manifest}: not a regular file; name another folder")
        found = json.loads(manifest.read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ResumeError(f"{manifest}: {_with_advice(error)}") from error
    if not _is_manifest(found):
        raise ResumeError(f"{manifest}: {_with_advice('not the manifest of a run')}")
    result: dict[str, Any] = found
    return result


def _with_advice(problem: object) -> str:
    return f"{problem}; name another folder, or start over with overwrite=True (--overwrite)"


def _is_manifest(found: Any) -> bool:
    if not isinstance(found, dict) or not isinstance(found.get("options", {}), dict):
        return False
    files, each = found.get("files"), found.get("rows_per_part")
    if not isinstance(files, list) or type(each) is not int or each < 1:
        return False
    return all(
        isinstance(file, dict)
        and isinstance(file.get("name"), str)
        and type(file.get("rows")) is int
        and file["rows"] >= 0
        for file in files
    )


def _compare(out: Path, found: dict[str, Any], asked: dict[str, Any]) -> None:
    differences = [*_differences(found, asked)]
    if differences:
        listed = "; ".join(differences[:_MAX_DIFFERENCES])
        left = len(differences) - _MAX_DIFFERENCES
        more = f"; and {left} more" if left > 0 else ""
        raise ResumeError(
            f"{out}: holds the results of another run: {listed}{more}. Name another folder, or replace "
            "them with overwrite=True (--overwrite)"
        )


def _differences(found: dict[str, Any], asked: dict[str, Any]) -> Iterator[str]:
    for name in ("format", "graspforce", "rows_per_part"):
        if found.get(name) != asked[name]:
            yield f"{name} was {found.get(name)}, is {asked[name]}"
    options = found.get("options", {})
    for name, value in asked["options"].items():
        if options.get(name) != value:
            yield f"{name} was {options.get(name)}, is {value}"
    before = {file["name"]: file for file in found["files"]}
    now = {file["name"]: file for file in asked["files"]}
    for name in sorted(before.keys() | now.keys()):
        if name not in now:
            yield f"{name} is missing"
        elif name not in before:
            yield f"{name} is new"
        elif before[name] != now[name]:
            alike = {**before[name], "modified": None} == {**now[name], "modified": None}
            yield f"{name} has changed{', or was written or copied again' if alike else ''}"
