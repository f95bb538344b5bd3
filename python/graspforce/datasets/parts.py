"""Parts: bounded stretches of rows of the source's files, each graded into one file of its own.

A part is what a kill can cost, what a machine of a cluster is given, and what memory holds at a time.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import uuid
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

from graspforce._core import __version__
from graspforce.errors import GraspForceError, InvalidFileError

from .grading import grade_batch
from .schema import graded_schema

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from .options import GradeOptions

__all__ = [
    "Part",
    "PartReport",
    "grade_part",
    "graded_parts",
    "report_of",
    "shifted",
    "split",
    "sync_folder",
    "temporary_files",
]

_PART_NAME = re.compile(r"part-\d{6,}\.parquet")

_BATCH_BYTES = 64 << 20
"""Of decoded rows in memory at a time, for rows that carry pictures or point clouds."""

_READ_BUFFER_BYTES = 1 << 20
"""Of each column, so that a row group is never in memory whole."""


@dataclass(frozen=True, slots=True)
class Part:
    """Rows of one source file, and the number of the part among all of them."""

    index: int
    source: Path
    start: int
    rows: int

    @property
    def name(self) -> str:
        """Of the file that holds its grades."""
        return f"part-{self.index:06d}.parquet"


@dataclass(frozen=True, slots=True)
class PartReport:
    """What grading a part came to.

    Attributes
    ----------
    statuses, closures : collections.Counter
        How many rows have each.
    peak_bytes : int
        The most memory the process has had so far; 0 where the system does not say.
    """

    statuses: Counter[str] = field(default_factory=Counter)
    closures: Counter[str] = field(default_factory=Counter)
    peak_bytes: int = 0

    def __add__(self, other: PartReport) -> PartReport:
        return PartReport(
            self.statuses + other.statuses,
            self.closures + other.closures,
            max(self.peak_bytes, other.peak_bytes),
        )


def split(files: list[tuple[Path, int]], rows_per_part: int) -> list[Part]:
    """Split files of known numbers of rows; an empty file has one part, for its columns."""
    stretches = (
        (path, start, min(rows_per_part, rows - start))
        for path, rows in files
        for start in range(0, max(rows, 1), rows_per_part)
    )
    return [Part(index, *stretch) for index, stretch in enumerate(stretches)]


def grade_part(
    part: Part,
    out: Path,
    options: GradeOptions,
    *,
    version: str = __version__,
    progress: Callable[[int], object] | None = None,
) -> PartReport:
    """Grade the rows of a part into its file, which appears complete or not at all."""
    if version != __version__:
        raise GraspForceError(f"graspforce {__version__} here, {version} where the run was started")
    report = PartReport()
    with _opened(part.source) as file:
        schema = graded_schema(file.schema_arrow, options)
        # Two tries of one part may overlap, on a cluster; each writes the same rows to a file of its own.
        temporary = out / f".{part.name}.{uuid.uuid4().hex}.tmp"
        try:
            with temporary.open("xb") as stream:
                with pq.ParquetWriter(stream, schema) as writer:
                    done = 0
                    for batch in _batches(file, part):
                        tell = progress and shifted(progress, done)
                        columns = batch.columns + grade_batch(batch, options, tell)
                        graded = pa.RecordBatch.from_arrays(columns, schema=schema)
                        writer.write_batch(graded, row_group_size=max(1, _rows_at_once(file, part)))
                        report += _counted(pa.Table.from_batches([graded]))
                        done += batch.num_rows
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(out / part.name)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
    sync_folder(out)
    return report + PartReport(peak_bytes=_peak_bytes())


def report_of(path: Path) -> PartReport:
    """Count the rows of a part that was graded before."""
    try:
        return _counted(pq.read_table(path, columns=["status", "closure"], partitioning=None))
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, f"{error}; delete it, and its rows are graded again") from error


def graded_parts(out: Path) -> list[Path]:
    """Find the files of parts that are done."""
    return [path for path in out.glob("part-*.parquet") if _PART_NAME.fullmatch(path.name)]


def temporary_files(out: Path) -> Iterator[Path]:
    """Find what killed processes have left behind."""
    return out.glob(".part-*.tmp")


def shifted(progress: Callable[[int], object], before: int) -> Callable[[int], object]:
    """Return a function to say how many of some later rows are done."""
    return lambda done: progress(before + done)


def sync_folder(folder: Path) -> None:
    """See to it that names in a folder outlast a power cut, where the system can."""
    if sys.platform != "win32":
        handle = os.open(folder, os.O_RDONLY)
        try:
            # Some network file systems do not know this call of folders.
            with contextlib.suppress(OSError):
                os.fsync(handle)
        finally:
            os.close(handle)


def _opened(path: Path) -> pq.ParquetFile:
    try:
        return pq.ParquetFile(path, buffer_size=_READ_BUFFER_BYTES)
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, str(error)) from error


def _batches(file: pq.ParquetFile, part: Part) -> Iterator[pa.RecordBatch]:
    """Yield the rows of a part, decoding only the row groups that hold them."""
    stop = part.start + part.rows
    groups: list[int] = []
    first = 0
    before = 0
    for group in range(file.metadata.num_row_groups):
        rows = file.metadata.row_group(group).num_rows
        if before < stop and before + rows > part.start:
            if not groups:
                first = before
            groups.append(group)
        before += rows
    at = first
    for batch in file.iter_batches(max(1, _rows_at_once(file, part)), row_groups=groups):
        begin, end = max(part.start - at, 0), min(stop - at, batch.num_rows)
        at += batch.num_rows
        if begin < end:
            yield batch.slice(begin, end - begin)
        if at >= stop:
            return


def _rows_at_once(file: pq.ParquetFile, part: Part) -> int:
    groups = [file.metadata.row_group(group) for group in range(file.metadata.num_row_groups)]
    heaviest = max((group.total_byte_size / max(group.num_rows, 1) for group in groups), default=1.0)
    return min(part.rows, int(_BATCH_BYTES / max(heaviest, 1.0)))


def _counted(table: pa.Table) -> PartReport:
    def counts(name: str) -> Counter[str]:
        found = table.column(name).drop_null().value_counts().to_pylist()
        return Counter({entry["values"]: entry["counts"] for entry in found})

    return PartReport(counts("status"), counts("closure"))


def _peak_bytes() -> int:
    if sys.platform == "win32":
        return 0
    import resource  # noqa: PLC0415 - not on every system

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
