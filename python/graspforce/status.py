"""How one row of a batch ended."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["Status"]


class Status(IntEnum):
    """How one row of a batch ended, in ``ForceBatch.status`` and ``QualityBatch.status``.

    The arrays hold these numbers as int8, so that ``batch.status == Status.SOLVED`` compares row by row.
    Threads may share its members; they can be copied and pickled.

    Examples
    --------
    >>> import graspforce as gf
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    >>> batch = gf.ForceDistributor(grasp).solve_many([[0, -1, 0], [0, float("nan"), 0]])
    >>> [gf.Status(status).name for status in batch.status]
    ['SOLVED', 'INVALID']
    """

    SOLVED = 0
    """The row has its answer within the tolerance asked for."""

    INFEASIBLE = 1
    """No forces inside the friction cones balance this wrench, however strong they are; forces are NaN."""

    INVALID = 2
    """The row is not finite, too large or too small to compute with, or not a grasp; its numbers are NaN."""

    NOT_CONVERGED = 3
    """The tolerance was not met. Forces are NaN, but nearest ones stay, with a wider ``gap`` than asked for.
    A quality keeps its proven bracket, wider than asked for."""

    @property
    def success(self) -> bool:
        """Whether the row was solved."""
        return self is Status.SOLVED
