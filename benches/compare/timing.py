"""Times calls in turn on the same problems, so that ratios of one run are fair; compares their answers."""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

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
    into the peer's own form beforehand: neither is timed. ``tolerance`` is the relative difference to accept;
    ``reference`` marks calls of this library that peers are measured against; ``whole`` takes a block at
    once.
    """

    name: str
    package: str
    make: Callable[[], Callable[[Any], Any]]
    tolerance: float
    prepare: Callable[[Any], Any] = same
    reference: bool = False
    whole: bool = False


@dataclass
class Measured:
    """What one call took and answered; ``failure`` says why it did not run at all."""

    call: Call
    seconds: np.ndarray
    answers: np.ndarray
    failure: str = ""

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
        reference = reference[: len(self.answers)]
        with np.errstate(invalid="ignore"):
            relative = np.abs(self.answers - reference) / np.maximum(np.abs(reference), 1e-300)
        relative[(self.answers == reference) | np.isnan(self.answers)] = 0
        return np.nan_to_num(relative, nan=np.inf)


class _Running:
    """One call on its way through the problems."""

    def __init__(self, call: Call) -> None:
        self.call = call
        self.seconds: list[float] = []
        self.answers: list[float] = []
        self.failure = ""
        self.spent = 0.0
        try:
            self.ask = call.make()
        except Exception as error:  # noqa: BLE001 - a peer may fail in any way, and the table says how
            self.failed(error)

    def failed(self, error: Exception) -> None:
        self.failure = f"{type(error).__name__}: {' '.join(str(error).split())[:80]}"

    def block(self, problems: Sequence[Any], *, record: bool) -> None:
        if self.failure:
            return
        try:
            prepared = [self.call.prepare(problem) for problem in problems]
            for problem in [prepared] if self.call.whole else prepared:
                if self.spent > BUDGET:
                    return
                seconds, answer = self._one(problem)
                self.spent += seconds
                if record:
                    self.seconds.append(seconds / (len(problems) if self.call.whole else 1))
                    self.answers.extend(np.atleast_1d(answer))
        except Exception as error:  # noqa: BLE001 - as above
            self.failed(error)

    def _one(self, problem: Any) -> tuple[float, Any]:
        start = time.perf_counter()
        try:
            answer = self.ask(problem)
        except UnsolvedError:
            answer = np.nan
        return time.perf_counter() - start, answer


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
    return [
        Measured(r.call, np.array(r.seconds), np.array(r.answers, dtype=float), r.failure) for r in running
    ]
