"""Derivatives of epsilon of many grasps, and of their supports along critical directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.restored import expect, expect_array, expect_instance
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["BundleBatch", "GradientBatch"]

_DERIVATIVES = ("positions", "normals", "spins", "friction", "max_normal_force")


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
            for name in _DERIVATIVES:
                array = getattr(gradient, name)
                finite = np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
                expect(bool((finite == known).all()), name, "finite numbers, and NaN where the status is 2")


@dataclass(frozen=True, slots=True, eq=False)
class BundleBatch(Record):
    """The most critical directions of many grasps, with their supports and gradients: `QualityBatch.bundle`.

    Epsilon is the least support ``p(z)`` over all unit directions ``z``. At a kink several directions are
    equally bad: along a change ``h`` of the contacts, the derivative of epsilon is the least of their
    ``gradient . h``, if those are unique. Directions that are nearly as bad tell where the next kink is.

    - A closed grasp has its worst direction, the other local minima of ``p(z)`` in their order, facets of
      the wrench set next to them, and the images of its worst direction where the grasp is symmetric. For
      true cones the order is that of ``p(z)`` to 1e-2, and the directions are at least 0.1 apart.
    - An open grasp, and one at partial closure, has its worst direction alone.
    - Row ``b`` has ``count[b]`` directions, at most ``k``; none where the status is 2. Entries behind them
      have infinite values, and zeros in all other arrays. No entry is NaN.

    Rows are those of the batch. A ragged batch has the axes (N, k) in place of (B, k, m).

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    directions : numpy.ndarray
        (B, k, d) wrenches of unit norm, as `Quality.direction`.
    values : numpy.ndarray
        (B, k) supports ``p(z)`` in N, least first: upper bounds of epsilon. The least is ``epsilon_upper`` to
        rounding.
    count : numpy.ndarray
        (B,) int64 numbers of directions.
    positions, normals : numpy.ndarray
        (B, k, m, dim) change of ``p(z)`` by m of displacement of each contact, and by rad that each normal
        turns, at fixed ``z``. Where ``p(z)`` has a kink itself, they are one element of its subdifferential:
        at a local minimum of ``p`` the gradient of the minimum.
    spins, friction, max_normal_force : numpy.ndarray
        (B, k, m) as in `GradientBatch`.
    unique : numpy.ndarray
        (B, k) bool: True where no other contact forces exert the same wrench. Where several do, ``p(z)`` may
        fall less along a change of the contacts than the gradient says.

    Examples
    --------
    Two fingers on a disc that are exactly opposite have four equally bad directions:

    >>> import graspforce as gf
    >>> batch = gf.quality_many([[(-1, 0), (1, 0)]], [[(1, 0), (-1, 0)]], bundle=8)
    >>> bool((batch.bundle.values[0, :4] < batch.epsilon[0] + 1e-9).all())
    True
    """

    directions: NDArray[np.float64]
    values: NDArray[np.float64]
    count: NDArray[np.int64]
    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    spins: NDArray[np.float64]
    friction: NDArray[np.float64]
    max_normal_force: NDArray[np.float64]
    unique: NDArray[np.bool_]

    def __repr__(self) -> str:
        """Say how many rows there are, and how many directions at most."""
        return f"BundleBatch({len(self)} grasps, {self.values.shape[1]} directions)"

    def __len__(self) -> int:
        """Return the number of grasps."""
        return len(self.count)

    def _check(self) -> None:
        expect_array("count", self.count, (None,), kind=np.int64)
        expect_array("values", self.values, (len(self), None), finite=False)
        size = self.values.shape[1]
        expect(bool(((self.count >= 0) & (self.count <= size)).all()), "count", f"0 to {size}")
        known = np.arange(size) < self.count[:, None]
        expect(bool((np.isfinite(self.values) == known).all()), "values", "infinity behind the count alone")
        expect(bool((self.values[~known] > 0).all()), "values", "no NaN")
        expect_array("unique", self.unique, (len(self), size), kind=np.bool_)
        expect_array("directions", self.directions, (len(self), size, None))
        expect_array("positions", self.positions, (None,) * np.ndim(self.positions))
        leading, dim = self.positions.shape[:-1], self.positions.shape[-1:]
        expect((dim, self.directions.shape[2]) in (((2,), 3), ((3,), 6)), "positions", "two or three columns")
        expect(len(leading) in (2, 3), "positions", "the shape (B, k, m, dim) or (N, k, dim)")
        rows = leading[:2] == self.values.shape if len(leading) == 3 else leading[1] == size
        expect(rows, "positions", "an entry for each direction")
        expect_array("normals", self.normals, leading + dim)
        for name in _DERIVATIVES[2:]:
            expect_array(name, getattr(self, name), leading)

    @staticmethod
    def _check_rows(bundle: BundleBatch, known: Sequence[bool]) -> None:
        """Refuse what does not belong to a batch in which these rows are grasps."""
        expect_instance("bundle", bundle, BundleBatch)
        bundle._check()
        expect(len(bundle) == len(known), "bundle", f"{len(known)} rows")
        expect(bool(((bundle.count > 0) == known).all()), "count", "0 where the status is 2 alone")
