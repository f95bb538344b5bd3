"""The Parquet files of a dataset: found, looked at, and told apart from other ones."""

from __future__ import annotations

import glob
import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from graspforce.errors import InvalidFileError, InvalidInputError

from .schema import check_schema

if TYPE_CHECKING:
    from .options import GradeOptions

__all__ = ["READERS", "SourceFile", "find_files", "look_at"]

_FOOTER_END = 8
"""Bytes after the footer: its length and a magic number."""

READERS = 16
"""Files looked at in parallel: on network file systems it is their latency that counts."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A Parquet file as its footer tells.

    Attributes
    ----------
    path : pathlib.Path
        Where it is.
    rows, bytes : int
        How large it is.
    modified : int
        When it was last written, in ns: between least and largest values, a footer tells nothing apart.
    footer : str
        Digest of the footer, which holds the least and largest value of every column in every row group.
    schema : pyarrow.Schema
        Its columns.
    """

    path: Path
    rows: int
    bytes: int
    modified: int
    footer: str
    schema: pa.Schema

    def identity(self, root: Path) -> dict[str, Any]:
        """Return what must be the same when a run goes on."""
        name = self.path.relative_to(root).as_posix()
        size = {"rows": self.rows, "bytes": self.bytes}
        return {"name": name, **size, "modified": self.modified, "footer": self.footer}


def find_files(source: str | os.PathLike[str], out: Path) -> tuple[Path, list[Path]]:
    """Return the folder that holds all files of a source, and the files, in the order of their names.

    What a pattern finds in the folder of results are the parts of a run before, not sources.
    """
    given = Path(source)
    if given.is_file():
        return given.parent.absolute(), [given.absolute()]
    if given.is_dir():
        found = [path for path in given.rglob("*.parquet") if not _is_hidden(path.relative_to(given))]
    else:
        found = [Path(name) for name in glob.glob(os.fspath(source), recursive=True)]  # noqa: PTH207 - may be absolute
    results = out.resolve()
    ours = {folder for folder in {path.parent for path in found} if folder.resolve().is_relative_to(results)}
    files = sorted(path.absolute() for path in found if path.parent not in ours and path.is_file())
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
        # Before it is read: what is written meanwhile makes another file of it.
        found = path.stat()
        with pq.ParquetFile(path) as file:
            metadata, schema = file.metadata, file.schema_arrow
        with path.open("rb") as stream:
            stream.seek(found.st_size - metadata.serialized_size - _FOOTER_END)
            footer = hashlib.blake2b(stream.read(), digest_size=16).hexdigest()
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, str(error)) from error
    return SourceFile(path, metadata.num_rows, found.st_size, found.st_mtime_ns, footer, schema)


def _described(schema: pa.Schema) -> list[str]:
    return [f"{field.name}: {field.type}{'' if field.nullable else ' not null'}" for field in schema]


def _is_hidden(path: Path) -> bool:
    return any(part.startswith((".", "_")) for part in path.parts)
