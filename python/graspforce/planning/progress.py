"""The progress bar of long searches."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterator

Report: TypeAlias = Callable[[int, int, float], object]
"""Called as ``report(done, total, epsilon)``."""


@contextlib.contextmanager
def reporting(progress: bool | Report | None, title: str, number: str) -> Iterator[Report | None]:
    """Yield the function to report to: one that draws a bar with `number`, the caller's, or None."""
    if callable(progress):
        yield progress
    elif progress is True:
        rich = optional("rich.progress", "search")
        columns = (*rich.Progress.get_default_columns(), rich.TextColumn(number + " {task.fields[epsilon]}"))
        with rich.Progress(*columns, transient=True) as bar:
            task = bar.add_task(title, total=None, epsilon="-")

            def report(done: int, total: int, epsilon: float) -> None:
                bar.update(task, completed=done, total=total, epsilon=f"{epsilon:.4g}")

            yield report
    elif progress is None or progress is False:
        yield None
    else:
        raise InvalidInputError(f"progress: {progress!r} is neither a bool nor callable")
