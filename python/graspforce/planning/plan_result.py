"""The result of the pattern search of section 3.4."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias, get_args

import numpy as np

from graspforce._internal.html import table, vector
from graspforce._internal.restored import (
    expect,
    expect_array,
    expect_instance,
    expect_number,
    expect_search_result,
    expect_tuple,
)
from graspforce._internal.to_dict import Record
from graspforce.typing import Stopped

from .scoring import SearchCounts

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from graspforce._core import Grasp, Quality
    from graspforce.typing import Criterion

Blocks: TypeAlias = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Iterate(Record):
    """One iterate of a plan.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the contacts.
    rho : float
        Quality there. Negative means force closure; smaller is better.
    step : numpy.ndarray
        (p,) steps of the next iteration.
    """

    params: NDArray[np.float64]
    rho: float
    step: NDArray[np.float64]

    def __repr__(self) -> str:
        """Write six digits of each number."""
        return (
            f"Iterate(params={vector(self.params, digits=6)}, rho={self.rho:.6g}, step={vector(self.step)})"
        )

    def _check(self) -> None:
        expect_array("params", self.params, (None,))
        expect_array("step", self.step, self.params.shape)
        expect_number("rho", self.rho, finite=False)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Plan(Record):
    """The best grasp that a pattern search found, and its iterates.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the best grasp found.
    quality : Quality
        Its quality, with its proven bracket.
    grasp : Grasp
        The grasp itself.
    history : tuple of Iterate
        The iterates, the initial one included.
    criterion : {"max", "sum"}
        The quality that was improved.
    counts : SearchCounts
        Numbers of candidates, of those rejected without a polytope, and of polytopes started and converged.
    blocks : tuple of tuple of int
        Parameters that moved together: one block of all, or several if their pattern would be too large. An
        iterate is then a sweep over all blocks.
    stopped : {"tolerance", "target", "time", "interrupted", "error"}
        Why the search ended. "tolerance": all steps were within their tolerances. "error": an error ended the
        search and carries this plan as its ``partial``.
    """

    params: NDArray[np.float64]
    quality: Quality
    grasp: Grasp
    history: tuple[Iterate, ...]
    criterion: Criterion
    counts: SearchCounts
    blocks: Blocks
    stopped: Stopped

    def _check(self) -> None:
        expect_search_result(self)
        expect(self.criterion == self.quality.criterion, "criterion", "that of the quality")
        expect_tuple("history", self.history, Iterate)
        expect(self.history, "history", "one iterate or more")
        for iterate in self.history:
            expect(iterate.params.shape == self.params.shape, "history", "as many parameters")
        expect_instance("counts", self.counts, SearchCounts)
        expect_tuple("blocks", self.blocks, tuple)
        indices = [index for block in self.blocks for index in block]
        every = all(type(index) is int for index in indices) and sorted(indices) == [*range(len(self.params))]
        expect(every and all(self.blocks), "blocks", "each parameter in one block")
        expect(self.stopped in get_args(Stopped), "stopped", "a reason")

    @property
    def num_candidates(self) -> int:
        """Number of candidate grasps compared."""
        return self.counts.candidates

    def __repr__(self) -> str:
        where = np.array2string(self.params, precision=6, separator=", ", max_line_width=10_000)
        blocks = f", {len(self.blocks)} blocks" if len(self.blocks) > 1 else ""
        early = "" if self.stopped == "tolerance" else f", stopped by {self.stopped}"
        return (
            f"Plan(params={where}, rho_{self.criterion}={self.quality.rho:.6g}, "
            f"iterations={len(self.history) - 1}, candidates={self.num_candidates}{blocks}{early})"
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain Python numbers and lists, ready for JSON."""
        return {**Record.to_dict(self), "num_candidates": self.num_candidates}

    def plot(self, **options: Any) -> Figure:
        """Draw the search and its grasp: a figure that notebooks show and ``savefig`` writes.

        Needs the ``plot`` extra. Options are those of `graspforce.plotting.history_figure`: ``title``,
        ``outline``, ``mesh`` and ``curves``.
        """
        # matplotlib only where it is asked for.
        figure: Figure = import_module("graspforce.plotting").history_figure(self, **options)
        return figure

    def _repr_html_(self) -> str:
        header = ("iteration", "parameters", f"rho_{self.criterion}", "steps after")
        rows = (
            (str(k), vector(row.params), f"{row.rho:.6g}", vector(row.step))
            for k, row in enumerate(self.history)
        )
        title = f"Plan: {len(self.history) - 1} iterations, {self.num_candidates} candidates"
        return table(title, header, rows)
