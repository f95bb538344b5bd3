"""Files that a pattern names, each once, whatever links lead to it."""

from __future__ import annotations

import fnmatch
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

__all__ = ["once", "paths_matching"]

_MAGIC = re.compile(r"[*?\[]")


def paths_matching(pattern: str) -> list[Path]:
    """Return the paths that a pattern names: ``*``, ``?``, ``[...]``, and ``**`` for any folders.

    As `glob.glob` but for links: below ``**`` a folder is entered once, so links in loops end.
    """
    given = Path(pattern)
    parts = given.parts[1:] if given.anchor else given.parts
    found = [Path(given.anchor)]
    for at, part in enumerate(parts):
        last = at == len(parts) - 1
        if part == "**":
            found = [
                path
                for folder in _folders(found)
                for path in ([folder, *_files(folder)] if last else [folder])
            ]
        elif _MAGIC.search(part):
            found = [folder / name for folder in found for name in _names(folder, part)]
        else:
            found = [path for path in (folder / part for folder in found) if os.path.lexists(path)]
    return found


def once(paths: Iterable[Path]) -> list[Path]:
    """Leave out paths that lead to a file of a path before; files themselves come before links to them."""
    seen: set[tuple[int, int]] = set()
    kept = []
    for path in sorted(paths, key=lambda path: (path.is_symlink(), path)):
        found = path.stat()
        # Where the system has no numbers of files, each path counts.
        if found.st_ino and (found.st_dev, found.st_ino) in seen:
            continue
        seen.add((found.st_dev, found.st_ino))
        kept.append(path)
    return sorted(kept)


def _folders(roots: list[Path]) -> Iterator[Path]:
    """Yield folders and those below them, nearest first, each once and without hidden ones."""
    waiting, seen = list(roots), set()
    while waiting:
        deeper: list[Path] = []
        for folder in waiting:
            try:
                found = folder.stat()
            except OSError:
                continue
            identity = (found.st_dev, found.st_ino) if found.st_ino else os.path.realpath(folder)
            if identity in seen:
                continue
            seen.add(identity)
            yield folder
            deeper += [folder / entry.name for entry in _entries(folder) if _is_folder(entry)]
        # Of a folder and a link to it, the folder gives the name.
        waiting = sorted(deeper, key=lambda path: (path.is_symlink(), path))


def _files(folder: Path) -> Iterator[Path]:
    return (folder / entry.name for entry in _entries(folder) if not _is_folder(entry))


def _names(folder: Path, part: str) -> list[str]:
    names = [entry.name for entry in _entries(folder, hidden=part.startswith("."))]
    return fnmatch.filter(names, part)


def _entries(folder: Path, *, hidden: bool = False) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return [entry for entry in entries if hidden or not entry.name.startswith(".")]
    except OSError:
        # As the shell does: what is no folder, or may not be read, holds nothing.
        return []


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        # A link to itself, or to one that leads back.
        return False
