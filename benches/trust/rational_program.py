"""Linear programs in exact rational arithmetic: the simplex method in two phases, by Bland's rule."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

__all__ = ["largest"]


def largest(costs: np.ndarray, matrix: np.ndarray, right: np.ndarray) -> Fraction | float:
    """Return the largest ``costs @ x`` over ``matrix @ x == right`` and ``x >= 0``, all floats taken exactly.

    It is infinite without bound, and minus infinite if no x exists.
    """
    size = len(costs)
    rows = []
    for coefficients, value in zip(matrix.tolist(), right.tolist(), strict=True):
        sign = -1 if value < 0 else 1
        rows.append([*(sign * Fraction(x) for x in coefficients), sign * Fraction(value)])
    # The artificial variable of each row, numbered after the others, never comes back: it has no column.
    basis = [size + row for row in range(len(rows))]
    missing = [-sum(column) for column in zip(*rows, strict=True)]
    _pivots(rows, basis, missing)
    if missing[-1] != 0:
        return -np.inf
    for row, of in enumerate(basis):
        entering = next((k for k in range(size) if rows[row][k] != 0), None)
        if of >= size and entering is not None:
            _exchange(rows, basis, [], row, entering)
    reduced = [*(-Fraction(x) for x in costs.tolist()), Fraction(0)]
    for row, of in enumerate(basis):
        if of < size and reduced[of] != 0:
            factor = reduced[of]
            reduced = [a - factor * b for a, b in zip(reduced, rows[row], strict=True)]
    return reduced[-1] if _pivots(rows, basis, reduced) else np.inf


def _pivots(rows: list[list[Fraction]], basis: list[int], reduced: list[Fraction]) -> bool:
    """Exchange variables until no reduced cost is negative; False without bound."""
    while True:
        entering = next((k for k, cost in enumerate(reduced[:-1]) if cost < 0), None)
        if entering is None:
            return True
        ratios = [(row[-1] / row[entering], basis[k], k) for k, row in enumerate(rows) if row[entering] > 0]
        if not ratios:
            return False
        _exchange(rows, basis, [reduced], min(ratios)[2], entering)


def _exchange(
    rows: list[list[Fraction]], basis: list[int], others: list[list[Fraction]], leaving: int, entering: int
) -> None:
    pivot = rows[leaving][entering]
    rows[leaving] = [x / pivot for x in rows[leaving]]
    basis[leaving] = entering
    for row in [*rows[:leaving], *rows[leaving + 1 :], *others]:
        if row[entering] != 0:
            factor = row[entering]
            row[:] = [a - factor * b for a, b in zip(row, rows[leaving], strict=True)]
