"""Progress bars on the error stream, shown after one second."""

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

_DELAY_SECONDS = 1.0
_LOG_SECONDS = 10.0


@contextmanager
def progress(what: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Show a bar after a second on a terminal; yields a function to report how many are done.

    Without a total the bar shows the elapsed seconds alone.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()]
    if total is not None:
        columns.insert(2, MofNCompleteColumn())
    with _delayed(Progress(*columns, console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def throughput(what: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """Show progress and speed; yields a function of the number done and the number in all.

    Where the error stream is no terminal, a line every ten seconds goes there.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
    columns += [TextColumn("{task.fields[speed]}"), TimeRemainingColumn()]
    begin = said = time.monotonic()
    before: int | None = None
    with _delayed(Progress(*columns, console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task(what, total=None, speed="")

        def report(done: int, total: int) -> None:
            nonlocal before, said
            # Rows of an earlier run do not count for the speed of this one.
            before = done if before is None else before
            now = time.monotonic()
            speed = f"{(done - before) / max(now - begin, 1e-9):,.0f} {unit}/s"
            bar.update(task, completed=done, total=total, speed=speed)
            if not bar.console.is_terminal and now - said > _LOG_SECONDS:
                said = now
                bar.console.print(f"{what}: {done:,} of {total:,} {unit}, {speed}", highlight=False)

        yield report


@contextmanager
def _delayed(bar: Progress) -> Iterator[Progress]:
    timer = threading.Timer(_DELAY_SECONDS, bar.start)
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
