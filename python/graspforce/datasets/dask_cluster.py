"""The parts of a dataset on the machines of a Dask cluster."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspforce._core import __version__
from graspforce._internal.optional_imports import optional
from graspforce.errors import GraspForceError, InvalidInputError

from .parts import grade_part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .parts import Part, PartReport


def grade_parts_on(
    client: Any, parts: list[Part], common: dict[str, Any], tell: Callable[[int], None]
) -> Iterator[PartReport]:
    """Yield reports of parts as machines finish them. Parts of a lost machine go to another one.

    `common` holds the arguments of `grade_part` that all parts share.
    """
    distributed = optional("distributed", "dask")
    if not isinstance(client, distributed.Client):
        raise InvalidInputError(f"client: {client!r} is not a distributed.Client")
    # Not pure: a part whose file was deleted has to be graded again.
    futures = client.map(grade_part, parts, **common, version=__version__, pure=False)
    left = {future.key: part.rows for future, part in zip(futures, parts, strict=True)}
    done = 0
    try:
        for future in distributed.as_completed(futures):
            yield _result(future)
            done += left.pop(future.key)
            tell(done)
            # A report that has arrived is kept, even if its machine is lost later.
            future.release()
    finally:
        # After an error or Ctrl-C the remaining parts are cancelled; finished ones stay.
        client.cancel([future for future in futures if future.key in left])


def _result(future: Any) -> PartReport:
    try:
        report: PartReport = future.result()
    except (GraspForceError, OSError):
        raise
    except Exception as error:
        raise GraspForceError(f"the cluster could not grade a part: {error}") from error
    return report
