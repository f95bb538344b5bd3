"""The parts of a dataset on the machines of a Dask cluster."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from graspforce._core import __version__
from graspforce.errors import GraspForceError, InvalidInputError, MissingExtraError

from .parts import grade_part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from .options import GradeOptions
    from .parts import Part, PartReport

__all__ = ["grade_parts_on"]


def grade_parts_on(
    client: Any, parts: list[Part], out: Path, options: GradeOptions, tell: Callable[[int], None]
) -> Iterator[PartReport]:
    """Yield reports of parts as machines finish them; a part whose machine is lost is given to another."""
    try:
        distributed: Any = import_module("distributed")
    except ModuleNotFoundError as error:
        raise MissingExtraError("dask", error) from error

    if not isinstance(client, distributed.Client):
        raise InvalidInputError(f"client: {client!r} is not a distributed.Client")
    # Not pure: the same part asked for again, after its file was deleted, is work again.
    futures = client.map(grade_part, parts, out=out, options=options, version=__version__, pure=False)
    rows = {future.key: part.rows for future, part in zip(futures, parts, strict=True)}
    done = 0
    try:
        for future in distributed.as_completed(futures):
            yield _result(future)
            done += rows[future.key]
            tell(done)
    finally:
        # After an error or Ctrl-C the rest is not wanted; what is done already stays.
        client.cancel(futures)


def _result(future: Any) -> PartReport:
    try:
        report: PartReport = future.result()
    except (GraspForceError, OSError):
        raise
    except Exception as error:
        raise GraspForceError(f"the cluster could not grade a part: {error}") from error
    return report
