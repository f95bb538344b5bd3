"""Files that match a pattern. A file to which several links lead is found once."""

from __future__ import annotations

import fnmatch
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_MAGIC = re.compile(r"[*?\[]")


def paths_matching(pattern: str) -> list[Path]:
    """Return the paths that match a pattern of ``*``, ``?``, ``[...]``, and ``**`` for any folders.

    It differs from `glob.glob` for links: below ``**`` each folder is entered once, so that loops end.
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
    """Keep one path to each file; a path that is no link is preferred."""
    seen: set[tuple[int, int]] = set()
    kept = []
    for path in sorted(paths, key=lambda path: (path.is_symlink(), path)):
        found = path.stat()
        # On a system without file numbers every path counts as a file of its own.
        if found.st_ino and (found.st_dev, found.st_ino) in seen:
            continue
        seen.add((found.st_dev, found.st_ino))
        kept.append(path)
    return sorted(kept)


def _folders(roots: list[Path]) -> Iterator[Path]:
    """Yield folders and all folders below them, nearest first, each once, without hidden ones."""
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
        # The folder itself comes before links to it.
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
        # As in a shell, a path that is not a readable folder matches nothing.
        return []


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        # Links that lead back to themselves.
        return False
