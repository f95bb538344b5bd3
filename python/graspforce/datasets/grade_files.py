"""Grades the files of a dataset part by part, on this machine or on a cluster. Finished parts are kept."""

from __future__ import annotations

import contextlib
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce._internal.checks import whole_number
from graspforce.errors import GraspForceError, InvalidInputError, ResumeError

from .atomic_files import owned
from .dask_cluster import grade_parts_on
from .grade_table import CLOSURES, STATUSES
from .manifest import prepare, publish, refuse_other_folder
from .parquet_source import find_files, look_at
from .part_files import READERS, graded_parts
from .parts import Part, PartReport, grade_part, report_of, shifted, split
from .summary import GradeSummary

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .options import GradeOptions


def grade_files(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    options: GradeOptions,
    *,
    rows_per_part: int,
    overwrite: bool,
    client: Any,
    progress: Callable[[int, int], object] | None,
) -> GradeSummary:
    """Grade the Parquet files of a source into the parts of a folder."""
    with _system_errors_named(out, progress) as report_rows:
        begin = time.perf_counter()
        rows_per_part = whole_number("rows_per_part", rows_per_part, least=1)
        folder = Path(out).absolute()
        if Path(source).is_dir() and Path(os.path.realpath(folder)).is_relative_to(os.path.realpath(source)):
            raise InvalidInputError(
                f"out: {out} lies in the folder of the source: its parts would be read as source files; "
                "name another folder"
            )
        root, paths = find_files(source, folder)
        files = look_at(paths, options)
        parts = split(files, rows_per_part)
        total = sum(file.rows for file in files)
        refuse_other_folder(folder)
        with owned(folder) as writable:
            place = prepare(
                folder, root, files, options, rows_per_part, overwrite=overwrite, writable=writable
            )
            report, pending = _done_before(place.folder, place.run, parts)
            left = sum(part.rows for part in pending)
            if pending and not writable:
                raise InvalidInputError(
                    f"out: {folder} is not writable, and {pending[0].name} is missing in it"
                )

            def tell(rows: int) -> None:
                report_rows(total - left + rows, total)

            tell(0)
            common = {"out": place.folder, "options": options, "run": place.run}
            reports = _grade_here(pending, common, tell)
            if client is not None:
                reports = grade_parts_on(client, pending, common, tell)
            for one in reports:
                report += one
            written = {path.name for path in graded_parts(place.folder)}
            missing = [part.name for part in parts if part.name not in written]
            if missing:
                raise GraspForceError(
                    f"{folder}: {missing[0]} is missing, although a worker wrote it; source and results must "
                    "lie on a file system that all machines share"
                )
            publish(folder, place)
        return GradeSummary(
            out=folder,
            rows=total,
            parts=len(parts),
            graded_rows=left,
            graded_parts=len(pending),
            statuses={name: report.statuses[name] for name in STATUSES},
            closures={name: report.closures[name] for name in reversed(CLOSURES)},
            seconds=time.perf_counter() - begin,
            peak_bytes=report.peak_bytes,
            recovered=place.recovered,
        )


@contextlib.contextmanager
def _system_errors_named(
    out: str | os.PathLike[str], progress: Callable[[int, int], object] | None
) -> Iterator[Callable[[int, int], None]]:
    """Turn errors of the system into errors of the library; yield the caller's progress function.

    Errors that the caller's function raises stay as they are.
    """
    of_caller: list[OSError] = []

    def report(done: int, total: int) -> None:
        if progress is not None:
            try:
                progress(done, total)
            except OSError as error:
                of_caller.append(error)
                raise

    try:
        yield report
    except OSError as error:
        if isinstance(error, GraspForceError) or error in of_caller:
            raise
        raise GraspForceError(f"{out}: {error}") from error


def _done_before(out: Path, run: str, parts: list[Part]) -> tuple[PartReport, list[Part]]:
    """Return the report of the parts that are graded already, and the parts that are not."""
    names = {path.name for path in graded_parts(out)}
    others = {path.name for path in out.iterdir()} - names
    for part in parts:
        if part.name in others:
            raise ResumeError(
                f"{out / part.name}: not a regular file, so this run did not write it; delete or rename it"
            )
    done = [part for part in parts if part.name in names]
    report = PartReport()
    with ThreadPoolExecutor(READERS) as pool:
        for found in pool.map(lambda part: report_of(part, out, run), done):
            report += found
    return report, [part for part in parts if part.name not in names]


def _grade_here(
    parts: list[Part], common: dict[str, Any], tell: Callable[[int], None]
) -> Iterator[PartReport]:
    before = 0
    for part in parts:
        yield grade_part(part, **common, progress=shifted(tell, before))
        before += part.rows
        tell(before)
