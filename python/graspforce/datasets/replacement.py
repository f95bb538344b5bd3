"""A finished run takes the place of an earlier one in its folder.

The new run is written into a hidden folder beside the old parts, which stay as they are. When it is finished:

1. the hidden folder is renamed; from here on the new run counts,
2. its parts replace the old ones, one by one,
3. old parts without a successor are deleted,
4. its manifest replaces the old one, and the hidden folder is removed.

A run that is killed before the first step leaves the old results; later, `complete` does what is left.
"""

from __future__ import annotations

import stat
from typing import TYPE_CHECKING

from graspforce.errors import ResumeError

from .atomic_files import clear_leftovers, sync

if TYPE_CHECKING:
    from pathlib import Path

_IN_WORK = ".graspforce-new"
_FINISHED = ".graspforce-finished"
HIDDEN = (_IN_WORK, _FINISHED)
"""Names in a folder of results that are a run's own, beside its parts and manifest."""


def in_work(out: Path) -> Path:
    """Where a run that is to replace another one writes."""
    return out / _IN_WORK


def finished(out: Path) -> Path:
    """Where a run waits that is finished and counts from now on."""
    return out / _FINISHED


def is_folder(path: Path) -> bool:
    """Whether a run's own folder is there; anything else of its name is refused."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return False
    if not stat.S_ISDIR(mode):
        raise ResumeError(f"{path}: not a folder that a run has made; delete or rename it")
    return True


def complete(out: Path, manifest: str, parts: list[Path], old: list[Path]) -> None:
    """Put the finished run in the place of the old one, from whichever step on.

    `parts` are those of the finished folder, `old` the earlier run's that have no successor.
    """
    source = finished(out)
    for path in parts:
        path.replace(out / path.name)
    for path in old:
        path.unlink()
    sync(out)
    if (source / manifest).exists():
        (source / manifest).replace(out / manifest)
    sync(out)
    clear_leftovers(source)
    source.rmdir()


def discard(out: Path, manifest: str, parts: list[Path]) -> None:
    """Delete a run that was to replace another one and was never finished."""
    folder = in_work(out)
    for path in parts:
        path.unlink()
    clear_leftovers(folder)
    (folder / manifest).unlink(missing_ok=True)
    folder.rmdir()
