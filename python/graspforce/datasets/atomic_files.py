"""Atomic writing of files, and a lock on the folder of results."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import sys
import uuid
from typing import IO, TYPE_CHECKING

import filelock

from graspforce.errors import BusyError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

LOCK = ".lock"

_LEFTOVER = re.compile(r"\.(part-\d{6,}\.parquet|_grade\.json)\.[0-9a-f]{4,32}\.tmp")
"""Temporary names that `appearing` gives to files."""

_READ_ONLY = (errno.EACCES, errno.EPERM, errno.EROFS)


@contextlib.contextmanager
def owned(folder: Path) -> Iterator[bool]:
    """Lock the folder while the block runs. The lock of a killed process ends with it.

    Yields whether the folder can be written to. A folder that cannot is not locked, because no run can change
    it.
    """
    if folder.exists() and not folder.is_dir():
        raise InvalidInputError(f"out: {folder} is a file, expected a folder")
    folder.mkdir(parents=True, exist_ok=True)
    lock = filelock.FileLock(folder / LOCK, timeout=0)
    try:
        lock.acquire()
    except filelock.Timeout:
        raise BusyError(f"{folder}: another run is writing into this folder") from None
    except OSError as error:
        if error.errno not in _READ_ONLY:
            raise
        yield False
        return
    try:
        yield True
    finally:
        lock.release()


@contextlib.contextmanager
def appearing(path: Path) -> Iterator[IO[bytes]]:
    """Write a file under a temporary name; rename it if the block succeeds, and delete it otherwise.

    If two processes write one file, the last to finish replaces the other's.
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
    sync(path.parent)


def is_leftover(name: str) -> bool:
    """Return True for the temporary file of a part or manifest whose writer was killed."""
    return _LEFTOVER.fullmatch(name) is not None


def clear_leftovers(folder: Path) -> None:
    """Delete temporary files of killed writers. The folder must be locked."""
    for path in folder.glob(".*.tmp"):
        if is_leftover(path.name):
            path.unlink(missing_ok=True)


def sync(folder: Path) -> None:
    """Write the names of a folder to disk, so that they survive a power failure, where the system can."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        # Some network file systems cannot synchronise folders.
        with contextlib.suppress(OSError):
            os.fsync(handle)
    finally:
        os.close(handle)
