"""Rows of pandas DataFrames, alone or as partitions of a Dask DataFrame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyarrow as pa

from graspforce.errors import InvalidInputError, MissingExtraError

from .grade_table import grade_table
from .schema import GRASP_COLUMNS, check_names, check_type, result_fields

if TYPE_CHECKING:
    from collections.abc import Callable

    from .options import GradeOptions

ROWS_AT_ONCE = 50_000
"""Rows of a table in memory that are graded at a time. Flat copies exist for these rows only."""

_TEXT = "string[pyarrow]"


def grade_pandas(
    frame: Any, options: GradeOptions, progress: Callable[[int, int], object] | None = None
) -> Any:
    """Return a pandas DataFrame with its grades. Its own columns and its index do not change."""
    check_names(list(frame.columns), options)
    if not len(frame):
        return _with_nothing_graded(frame, options)
    used = frame[[name for name in GRASP_COLUMNS if name in frame.columns]]
    try:
        table = pa.Table.from_pandas(used, preserve_index=False)
    except pa.ArrowException as error:
        raise InvalidInputError(f"columns {', '.join(used.columns)}: {error}") from error
    for field in table.schema:
        check_type(field.name, field.type)
    graded = grade_table(table, options, ROWS_AT_ONCE, progress)
    columns = {}
    for field in result_fields(options):
        column = graded.column(field.name).to_pandas()
        columns[field.name] = (column.astype(_TEXT) if field.type == pa.string() else column).array
    return frame.assign(**columns)


def grade_dask(frame: Any, options: GradeOptions) -> Any:
    """Return the Dask DataFrame whose partitions are graded when it is computed."""
    try:
        import pandas as pd  # noqa: PLC0415 - comes with Dask DataFrames
    except ModuleNotFoundError as error:
        raise MissingExtraError("dask", error) from error

    check_names(list(frame.columns), options)
    for name, dtype in frame.dtypes.items():
        if name in GRASP_COLUMNS and isinstance(dtype, pd.ArrowDtype | pd.StringDtype):
            check_type(name, getattr(dtype, "pyarrow_dtype", pa.string()))
    # Columns of Python objects have no type before they are computed: each partition checks its own.
    meta = _with_nothing_graded(frame._meta, options)  # noqa: SLF001 - what Dask documents for this use
    return frame.map_partitions(grade_pandas, options, meta=meta)


def _with_nothing_graded(frame: Any, options: GradeOptions) -> Any:
    text = {field.name: field.type == pa.string() for field in result_fields(options)}
    return frame.assign(**dict.fromkeys(text)).astype(
        {name: _TEXT if is_text else "float64" for name, is_text in text.items()}
    )
