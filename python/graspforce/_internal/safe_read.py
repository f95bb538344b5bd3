"""What a file that is not trusted may not do: block, grow without bound, or point elsewhere."""

from __future__ import annotations

import os
import re
import stat
from typing import TYPE_CHECKING

from graspforce.errors import InvalidFileError

if TYPE_CHECKING:
    from pathlib import Path


def limited_bytes(path: Path, limit: int) -> bytes:
    """Read a regular file that may not be larger than `limit` bytes."""
    try:
        # A pipe would be waited for, and a device never ends.
        with open(path, "rb", opener=_not_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InvalidFileError(path, "not a regular file")
            content = file.read(limit + 1)
    except OSError as error:
        raise InvalidFileError(path, error.strerror or str(error)) from None
    except ValueError as error:
        if isinstance(error, InvalidFileError):
            raise
        raise InvalidFileError(path, str(error)) from None
    if len(content) > limit:
        raise InvalidFileError(path, f"larger than {limit} bytes")
    return content


def beside(path: Path, name: str) -> Path:
    """Return the file `name` in the folder of `path`, or below it; a ValueError says that it is elsewhere."""
    if "\0" in name or re.match(r"[A-Za-z][\w+.-]*:", name):
        raise ValueError(f"{name!r} is not the name of a file beside this one")
    folder = path.parent.resolve()
    # Links are followed: one that leads elsewhere is no better than a path that does.
    if not (folder / name).resolve().is_relative_to(folder):
        raise ValueError(f"{name!r} lies outside the folder of this file")
    return path.parent / name


def _not_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
