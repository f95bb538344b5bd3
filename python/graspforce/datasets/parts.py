"""Parts: bounded stretches of rows of the source's files, each graded into one file of its own.

A part is what a kill can cost, what a machine of a cluster is given, and what memory holds at a time.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

from graspforce._core import __version__
from graspforce.errors import GraspForceError, InvalidFileError

from .folder import identity
from .grading import grade_batch
from .schema import graded_schema
from .writing import appearing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .options import GradeOptions

__all__ = ["Part", "PartReport", "grade_part", "report_of", "shifted", "split"]

_BATCH_BYTES = 20 << 20
"""Of decoded rows in memory at a time, for rows that carry pictures or point clouds."""

_READ_BUFFER_BYTES = 1 << 20
"""Of each column, so that a row group is never in memory whole."""

_LINUX_STATUS = Path("/proc/self/status")


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
    run: str,
    *,
    version: str = __version__,
    progress: Callable[[int], object] | None = None,
) -> PartReport:
    """Grade the rows of a part into its file, for the run of this identity."""
    if version != __version__:
        raise GraspForceError(f"graspforce {__version__} here, {version} where the run was started")
    report = PartReport()
    with _opened(part.source) as file, appearing(out / part.name) as stream:
        schema = graded_schema(file.schema_arrow, options)
        at_once = _rows_at_once(file, part)
        with pq.ParquetWriter(stream, schema) as writer:
            done = 0
            for batch in _batches(file, part, at_once):
                tell = progress and shifted(progress, done)
                columns = batch.columns + grade_batch(batch, options, tell)
                graded = pa.RecordBatch.from_arrays(columns, schema=schema)
                writer.write_batch(graded, row_group_size=at_once)
                report += _counted(pa.Table.from_batches([graded]))
                done += batch.num_rows
        if done != part.rows:
            raise InvalidFileError(
                part.source, f"{done} rows from row {part.start} on, not {part.rows}: it has changed"
            )
        # A machine that lost its client may end when the folder is another run's already.
        if identity(out) != run:
            raise GraspForceError(f"{out}: not, or no longer, the folder of this run")
    return report + PartReport(peak_bytes=_peak_bytes())


def report_of(path: Path) -> PartReport:
    """Count the rows of a part that was graded before."""
    try:
        return _counted(pq.read_table(path, columns=["status", "closure"], partitioning=None))
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, f"{error}; delete it, and its rows are graded again") from error


def shifted(progress: Callable[[int], object], before: int) -> Callable[[int], object]:
    """Return a function to say how many of some later rows are done."""
    return lambda done: progress(before + done)


def _opened(path: Path) -> pq.ParquetFile:
    try:
        # Buffering ahead, as pyarrow does by default, would read whole row groups.
        return pq.ParquetFile(path, buffer_size=_READ_BUFFER_BYTES, pre_buffer=False)
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, str(error)) from error


def _batches(file: pq.ParquetFile, part: Part, at_once: int) -> Iterator[pa.RecordBatch]:
    """Yield the rows of a part, decoding only the row groups that hold them."""
    stop = part.start + part.rows
    at, groups = _groups_of(file, part)
    for batch in _decoded(file, part.source, at_once, groups):
        begin, end = max(part.start - at, 0), min(stop - at, batch.num_rows)
        at += batch.num_rows
        if begin < end:
            yield batch.slice(begin, end - begin)
        if at >= stop:
            return


def _groups_of(file: pq.ParquetFile, part: Part) -> tuple[int, list[int]]:
    """Return the first row of the row groups that hold a part, and their numbers."""
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
    return first, groups


def _decoded(file: pq.ParquetFile, path: Path, at_once: int, groups: list[int]) -> Iterator[pa.RecordBatch]:
    try:
        yield from file.iter_batches(at_once, row_groups=groups)
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, str(error)) from error


def _rows_at_once(file: pq.ParquetFile, part: Part) -> int:
    groups = [file.metadata.row_group(group) for group in range(file.metadata.num_row_groups)]
    heaviest = max((group.total_byte_size / max(group.num_rows, 1) for group in groups), default=1.0)
    # Values of a dictionary, however long, take a few bits of each row in the file, but not in memory.
    first_row = islice(_decoded(file, part.source, 1, _groups_of(file, part)[1][:1]), 1)
    heaviest = max(heaviest, *map(_bytes_of, first_row), 1.0)
    return max(1, min(part.rows, int(_BATCH_BYTES / heaviest)))


def _bytes_of(row: pa.RecordBatch) -> int:
    # Rows of a column that stays a dictionary share its values.
    return sum(
        (column.indices if pa.types.is_dictionary(column.type) else column).get_total_buffer_size()
        for column in row.columns
    )


def _counted(table: pa.Table) -> PartReport:
    def counts(name: str) -> Counter[str]:
        found = table.column(name).drop_null().value_counts().to_pylist()
        return Counter({entry["values"]: entry["counts"] for entry in found})

    return PartReport(counts("status"), counts("closure"))


def _peak_bytes() -> int:
    # What getrusage says on Linux is that of the process before, where a large one started this one.
    if _LINUX_STATUS.exists():
        lines = _LINUX_STATUS.read_text("ascii", "replace").splitlines()
        return next((1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM:")), 0)
    if sys.platform == "win32":
        return 0
    import resource  # noqa: PLC0415 - not on every system

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
