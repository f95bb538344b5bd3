"""Parts: ranges of rows of the source's files. Each is graded into a file of its own.

An interruption loses at most the part in work. A machine of a cluster grades one part at a time, and memory
holds the result of one.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections import Counter
from dataclasses import dataclass, field
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from graspforce._core import __version__
from graspforce.errors import GraspForceError, InvalidFileError, InvalidInputError, ResumeError

from .atomic_files import appearing
from .grade_table import grade_batch
from .manifest import identity
from .parquet_source import changed, state_of
from .part_files import ORIGIN, origin_of, part_name
from .schema import graded_schema, is_list

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .options import GradeOptions
    from .parquet_source import FileState, SourceFile

_BATCH_BYTES = 20 << 20
"""Decoded rows in memory at a time: rows may hold pictures or point clouds."""

_READ_BUFFER_BYTES = 1 << 20
"""Buffer of each column, so that memory never holds a whole row group."""

_LINUX_STATUS = Path("/proc/self/status")

_SOURCE_CHANGED = "source_changed"
"""Key in a part's origin: time in ns at which the status of its source last changed."""

_MAX_PARTS = 1_000_000
"""Largest number of files in one folder. More are a mistake, or a footer claims rows that do not exist."""


@dataclass(frozen=True, slots=True)
class Part:
    """Rows of one source file, and the number of the part among all parts.

    `state` is the state of the file when the run began; None if it is unknown.
    """

    index: int
    source: Path
    start: int
    rows: int
    state: FileState | None = None

    @property
    def name(self) -> str:
        """Name of the file that holds its grades."""
        return part_name(self.index)

    def origin(self, run: str) -> dict[str, str | int]:
        """Return what the metadata of the part's file names: the run, the number and the rows."""
        return {"run": run, "part": self.index, "start": self.start, "rows": self.rows}


@dataclass(frozen=True, slots=True)
class PartReport:
    """The report of a graded part.

    Attributes
    ----------
    statuses, closures : collections.Counter
        Numbers of rows of each status and closure.
    peak_bytes : int
        Largest memory of the process so far; 0 if the system does not report it.
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


def split(files: list[SourceFile], rows_per_part: int) -> list[Part]:
    """Split files into parts. An empty file has one part, which holds its columns."""
    count = sum(max(1, -(-file.rows // rows_per_part)) for file in files)
    if count > _MAX_PARTS:
        raise InvalidInputError(
            f"rows_per_part: {rows_per_part} makes {count} parts of {sum(file.rows for file in files)} rows, "
            f"more than {_MAX_PARTS}; take more rows per part, or check that the source has so many rows"
        )
    ranges = (
        (file.path, start, min(rows_per_part, file.rows - start), file.state)
        for file in files
        for start in range(0, max(file.rows, 1), rows_per_part)
    )
    return [Part(index, *rows) for index, rows in enumerate(ranges)]


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
        raise GraspForceError(
            f"this machine has graspforce {__version__}, the one that started the run {version}; install one "
            "version on all"
        )
    report = PartReport()
    before = _looked_at(part.source)
    if part.state not in (None, before[0]):
        raise changed(part.source)
    with _opened(part.source) as file, appearing(out / part.name) as stream:
        schema = graded_schema(file.schema_arrow, options)
        origin = {**part.origin(run), _SOURCE_CHANGED: before[0].status_changed}
        schema = schema.with_metadata({**(schema.metadata or {}), ORIGIN: json.dumps(origin).encode()})
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
        # First, because the rows of a changed file prove nothing.
        if _looked_at(part.source) != before:
            raise changed(part.source)
        if done != part.rows:
            raise InvalidFileError(
                part.source,
                f"holds {done} rows from row {part.start} on, but claims {part.rows}; write the file again",
            )
        # A machine that lost its client may finish after another run took over the folder.
        if identity(out) != run:
            raise GraspForceError(f"{out}: belongs to another run now; the part is dropped")
    return report + PartReport(peak_bytes=_peak_bytes())


def report_of(part: Part, out: Path, run: str) -> PartReport:
    """Count the rows of a part that was graded before; refuse a file that holds other rows."""
    path = out / part.name
    try:
        with pq.ParquetFile(path) as file:
            report = _counted(file.read(columns=["status", "closure"]))
            origin = origin_of(file.schema_arrow)
            rows = report.statuses.total()
            if rows != part.rows:
                raise ResumeError(
                    f"{path}: holds {rows} rows, expected {part.rows}; delete it, and they are graded again"
                )
            seen = origin.pop(_SOURCE_CHANGED, None)
            own = origin == part.origin(run)
            # Somebody may have copied the source with its time, or changed it and restored the time.
            if own and part.state is not None and seen != part.state.status_changed:
                own = _same_rows(part, file)
    except (pa.ArrowException, OSError, KeyError) as error:
        raise InvalidFileError(path, f"{error}; delete it, and its rows are graded again") from error
    if not own:
        raise ResumeError(
            f"{path}: does not hold the rows from row {part.start} of {part.source.name} on; delete it, and "
            "they are graded again"
        )
    return report


def _same_rows(part: Part, graded: pq.ParquetFile) -> bool:
    """Whether the part holds the rows that its source has now. Both are read batch by batch."""
    with _opened(part.source) as file:
        names = file.schema_arrow.names
        batches = _batches(file, part, _rows_at_once(file, part))
        groups = iter(range(graded.num_row_groups))
        return (
            all(
                (group := next(groups, None)) is not None
                and _content(pa.Table.from_batches([batch]))
                == _content(graded.read_row_group(group, columns=names))
                for batch in batches
            )
            and next(groups, None) is None
        )


def _content(table: pa.Table) -> bytes:
    """Return a digest of the values; Arrow's own comparison finds NaN unequal to itself."""
    stream = BytesIO()
    pq.write_table(table.replace_schema_metadata(None), stream, compression="none")
    return hashlib.blake2b(stream.getbuffer()).digest()


def shifted(progress: Callable[[int], object], before: int) -> Callable[[int], object]:
    """Return a progress function for rows after the first `before` ones."""
    return lambda done: progress(before + done)


def _looked_at(path: Path) -> tuple[FileState, tuple[int, int]]:
    """Return the state of a file, and its device and number."""
    try:
        state, found = state_of(path), path.stat()
    except OSError as error:
        raise InvalidFileError(path, str(error)) from error
    return state, (found.st_dev, found.st_ino)


def _opened(path: Path) -> pq.ParquetFile:
    try:
        # By default pyarrow buffers ahead, and so reads whole row groups.
        return pq.ParquetFile(path, buffer_size=_READ_BUFFER_BYTES, pre_buffer=False)
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, str(error)) from error


def _batches(file: pq.ParquetFile, part: Part, at_once: int) -> Iterator[pa.RecordBatch]:
    """Yield the rows of a part, decoding only the row groups that hold them."""
    stop = part.start + part.rows
    at, groups = _groups_of(file, part)
    end_of_groups = at + sum(file.metadata.row_group(group).num_rows for group in groups)
    levels = 0
    for batch in _decoded(file, part.source, at_once, groups):
        begin, end = max(part.start - at, 0), min(stop - at, batch.num_rows)
        at += batch.num_rows
        if end_of_groups <= stop:
            levels += _levels(batch.column("positions"))
        if begin < end:
            yield batch.slice(begin, end - begin)
        if at >= stop:
            break
    if at == end_of_groups <= stop:
        _check_levels(file, part.source, groups, levels)


def _levels(column: pa.Array) -> int:
    """Count what Parquet stores for a column: its numbers, and one entry for each empty list."""
    empty = 0
    while is_list(column.type):
        lengths = pc.list_value_length(column).fill_null(0)
        empty += pc.sum(pc.equal(lengths, 0)).as_py() or 0
        column = column.flatten()
    return empty + len(column)


def _check_levels(file: pq.ParquetFile, path: Path, groups: list[int], levels: int) -> None:
    """Refuse row groups that hold more rows than they claim: the rest would be lost."""
    schema = file.metadata.schema
    leaf = next(
        k for k in range(file.metadata.num_columns) if schema.column(k).path.partition(".")[0] == "positions"
    )
    stored = sum(file.metadata.row_group(group).column(leaf).num_values for group in groups)
    if stored != levels:
        rows = sum(file.metadata.row_group(group).num_rows for group in groups)
        raise InvalidFileError(
            path,
            f"its row groups claim {rows} rows with {levels} values of positions, but {stored} values are "
            "stored; write the file again",
        )


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
        for batch in file.iter_batches(at_once, row_groups=groups):
            yield batch
            # The pool would keep the memory of several earlier batches.
            pa.default_memory_pool().release_unused()
    except (pa.ArrowException, OSError) as error:
        raise InvalidFileError(path, str(error)) from error


def _rows_at_once(file: pq.ParquetFile, part: Part) -> int:
    groups = [file.metadata.row_group(group) for group in range(file.metadata.num_row_groups)]
    heaviest = max((group.total_byte_size / max(group.num_rows, 1) for group in groups), default=1.0)
    # In the file, a value of a dictionary takes a few bits of each row; in memory it takes its length.
    first_row = islice(_decoded(file, part.source, 1, _groups_of(file, part)[1][:1]), 1)
    heaviest = max(heaviest, *map(_bytes_of, first_row), 1.0)
    return max(1, min(part.rows, int(_BATCH_BYTES / heaviest)))


def _bytes_of(row: pa.RecordBatch) -> int:
    # In a column that stays a dictionary, rows share the values.
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
    # On Linux, getrusage reports the peak of the parent process if that was larger.
    if _LINUX_STATUS.exists():
        lines = _LINUX_STATUS.read_text("ascii", "replace").splitlines()
        return next((1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM:")), 0)
    if sys.platform == "win32":
        return 0
    import resource  # noqa: PLC0415 - not on every system

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
