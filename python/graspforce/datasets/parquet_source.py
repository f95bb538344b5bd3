"""The Parquet files of a dataset: how they are found, checked, and recognised after a change."""

from __future__ import annotations

import hashlib
import os
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from graspforce.errors import InvalidFileError, InvalidInputError

from .matching import once, paths_matching
from .part_files import READERS
from .schema import GRASP_COLUMNS, check_schema

if TYPE_CHECKING:
    from .options import GradeOptions

_FOOTER_END = 8
"""Bytes after the footer: its length and a magic number."""

_CLOCK_TICK = 0.02
"""In s. Two writes within one tick of a file system's clock give a file the same time of change."""


@dataclass(frozen=True, slots=True)
class FileState:
    """Size, times and footer of a file. They differ after a change of the file.

    Attributes
    ----------
    bytes : int
        Size of the file.
    modified, status_changed : int
        Times in ns at which its content and its status last changed. Programs can set the first, not the
        second.
    footer : str
        Digest of the footer. The footer holds the least and largest value of every column in every row group.
    """

    bytes: int
    modified: int
    status_changed: int
    footer: str


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A Parquet file and what its footer says.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    rows : int
        Number of its rows.
    state : FileState
        Its size, times and footer. The times are needed: other values between the same least and largest ones
        leave the footer unchanged.
    schema : pyarrow.Schema
        Its columns.
    """

    path: Path
    rows: int
    state: FileState
    schema: pa.Schema

    def identity(self, root: Path) -> dict[str, Any]:
        """Return what must be unchanged when a run is continued."""
        name = self.path.relative_to(root).as_posix()
        size = {"rows": self.rows, "bytes": self.state.bytes}
        return {"name": name, **size, "modified": self.state.modified, "footer": self.state.footer}


def find_files(source: str | os.PathLike[str], out: Path) -> tuple[Path, list[Path]]:
    """Return the folder that holds all files of a source, and the files in the order of their names.

    A pattern may match files in the folder of results. These are parts of an earlier run, and are left out.
    Several links to one file count once.
    """
    given = Path(source)
    if given.is_file():
        return given.parent.absolute(), [given.absolute()]
    if given.is_dir():
        found = [path for path in given.rglob("*.parquet") if not _is_hidden(path.relative_to(given))]
    else:
        found = paths_matching(os.fspath(source))
    results = Path(os.path.realpath(out))
    ours = {
        folder
        for folder in {path.parent for path in found}
        if Path(os.path.realpath(folder)).is_relative_to(results)
    }
    files = once(path.absolute() for path in found if path.parent not in ours and path.is_file())
    if ours and not files:
        raise InvalidInputError(
            f"out: {out} holds all files of the source, where its parts would be read as source files; name "
            "another folder"
        )
    if not files:
        raise InvalidFileError(given, "not a file, and not a folder or pattern of Parquet files")
    root = Path(os.path.commonpath([path.parent for path in files]))
    for path in files:
        for folder in path.relative_to(root).parts[:-1]:
            if "=" in folder:
                raise InvalidFileError(
                    path,
                    f"the name of its folder, {folder}, holds the value of a column; grade each folder alone",
                )
    return root, files


def look_at(paths: list[Path], options: GradeOptions) -> list[SourceFile]:
    """Read all footers and check that the files can be graded together."""
    with ThreadPoolExecutor(READERS) as pool:
        files = list(pool.map(_look_at_one, paths))
    first = files[0]
    for file in files:
        try:
            check_schema(file.schema, options)
        except InvalidInputError as error:
            raise InvalidFileError(file.path, str(error)) from None
        if not file.schema.equals(first.schema):
            pairs = zip_longest(_described(file.schema), _described(first.schema), fillvalue="nothing")
            difference = next(f"{own} here, {other} there" for own, other in pairs if own != other)
            raise InvalidFileError(file.path, f"columns differ from those of {first.path}: {difference}")
    return files


def _look_at_one(path: Path) -> SourceFile:
    try:
        # A change within the same tick would leave the same time.
        age = time.time() - path.stat().st_mtime
        if 0 <= age < _CLOCK_TICK:
            time.sleep(_CLOCK_TICK - age)
        # The state is taken first, so that a change during the reading shows.
        state = state_of(path)
        with pq.ParquetFile(path) as file:
            metadata, schema = file.metadata, file.schema_arrow
        _check_counts(path, metadata)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise InvalidFileError(path, str(error)) from error
    return SourceFile(path, metadata.num_rows, state, schema)


def state_of(path: Path) -> FileState:
    """Read a file's times and footer; raises OSError."""
    with path.open("rb") as stream:
        found = os.fstat(stream.fileno())
        stream.seek(max(0, found.st_size - _FOOTER_END))
        length = int.from_bytes(stream.read(4), "little")
        stream.seek(max(0, found.st_size - _FOOTER_END - length))
        footer = hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
    return FileState(found.st_size, found.st_mtime_ns, found.st_ctime_ns, footer)


def changed(path: Path) -> InvalidFileError:
    """Return the error of a source that changed during the run."""
    return InvalidFileError(
        path,
        "changed while it was graded; the unfinished part is dropped. When no program writes to it any "
        "more, grade it into another folder, or start over with overwrite=True (--overwrite)",
    )


def _check_counts(path: Path, metadata: pq.FileMetaData) -> None:
    """Refuse a footer whose numbers of rows contradict each other: rows would be missing."""
    columns = {
        k: metadata.schema.column(k).max_repetition_level > 0
        for k in range(metadata.num_columns)
        if metadata.schema.column(k).path.partition(".")[0] in GRASP_COLUMNS
    }
    total = 0
    for number in range(metadata.num_row_groups):
        group = metadata.row_group(number)
        total += group.num_rows
        for k, in_lists in columns.items():
            values = group.column(k).num_values
            if group.num_rows < 0 or values < group.num_rows or (values > group.num_rows and not in_lists):
                raise InvalidFileError(
                    path,
                    f"row group {number} claims {group.num_rows} rows, but {values} values of "
                    f"{group.column(k).path_in_schema}; write the file again",
                )
    if total != metadata.num_rows:
        raise InvalidFileError(
            path, f"claims {metadata.num_rows} rows, but its row groups hold {total}; write the file again"
        )


def _described(schema: pa.Schema) -> list[str]:
    return [f"{field.name}: {field.type}{'' if field.nullable else ' not null'}" for field in schema]


def _is_hidden(path: Path) -> bool:
    return any(part.startswith((".", "_")) for part in path.parts)
