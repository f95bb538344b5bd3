"""What a run over a dataset came to."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["GradeSummary"]


@dataclass(frozen=True, slots=True)
class GradeSummary:
    """What a run over a dataset came to.

    Attributes
    ----------
    out : pathlib.Path
        The folder of results.
    rows, parts : int
        Of the whole dataset.
    graded_rows, graded_parts : int
        Of this run: what an earlier one had done already is not done again.
    statuses : dict of str to int
        How many rows of the whole dataset are ``converged``, ``bracketed`` and ``invalid``.
    closures : dict of str to int
        How many have ``force``, ``partial`` and ``none`` as their closure.
    seconds : float
        What this run took.
    recovered : bool
        True where an earlier run had been killed while its results took the place of older ones, and this run
        completed that first.
    peak_bytes : int
        The most memory that any process that graded has had; 0 where the system does not say, or nothing was
        left to do.
    """

    out: Path
    rows: int
    parts: int
    graded_rows: int
    graded_parts: int
    statuses: dict[str, int]
    closures: dict[str, int]
    seconds: float
    peak_bytes: int
    recovered: bool = False

    @property
    def rows_per_second(self) -> float:
        """Rows graded in this run, a second."""
        return self.graded_rows / self.seconds if self.seconds > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain Python numbers and text, ready for JSON."""
        return {**asdict(self), "out": str(self.out), "rows_per_second": self.rows_per_second}
