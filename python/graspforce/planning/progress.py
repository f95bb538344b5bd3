"""The progress bar of long searches."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from graspforce._optional import optional

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Report", "progress_bar"]

Report: TypeAlias = Callable[[int, int, float], object]
"""What is told of a search: how much is done, of how much in all, and the best epsilon so far."""


@contextlib.contextmanager
def progress_bar(title: str) -> Iterator[Report]:
    """Show a bar with the best epsilon while the block runs."""
    rich = optional("rich.progress", "search")
    columns = (*rich.Progress.get_default_columns(), rich.TextColumn("best epsilon {task.fields[epsilon]}"))
    with rich.Progress(*columns, transient=True) as bar:
        task = bar.add_task(title, total=None, epsilon="-")

        def report(done: int, total: int, epsilon: float) -> None:
            bar.update(task, completed=done, total=total, epsilon=f"{epsilon:.4g}")

        yield report
