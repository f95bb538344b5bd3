"""A question, the families of problems in which it is asked, and what everybody answered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .timing import Measured, measure

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    import numpy as np

    from .timing import Call


@dataclass
class Answers:
    """One family of problems as every call answered it."""

    problem: str
    measured: list[Measured]
    reference: np.ndarray
    headline: bool = False
    """Whether the README shows it."""
    note: str = ""
    refuted: Callable[[int, float], bool] | None = None
    """Whether a peer's answer to one problem is proven wrong."""


@dataclass
class Question:
    """A question, what was asked and how, and the answers, measured as they are read."""

    title: str
    text: str
    answers: Iterator[Answers]


@dataclass
class Run:
    """How much is asked, and of which packages."""

    quick: bool
    packages: Collection[str]

    def number(self, full: int) -> int:
        """How many problems to ask where a full run asks so many."""
        return max(2, full // 100) if self.quick else full

    def ask(
        self,
        problem: str,
        calls: Sequence[Call],
        problems: Sequence[Any],
        *,
        headline: bool = False,
        **options: Any,
    ) -> Answers:
        """Measure one family; the first call's answers are the reference."""
        named = {"graspforce", *self.packages}
        wanted = [call for call in calls if call.package in named]
        measured = measure(wanted, problems, **options)
        for one in measured:
            # A peer's failure is a row of the table, our own is the end.
            assert one.call.package != "graspforce" or not one.failure, f"{one.call.name}: {one.failure}"
        return Answers(problem, measured, measured[0].answers, headline)
