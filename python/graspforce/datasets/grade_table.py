"""The grades of one batch of rows; all kinds of datasets use them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from graspforce._core import quality_many
from graspforce.status import Status

from .rows import Rows
from .schema import result_fields

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from .options import GradeOptions

STATUSES = ("converged", "bracketed", "invalid")
"""The bracket is narrow enough; it is too wide; the row is not a grasp."""

CLOSURES = ("none", "partial", "force")

_CONVERGED, _BRACKETED, _INVALID = range(3)

_GRADES = np.array([_CONVERGED, _INVALID, _INVALID, _BRACKETED], np.int8)
"""The grade's status for each `Status` of a quality."""


def grade_batch(
    batch: pa.RecordBatch, options: GradeOptions, progress: Callable[[int], object] | None = None
) -> list[pa.Array]:
    """Return the columns of `result_fields` for a batch whose schema has been checked.

    The grade of a row depends on that row alone. `progress` is called with the number of rows that are done.
    """
    count = batch.num_rows
    rows = Rows(batch)
    messages = dict(rows.faults.messages)
    status = np.where(rows.faults.bad, _INVALID, _CONVERGED).astype(np.int8)
    closure = np.zeros(count, np.int8)
    rho = {
        name: np.full(count, np.nan)
        for criterion in options.criteria
        for name in (f"rho_{criterion}", f"rho_{criterion}_lower", f"rho_{criterion}_upper")
    }
    done = len(messages)
    for group, contacts in rows.groups():
        arguments: dict[str, Any] = {**contacts, **options.arguments()}
        brackets: dict[int, list[str]] = {}
        for k, criterion in enumerate(options.criteria):
            before = done + len(group) * k / len(options.criteria)
            found = quality_many(
                **arguments,
                criterion=criterion,
                progress=progress and _reported(progress, before, len(options.criteria)),
            )
            name = f"rho_{criterion}"
            rho[name][group] = found.rho
            rho[f"{name}_lower"][group], rho[f"{name}_upper"][group] = found.lower, found.upper
            for at in np.flatnonzero(found.status == Status.NOT_CONVERGED).tolist():
                between = f"{found.lower[at]:.9g} <= {name} <= {found.upper[at]:.9g}"
                brackets.setdefault(int(group[at]), []).append(between)
            messages |= {int(group[at]): reason for at, reason in found.errors.items()}
            status[group] = np.maximum(status[group], _GRADES[found.status])
            if k == 0:
                closure[group] = found.closure + 1
        for row, wide in brackets.items():
            messages.setdefault(row, f"bracket wider than asked for: {', '.join(wide)}")
        done += len(group)
    invalid = status == _INVALID
    columns: dict[str, Any] = {
        "status": _words(status, STATUSES),
        "message": _texts(messages, count),
        "closure": _words(closure, CLOSURES, invalid),
        **{name: pa.array(values, mask=invalid) for name, values in rho.items()},
    }
    return [columns[field.name] for field in result_fields(options)]


def grade_table(
    table: pa.Table,
    options: GradeOptions,
    rows_at_once: int,
    progress: Callable[[int, int], object] | None = None,
) -> pa.Table:
    """Return a table with its grades as further columns. Its schema has been checked."""
    fields = result_fields(options)
    pieces: list[list[pa.Array]] = [[] for _ in fields]
    # Only the columns that are graded; all others are passed on unchanged.
    done = 0

    def tell(rows: int) -> None:
        if progress is not None:
            progress(done + rows, table.num_rows)

    for batch in table.to_batches(max_chunksize=rows_at_once):
        for piece, column in zip(pieces, grade_batch(batch, options, tell), strict=True):
            piece.append(column)
        done += batch.num_rows
    for field, piece in zip(fields, pieces, strict=True):
        table = table.append_column(field, pa.chunked_array(piece, field.type))
    if progress is not None:
        progress(table.num_rows, table.num_rows)
    return table


def _reported(
    progress: Callable[[int], object], before: float, criteria: int
) -> Callable[[int, int], object]:
    return lambda done, _total: progress(int(before + done / criteria))


def _words(
    codes: NDArray[np.int8], words: tuple[str, ...], missing: NDArray[np.bool_] | None = None
) -> pa.Array:
    indices = pa.array(codes, pa.int8(), mask=missing)
    return pa.DictionaryArray.from_arrays(indices, pa.array(words)).cast(pa.string())


def _texts(messages: dict[int, str], count: int) -> pa.Array:
    texts = np.full(count, None, object)
    texts[list(messages)] = list(messages.values())
    return pa.array(texts, pa.string())
