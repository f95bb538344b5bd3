"""Derivatives of epsilon of many grasps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.restored import expect, expect_array, expect_instance
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["GradientBatch"]


@dataclass(frozen=True, slots=True, eq=False)
class GradientBatch(Record):
    """How epsilon changes with the contacts of many grasps: the gradients of `QualityBatch.gradient`.

    Rows are those of the batch. A ragged batch has one axis (N,) over its contacts in place of (B, m).
    Rows with the status 2 are NaN; all other rows are finite.

    - A closed grasp (``epsilon > 0``) has the gradient at its worst direction.
    - An open grasp (``epsilon < 0``) has the gradient of minus the distance between the origin and the
      nearest wrench. It leads towards closure.
    - At partial closure (``epsilon == 0``), and where rounding leaves the closure undecided, there is a kink.
      ``unique`` is False; the entries belong to one direction along which the grasp exerts no wrench.
    - A row with the status 3 has the gradient at the worst direction that was found.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    positions : numpy.ndarray
        (B, m, dim) change of epsilon by m of displacement of each contact.
    normals : numpy.ndarray
        (B, m, dim) change of epsilon by rad that each normal turns, orthogonal to it; the contact frame turns
        with it by the smallest rotation.
    spins : numpy.ndarray
        (B, m) change of epsilon by rad that each contact frame spins about its normal.
    friction : numpy.ndarray
        (B, m) change of epsilon by each friction coefficient; to the right where that is zero.
    max_normal_force : numpy.ndarray
        (B, m) change of epsilon by N of each limit.
    unique : numpy.ndarray
        (B,) bool: True where epsilon is differentiable, as `Gradient.unique`. Elsewhere the row is one
        element of the subdifferential.

    Examples
    --------
    >>> import graspforce as gf
    >>> positions = [[(-1, 0.1), (1, 0)], [(-1, 0), (1, 0)]]
    >>> normals = [[(1, 0), (-1, 0)]] * 2
    >>> gradient = gf.quality_many(positions, normals, gradient=True).gradient
    >>> bool(gradient.positions[0, 0, 1] < 0)  # lowering the first finger is better
    True
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    spins: NDArray[np.float64]
    friction: NDArray[np.float64]
    max_normal_force: NDArray[np.float64]
    unique: NDArray[np.bool_]

    def __repr__(self) -> str:
        """Say how many rows there are, and how many of them have one gradient alone."""
        return f"GradientBatch({len(self)} grasps, {int(self.unique.sum())} unique)"

    def __len__(self) -> int:
        """Return the number of grasps."""
        return len(self.unique)

    def _check(self) -> None:
        expect_array("unique", self.unique, (None,), kind=np.bool_)
        expect_array("positions", self.positions, (None,) * np.ndim(self.positions), finite=False)
        leading, dim = self.positions.shape[:-1], self.positions.shape[-1:]
        ragged = len(leading) == 1
        expect(dim in ((2,), (3,)), "positions", "two or three columns")
        expect(ragged or leading[:1] == self.unique.shape, "positions", "a row for each grasp")
        expect(len(leading) in (1, 2), "positions", "the shape (B, m, dim) or (N, dim)")
        expect_array("normals", self.normals, leading + dim, finite=False)
        for name in ("spins", "friction", "max_normal_force"):
            expect_array(name, getattr(self, name), leading, finite=False)

    @staticmethod
    def _check_rows(gradient: GradientBatch, known: Sequence[bool]) -> None:
        """Refuse what does not belong to a batch in which these rows are grasps."""
        expect_instance("gradient", gradient, GradientBatch)
        gradient._check()
        expect(len(gradient) == len(known), "gradient", f"{len(known)} rows")
        invalid = ~np.asarray(known, dtype=bool)
        expect(not gradient.unique[invalid].any(), "unique", "False where the status is 2")
        if gradient.positions.ndim == 3:
            for name in ("positions", "normals", "spins", "friction", "max_normal_force"):
                array = getattr(gradient, name)
                finite = np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
                expect(bool((finite == known).all()), name, "finite numbers, and NaN where the status is 2")
