"""Times calls in turn on the same problems, so that ratios of one run are fair; compares their answers."""

from __future__ import annotations

import gc
import multiprocessing
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from multiprocessing.connection import Connection

ENOUGH_FOR_P99 = 100

WARM_UP = 10

# Seconds that one call may take for one family of problems: who is slow is asked fewer of them.
BUDGET = 15.0


class UnsolvedError(Exception):
    """A peer says that it did not solve a problem."""


def same(problem: Any) -> Any:
    return problem


@dataclass(frozen=True)
class Call:
    """One way to ask one peer.

    ``make`` imports the peer and returns what answers a problem with a number. ``prepare`` turns a problem
    into the peer's own form beforehand: neither is timed. ``tolerance`` is the relative difference to accept,
    infinite where the question is answered for other cones;
    ``reference`` marks calls of this library that peers are measured against; ``whole`` takes a block at
    once; ``apart`` asks in a process of its own, where a peer that spoils memory spoils nobody else's.
    """

    name: str
    package: str
    make: Callable[[], Callable[[Any], Any]]
    tolerance: float
    prepare: Callable[[Any], Any] = same
    reference: bool = False
    whole: bool = False
    apart: bool = False


@dataclass
class Measured:
    """What one call took and answered.

    ``failure`` says why it did not run at all, ``deaths`` how often it ended its process.
    """

    call: Call
    seconds: np.ndarray
    answers: np.ndarray
    failure: str = ""
    deaths: int = 0

    def first(self, problems: int) -> Measured:
        """Return the same of the first problems alone: who is slow was not asked the others."""
        timed = round(len(self.seconds) * min(problems / max(len(self.answers), 1), 1))
        return replace(self, seconds=self.seconds[:timed], answers=self.answers[:problems])

    @property
    def median(self) -> float:
        """In seconds."""
        return float(np.median(self.seconds))

    @property
    def p99(self) -> float:
        """NaN where too few calls were timed, each by itself, to speak of a tail."""
        few = self.call.whole or len(self.seconds) < ENOUGH_FOR_P99
        return np.nan if few else float(np.quantile(self.seconds, 0.99))

    @property
    def unsolved(self) -> int:
        """How many problems the peer says it did not solve."""
        return int(np.isnan(self.answers).sum())

    def differences(self, reference: np.ndarray) -> np.ndarray:
        """Relative; 0 where both are infinite or the peer did not solve, infinite where one is."""
        both = min(len(reference), len(self.answers))
        answers, reference = self.answers[:both], reference[:both]
        with np.errstate(invalid="ignore"):
            relative = np.abs(answers - reference) / np.maximum(np.abs(reference), 1e-300)
        relative[(answers == reference) | np.isnan(answers)] = 0
        return np.nan_to_num(relative, nan=np.inf)


class _Running:
    """One call on its way through the problems."""

    def __init__(self, call: Call) -> None:
        self.call = call
        self.seconds: list[float] = []
        self.answers: list[float] = []
        self.failure = ""
        self.deaths = 0
        self.spent = 0.0
        try:
            self.asked = Apart(call.make) if call.apart else _Here(call.make)
        except Exception as error:  # noqa: BLE001 - a peer may fail in any way, and the table says how
            self.failed(error)

    def measured(self) -> Measured:
        answers = np.array(self.answers, dtype=float)
        return Measured(self.call, np.array(self.seconds), answers, self.failure, self.deaths)

    def failed(self, error: Exception) -> None:
        self.failure = f"{type(error).__name__}: {' '.join(str(error).split())[:80]}"

    def block(self, problems: Sequence[Any], *, record: bool) -> None:
        if self.failure or self.spent > BUDGET:
            return
        try:
            prepared = [self.call.prepare(problem) for problem in problems]
            timed = self.asked.timed([prepared] if self.call.whole else prepared, BUDGET - self.spent)
        except Exception as error:  # noqa: BLE001 - as above
            self.failed(error)
            return
        for seconds, answer in timed:
            if record:
                self.answers.extend(np.atleast_1d(answer))
            if np.isnan(seconds):
                self.deaths += record
                continue
            self.spent += seconds
            if record:
                self.seconds.append(seconds / (len(problems) if self.call.whole else 1))


class _Here:
    """Asks in this process."""

    def __init__(self, make: Callable[[], Callable[[Any], Any]]) -> None:
        self.ask = make()

    def timed(self, problems: Sequence[Any], budget: float) -> list[tuple[float, Any]]:
        """Seconds and answers, in order, until the budget in seconds is spent."""
        timed: list[tuple[float, Any]] = []
        for problem in problems:
            if budget < 0:
                break
            start = time.perf_counter()
            try:
                answer = self.ask(problem)
            except UnsolvedError:
                answer = np.nan
            timed.append((time.perf_counter() - start, answer))
            budget -= timed[-1][0]
        return timed


class Apart:
    """Asks, and times, in a process of its own; one that dies costs a problem and is replaced."""

    LIVES = 100

    def __init__(self, make: Callable[[], Callable[[Any], Any]]) -> None:
        self.make = make
        self.deaths = 0
        self._start()

    def _start(self) -> None:
        # Not a fork, which would begin with all that other peers have loaded.
        spawn = multiprocessing.get_context("spawn")
        self.connection, theirs = spawn.Pipe()
        self.process = spawn.Process(target=_serve, args=(self.make, theirs), daemon=True)
        self.process.start()
        theirs.close()
        self._expect()

    def timed(self, problems: Sequence[Any], budget: float) -> list[tuple[float, Any]]:
        """As `_Here.timed`; what ended the process has no seconds and no answer."""
        timed: list[tuple[float, Any]] = []
        while len(timed) < len(problems):
            try:
                self.connection.send((problems[len(timed) :], budget))
                while (one := self._expect()) is not None:
                    timed.append(one)
                    budget -= one[0]
                break
            except (EOFError, OSError) as error:
                self.deaths += 1
                if self.deaths == self.LIVES:
                    self.process.join(1)
                    how = f"died {self.LIVES} times, at last with exit code {self.process.exitcode}"
                    raise ChildProcessError(how) from error
                timed.append((np.nan, np.nan))
                self._start()
        return timed

    def _expect(self) -> Any:
        answer = self.connection.recv()
        if isinstance(answer, Exception):
            raise answer
        return answer


def _serve(make: Callable[[], Callable[[Any], Any]], connection: Connection) -> None:
    try:
        here = _Here(make)
        connection.send(None)
        gc.disable()
        while True:
            problems, budget = connection.recv()
            for problem in problems:
                for one in here.timed([problem], budget):
                    connection.send(one)
                    budget -= one[0]
            connection.send(None)
    except EOFError:
        return
    except Exception as error:  # noqa: BLE001 - told to who asks
        connection.send(error)


def nothing() -> float:
    """Seconds that timing a call adds: one that does nothing."""
    call = Call("nothing", "", lambda: same, 0)
    return measure([call], [0.0] * 10_000)[0].median


def measure(
    calls: Sequence[Call], problems: Sequence[Any], block: int = 50, *, warm_up: bool = True
) -> list[Measured]:
    """Ask every call every problem, in order; calls take turns, another one first after each block."""
    running = [_Running(call) for call in calls]
    gc.collect()
    gc.disable()
    if warm_up:
        for one in running:
            one.block(problems[:WARM_UP], record=False)
    for number, first in enumerate(range(0, len(problems), block)):
        turn = number % len(running)
        for one in running[turn:] + running[:turn]:
            one.block(problems[first : first + block], record=True)
    gc.enable()
    return [one.measured() for one in running]
