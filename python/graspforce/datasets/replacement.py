"""Replacement of the results of an earlier run by those of a new one.

The new run writes into a hidden folder beside the old parts. When it is finished:

1. The hidden folder is renamed. From here on the new run is the valid one.
2. Its parts replace the old ones, one by one.
3. Old parts without a successor are deleted.
4. Its manifest replaces the old one, and the hidden folder is removed.

If a run is killed before step 1, the old results stay. If it is killed later, `complete` does the remaining
steps.
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
"""Names of the hidden folders that a run may make in a folder of results."""


def in_work(out: Path) -> Path:
    """Folder of a run that will replace another one and is not finished."""
    return out / _IN_WORK


def finished(out: Path) -> Path:
    """Folder of a finished run whose parts have not all replaced the old ones."""
    return out / _FINISHED


def is_folder(path: Path) -> bool:
    """Whether this hidden folder of a run exists; anything else of its name is refused."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return False
    if not stat.S_ISDIR(mode):
        raise ResumeError(f"{path}: not a folder, so no run made it; delete or rename it")
    return True


def complete(out: Path, manifest: str, parts: list[Path], old: list[Path]) -> None:
    """Do the steps of a replacement that are left.

    `parts` are the parts in the folder of the finished run. `old` are parts of the earlier run without a
    successor.
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
    """Delete the unfinished run that should have replaced another one."""
    folder = in_work(out)
    for path in parts:
        path.unlink()
    clear_leftovers(folder)
    (folder / manifest).unlink(missing_ok=True)
    folder.rmdir()
