"""``graspforce grade``."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from graspforce._internal.optional_imports import optional
from graspforce.datasets import GradeSummary
from graspforce.datasets import grade as grade_dataset
from graspforce.errors import GraspForceError

from .exit_codes import FAILED
from .output import AsJson, in_a_folder, note, print_json, print_table
from .progress import throughput

if TYPE_CHECKING:
    from collections.abc import Iterator


def grade(
    source: Annotated[
        str, typer.Argument(metavar="IN", help="Parquet file, folder of Parquet files, or pattern in quotes.")
    ],
    out: Annotated[Path, typer.Option(help="Folder of the results.", callback=in_a_folder)],
    criterion: Annotated[
        Literal["max", "sum", "both"], typer.Option(help="Quality to compute: rho_max, rho_sum or both.")
    ] = "both",
    edges: Annotated[int, typer.Option(help="Edges of the linearised friction cones; 0 for true cones.")] = 8,
    rtol: Annotated[
        float | None, typer.Option(help="Relative width at which a bracket counts as converged.")
    ] = None,
    length_scale: Annotated[
        float | None, typer.Option(help="Length scale in m for datasets without this column.  \\[default: 1]")
    ] = None,
    rows_per_part: Annotated[
        int, typer.Option(help="Rows of one result file, which are lost if the run is interrupted.")
    ] = 50_000,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Replace another run's results when the new ones are complete."),
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of the scheduler of a Dask cluster that grades the parts."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compute the quality of every grasp of a dataset in Parquet files, larger than memory if need be.

    After an interruption the same command continues the run.

    Example: `graspforce grade grasps.parquet --out graded --length-scale 0.05`
    """
    with _cluster(scheduler) as client, throughput("grading", "rows") as report:
        try:
            found = grade_dataset(
                source,
                out,
                criteria=("max", "sum") if criterion == "both" else criterion,
                edges=edges or None,
                rtol=rtol,
                length_scale=length_scale,
                rows_per_part=rows_per_part,
                overwrite=overwrite,
                client=client,
                progress=report,
            )
        except KeyboardInterrupt:
            # Given again, --overwrite might start over what is done.
            same = "the same command without --overwrite" if overwrite else "the same command"
            note(f"interrupted; {same} continues the run in {out}")
            raise typer.Exit(FAILED) from None
    if as_json:
        print_json(found.to_dict())
    else:
        if found.recovered:
            note(f"an interrupted run was replacing the results in {out}; the replacement is now complete")
        _print(found)


def _print(found: GradeSummary) -> None:
    rows = [("rows", f"{found.rows:,}"), ("parts", f"{found.parts:,}")]
    rows += [(status, f"{count:,}") for status, count in found.statuses.items()]
    rows += [(f"closure {closure}", f"{count:,}") for closure, count in found.closures.items()]
    if found.graded_parts:
        rows += [
            ("rows graded now", f"{found.graded_rows:,}"),
            ("seconds", f"{found.seconds:.1f}"),
            ("rows a second", f"{found.rows_per_second:,.0f}"),
            ("peak memory", f"{found.peak_bytes / 2**20:,.0f} MiB"),
        ]
    print_table(str(found.out), ("", ""), rows)
    if not found.graded_parts:
        print("all parts were graded before; nothing was done")


@contextlib.contextmanager
def _cluster(address: str | None) -> Iterator[Any]:
    if address is None:
        yield None
        return
    distributed = optional("distributed", "dask")
    try:
        client = distributed.Client(address)
    except (OSError, ValueError) as error:
        raise GraspForceError(f"--scheduler: {address}: {error}") from error
    with client:
        yield client
