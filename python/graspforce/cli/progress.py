"""Progress on the error stream, for people who wait more than a second."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["progress", "throughput"]

_PATIENCE_SECONDS = 1.0
_LOG_SECONDS = 10.0


@contextmanager
def progress(what: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Show a bar after a second, if anyone is there to look; yields a function to say how many are done.

    Without a total the bar only moves and counts seconds.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()]
    if total is not None:
        columns.insert(2, MofNCompleteColumn())
    with _patient(Progress(*columns, console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def throughput(what: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """Show how much of a long work is done, and how fast; yields a function of how many are done, and of all.

    Where nobody looks, a line now and then is for the log.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
    columns += [TextColumn("{task.fields[speed]}"), TimeRemainingColumn()]
    begin = said = time.monotonic()
    before: int | None = None
    with _patient(Progress(*columns, console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task(what, total=None, speed="")

        def report(done: int, total: int) -> None:
            nonlocal before, said
            # What an earlier run has done says nothing of this one's speed.
            before = done if before is None else before
            now = time.monotonic()
            speed = f"{(done - before) / max(now - begin, 1e-9):,.0f} {unit}/s"
            bar.update(task, completed=done, total=total, speed=speed)
            if not bar.console.is_terminal and now - said > _LOG_SECONDS:
                said = now
                bar.console.print(f"{what}: {done:,} of {total:,} {unit}, {speed}", highlight=False)

        yield report


@contextmanager
def _patient(bar: Progress) -> Iterator[Progress]:
    timer = threading.Timer(_PATIENCE_SECONDS, bar.start)
    timer.daemon = True
    if bar.console.is_terminal:
        timer.start()
    try:
        yield bar
    finally:
        timer.cancel()
        if timer.ident is not None:
            timer.join()
        # Stopping what never started would print an empty line into the log.
        if bar.live.is_started:
            bar.stop()
