"""`graspforce.grade`: the quality of every grasp of a dataset."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, overload

from graspforce._internal.checks import progress_function
from graspforce.errors import InvalidInputError, MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .summary import GradeSummary

_ROWS_PER_PART = 50_000


@overload
def grade(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    criteria: Sequence[str] | str = ...,
    edges: int | None = ...,
    rtol: float | None = ...,
    length_scale: float | None = ...,
    rows_per_part: int = ...,
    overwrite: bool = ...,
    client: Any = ...,
    progress: Callable[[int, int], object] | None = ...,
) -> GradeSummary: ...
@overload
def grade(
    source: Any,
    out: None = ...,
    *,
    criteria: Sequence[str] | str = ...,
    edges: int | None = ...,
    rtol: float | None = ...,
    length_scale: float | None = ...,
    progress: Callable[[int, int], object] | None = ...,
) -> Any: ...
def grade(
    source: Any,
    out: str | os.PathLike[str] | None = None,
    *,
    criteria: Sequence[str] | str = ("max", "sum"),
    edges: int | None = 8,
    rtol: float | None = None,
    length_scale: float | None = None,
    rows_per_part: int = _ROWS_PER_PART,
    overwrite: bool = False,
    client: Any = None,
    progress: Callable[[int, int], object] | None = None,
) -> Any:
    """Compute the quality of every grasp of a dataset, in memory, in Parquet files or on a Dask cluster.

    A row is a grasp. The columns ``positions`` and ``normals`` hold lists of vectors. ``friction`` and
    ``max_normal_force`` hold a number, or a list of one number for each contact. The columns ``torsion``,
    ``tangents``, ``origin`` and ``length_scale`` are optional. All are as for `graspforce.Grasp`. Other
    columns are passed on unchanged, and these are added:

    - ``status``: ``converged``; ``bracketed`` if the bracket is wider than asked for;
      ``invalid`` if the row is no grasp.
    - ``message``: why a row did not converge, with column, contact and value.
    - ``closure``: ``force``, ``partial`` or ``none``.
    - ``rho_max``, ``rho_max_lower``, ``rho_max_upper``, and the same for ``rho_sum``: see
      `graspforce.Quality`. They are null in invalid rows only.

    Parameters
    ----------
    source : pyarrow.Table, pyarrow.RecordBatch, pandas.DataFrame, dask.dataframe.DataFrame or path
        The dataset. A path names a Parquet file, a folder of them, or a pattern such as ``grasps/*.parquet``.
    out : path, optional
        With a path: the folder of results. Each of its files ``part-000000.parquet``, ... appears complete or
        not at all. The same call continues an interrupted run and does nothing after a finished one.
    criteria : str or sequence of str
        ``"max"``, ``"sum"`` or both.
    edges : int or None
        Edges of the linearised friction cones; None for true cones.
    rtol : float, optional
        Relative width of the bracket that counts as converged, as for `graspforce.Grasp.quality`.
    length_scale : float, optional
        In m, for datasets without this column; 1 by default.
    rows_per_part : int
        Rows of one result file. They are lost if the run is interrupted, and memory must hold them.
    overwrite : bool
        True to replace the results of another run in `out`. The old results stay until the new ones are
        complete; an interruption leaves one of the two.
    client : distributed.Client, optional
        With a path: the cluster whose machines grade the parts. They must share the file system of `source`
        and `out`. A part whose machine is lost goes to another. The results are those of a run without it.
    progress : callable, optional
        Called now and then, and at the end, with the number of rows done and the number in all. An exception
        it raises ends the run, which can be continued. Not for Dask DataFrames, which are computed later.

    Returns
    -------
    The same kind as `source`, with the columns above; a Dask DataFrame is computed later. Of a path a
    `graspforce.datasets.GradeSummary`.

    Raises
    ------
    InvalidInputError
        A column is missing or has the wrong type, or an argument is wrong. Nothing is graded then. With files
        it is an `InvalidFileError`, which is also raised if a file changes while it is graded.
    ResumeError
        `out` holds results of other options or another source, other files, or parts with other rows. Nothing
        is changed then.
    GraspForceError
        The system cannot read or write a file; the message is the system's.
    BusyError
        Another run is writing into `out`.
    MissingExtraError
        pyarrow, or Dask, is not installed.

    Notes
    -----
    The rows keep the order of the source. The quality of a row depends on that row alone. It is the same bit
    for bit for every size of parts, and on every machine with the same processor and C library. Safe to call
    from several threads.

    Examples
    --------
    >>> import pyarrow as pa
    >>> import graspforce as gf
    >>> pinch = [[-1.0, 0.0], [1.0, 0.0]]
    >>> table = pa.table({
    ...     "id": ["pinch", "slip"],
    ...     "positions": [pinch, pinch],
    ...     "normals": [[[1.0, 0.0], [-1.0, 0.0]]] * 2,
    ...     "friction": [0.5, -0.5],
    ...     "max_normal_force": [[1.0, 1.0]] * 2,
    ... })
    >>> graded = gf.grade(table)
    >>> graded["status"].to_pylist()
    ['converged', 'invalid']
    >>> graded["message"].to_pylist()
    [None, 'friction, contact 0: -0.5 must be finite and not negative']
    >>> [rho and round(rho, 4) for rho in graded["rho_max"].to_pylist()]
    [-0.5774, None]
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 - needed here alone

        from . import dataframes, grade_files, options, schema  # noqa: PLC0415
        from .grade_table import grade_table  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise MissingExtraError("datasets", error) from error

    progress_function(progress)
    asked = options.GradeOptions.of(criteria, edges=edges, rtol=rtol, length_scale=length_scale)
    if isinstance(source, str | os.PathLike):
        if out is None:
            raise InvalidInputError("out: missing; the grades of files are written to a folder")
        return grade_files.grade_files(
            source,
            out,
            asked,
            rows_per_part=rows_per_part,
            overwrite=overwrite,
            client=client,
            progress=progress,
        )
    for name, given in (("out", out), ("client", client)):
        if given is not None:
            raise InvalidInputError(f"{name}: only where the source is a path, not a {_kind(source)}")
    if isinstance(source, pa.Table | pa.RecordBatch):
        schema.check_schema(source.schema, asked)
        table = source if isinstance(source, pa.Table) else pa.Table.from_batches([source])
        graded = grade_table(table, asked, dataframes.ROWS_AT_ONCE, progress)
        if table is source:
            return graded
        columns = [column.combine_chunks() for column in graded.columns]
        return pa.RecordBatch.from_arrays(columns, schema=graded.schema)
    if _kind(source) == "pandas.DataFrame":
        return dataframes.grade_pandas(source, asked, progress)
    if _kind(source) == "dask.DataFrame":
        return dataframes.grade_dask(source, asked)
    raise InvalidInputError(
        f"source: {_kind(source)}, expected a path, a pyarrow Table or RecordBatch, or a DataFrame of pandas "
        "or Dask"
    )


def _kind(source: object) -> str:
    # By name, so that neither package is imported unless it is in use.
    return f"{type(source).__module__.partition('.')[0]}.{type(source).__name__}"
