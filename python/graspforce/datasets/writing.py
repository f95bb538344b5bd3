"""Files that appear complete or not at all, in a folder that one run owns at a time."""

from __future__ import annotations

import contextlib
import os
import sys
import uuid
from typing import IO, TYPE_CHECKING

import filelock

from graspforce.errors import BusyError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

__all__ = ["LOCK", "appearing", "clear_leftovers", "owned"]

LOCK = ".lock"


@contextlib.contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Keep other runs out of the folder while the block runs; a killed process lets go of it."""
    if folder.exists() and not folder.is_dir():
        raise InvalidInputError(f"out: {folder} is a file, expected a folder")
    folder.mkdir(parents=True, exist_ok=True)
    lock = filelock.FileLock(folder / LOCK, timeout=0)
    try:
        lock.acquire()
    except filelock.Timeout:
        raise BusyError(f"{folder}: another run is writing into this folder") from None
    try:
        yield
    finally:
        lock.release()


@contextlib.contextmanager
def appearing(path: Path) -> Iterator[IO[bytes]]:
    """Write a file under another name; it gets its own when the block ends well, and is gone otherwise.

    Two writers of one file do not disturb each other: the last to end stays.
    """
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        with temporary.open("xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    _sync(path.parent)


def clear_leftovers(folder: Path, names: tuple[str, ...]) -> None:
    """Delete what killed writers of files of these names or patterns have left; the folder must be owned."""
    for name in names:
        for path in folder.glob(f".{name}.*.tmp"):
            path.unlink(missing_ok=True)


def _sync(folder: Path) -> None:
    """See to it that names outlast a power cut, where the system can."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        # Some network file systems do not know this call of folders.
        with contextlib.suppress(OSError):
            os.fsync(handle)
    finally:
        os.close(handle)
