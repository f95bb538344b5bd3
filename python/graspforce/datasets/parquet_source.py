"""The Parquet files of a dataset: found, looked at, and told apart from other ones."""

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
"""In s: two writes within one tick of a file system's clock leave the same time of change."""


@dataclass(frozen=True, slots=True)
class FileState:
    """What tells a file from the same file after a change.

    Attributes
    ----------
    bytes : int
        How large it is.
    modified, status_changed : int
        When its content and its status were last changed, in ns. Programs can set the first, not the second.
    footer : str
        Digest of the footer, which holds the least and largest value of every column in every row group.
    """

    bytes: int
    modified: int
    status_changed: int
    footer: str


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A Parquet file as its footer tells.

    Attributes
    ----------
    path : pathlib.Path
        Where it is.
    rows : int
        How many it holds.
    state : FileState
        Between least and largest values a footer tells nothing apart; times of change do.
    schema : pyarrow.Schema
        Its columns.
    """

    path: Path
    rows: int
    state: FileState
    schema: pa.Schema

    def identity(self, root: Path) -> dict[str, Any]:
        """Return what must be the same when a run goes on."""
        name = self.path.relative_to(root).as_posix()
        size = {"rows": self.rows, "bytes": self.state.bytes}
        return {"name": name, **size, "modified": self.state.modified, "footer": self.state.footer}


def find_files(source: str | os.PathLike[str], out: Path) -> tuple[Path, list[Path]]:
    """Return the folder that holds all files of a source, and the files, in the order of their names.

    What a pattern finds in the folder of results are the parts of a run before, not sources. Several links to
    one file are one file.
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
        raise InvalidInputError(f"out: {out} holds all files of the source; its parts would become sources")
    if not files:
        raise InvalidFileError(given, "no such file, and no folder or pattern with Parquet files")
    root = Path(os.path.commonpath([path.parent for path in files]))
    for path in files:
        for folder in path.relative_to(root).parts[:-1]:
            if "=" in folder:
                raise InvalidFileError(
                    path, f"the value of a column is the name of its folder, {folder}: grade folder by folder"
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
            raise InvalidFileError(file.path, f"columns are not those of {first.path}: {difference}")
    return files


def _look_at_one(path: Path) -> SourceFile:
    try:
        # A change within the same tick could not be told later.
        age = time.time() - path.stat().st_mtime
        if 0 <= age < _CLOCK_TICK:
            time.sleep(_CLOCK_TICK - age)
        # Before it is read: what is written meanwhile makes another file of it.
        state = state_of(path)
        with pq.ParquetFile(path) as file:
            metadata, schema = file.metadata, file.schema_arrow
        _check_counts(path, metadata)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise InvalidFileError(path, str(error)) from error
    return SourceFile(path, metadata.num_rows, state, schema)


def state_of(path: Path) -> FileState:
    """Look at a file's times and footer; raises OSError."""
    with path.open("rb") as stream:
        found = os.fstat(stream.fileno())
        stream.seek(max(0, found.st_size - _FOOTER_END))
        length = int.from_bytes(stream.read(4), "little")
        stream.seek(max(0, found.st_size - _FOOTER_END - length))
        footer = hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
    return FileState(found.st_size, found.st_mtime_ns, found.st_ctime_ns, footer)


def changed(path: Path) -> InvalidFileError:
    """Return the error of a source that does not stay as it is."""
    return InvalidFileError(
        path,
        "it has changed while it was graded, and the unfinished part is dropped. When nothing writes to "
        "it any more, grade it into another folder, or start over with overwrite=True (--overwrite)",
    )


def _check_counts(path: Path, metadata: pq.FileMetaData) -> None:
    """Refuse a footer whose numbers of rows contradict each other: some would be missing, or never come."""
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
                    f"{group.column(k).path_in_schema}; write the file anew",
                )
    if total != metadata.num_rows:
        raise InvalidFileError(
            path, f"claims {metadata.num_rows} rows, but its row groups hold {total}; write the file anew"
        )


def _described(schema: pa.Schema) -> list[str]:
    return [f"{field.name}: {field.type}{'' if field.nullable else ' not null'}" for field in schema]


def _is_hidden(path: Path) -> bool:
    return any(part.startswith((".", "_")) for part in path.parts)
