"""The summary of a run over a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class GradeSummary(Record):
    """The summary of a run over a dataset.

    Attributes
    ----------
    out : pathlib.Path
        The folder of results.
    rows, parts : int
        Numbers of rows and parts of the whole dataset.
    graded_rows, graded_parts : int
        Numbers of rows and parts graded in this run; those of an earlier run are not graded again.
    statuses : dict of str to int
        Numbers of rows of the whole dataset that are ``converged``, ``bracketed`` and ``invalid``.
    closures : dict of str to int
        Numbers of rows whose closure is ``force``, ``partial`` and ``none``.
    seconds : float
        Duration of this run in s.
    recovered : bool
        True if an earlier run was interrupted while it replaced older results, and this run completed the
        replacement first.
    peak_bytes : int
        Largest memory of any process that graded. It is 0 if the system does not report it, or if nothing was
        graded.
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
        """Rows graded per second of this run."""
        return self.graded_rows / self.seconds if self.seconds > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain Python numbers and text, ready for JSON."""
        return {**Record.to_dict(self), "rows_per_second": self.rows_per_second}
