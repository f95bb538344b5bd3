"""A whole dataset, part by part, on this machine or on a cluster; what is done already is left alone."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce._checks import whole_number
from graspforce.errors import GraspForceError, InvalidInputError, ResumeError

from .cluster import grade_parts_on
from .folder import graded_parts, identity, prepare
from .grading import CLOSURES, STATUSES
from .parts import Part, PartReport, grade_part, report_of, shifted, split
from .source import READERS, find_files, look_at
from .summary import GradeSummary
from .writing import owned

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    from .options import GradeOptions

__all__ = ["grade_files"]


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
    begin = time.perf_counter()
    rows_per_part = whole_number("rows_per_part", rows_per_part, least=1)
    folder = Path(out).absolute()
    if Path(source).is_dir() and folder.resolve().is_relative_to(Path(source).resolve()):
        raise InvalidInputError(f"out: {out} lies in the source's folder; its parts would become sources")
    root, paths = find_files(source, folder)
    files = look_at(paths, options)
    parts = split([(file.path, file.rows) for file in files], rows_per_part)
    total = sum(file.rows for file in files)
    with owned(folder):
        prepare(folder, root, files, options, rows_per_part, overwrite=overwrite)
        report, pending = _done_before(folder, parts)
        left = sum(part.rows for part in pending)

        def tell(rows: int) -> None:
            if progress is not None:
                progress(total - left + rows, total)

        tell(0)
        common = {"out": folder, "options": options, "run": identity(folder)}
        reports = _grade_here(pending, common, tell)
        if client is not None:
            reports = grade_parts_on(client, pending, common, tell)
        for one in reports:
            report += one
        missing = [part.name for part in parts if not (folder / part.name).exists()]
        if missing:
            raise GraspForceError(
                f"{folder}: {missing[0]} is not here, though a worker wrote it: source and results must lie "
                "on a file system that all machines share"
            )
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
    )


def _done_before(out: Path, parts: list[Part]) -> tuple[PartReport, list[Part]]:
    names = {path.name for path in graded_parts(out)}
    done = [part for part in parts if part.name in names]
    report = PartReport()
    with ThreadPoolExecutor(READERS) as pool:
        for part, found in zip(done, pool.map(report_of, (out / part.name for part in done)), strict=True):
            rows = found.statuses.total()
            if rows != part.rows:
                raise ResumeError(
                    f"{out / part.name}: holds {rows} rows, not {part.rows}; delete it, and they are graded "
                    "again"
                )
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
