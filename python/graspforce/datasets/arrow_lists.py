"""Lists of Arrow columns as flat NumPy arrays, without a Python object for each row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Indices = NDArray[np.int64]
    Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Ragged:
    """Lists of different lengths as one array of values.

    Attributes
    ----------
    starts, lengths : numpy.ndarray
        Where each list begins in `values`, and how long it is: zero where it is null.
    null : numpy.ndarray
        True for lists that are null.
    values : pyarrow.Array
        The values of all lists, one list after another.
    """

    starts: Indices
    lengths: Indices
    null: Mask
    values: pa.Array

    @property
    def ends(self) -> Indices:
        """Where each list ends in `values`."""
        return self.starts + self.lengths


@dataclass(frozen=True, slots=True)
class Numbers:
    """Float64 values, and which of them are null."""

    values: NDArray[np.float64]
    null: Mask

    def at(self, indices: Indices) -> NDArray[np.float64]:
        """Take values into an array of the shape of the indices."""
        return np.take(self.values, indices)


def ragged(column: pa.Array) -> Ragged:
    """Lay out a column of lists; all are null where the column has no type."""
    count = len(column)
    null = _null(column)
    if pa.types.is_null(column.type):
        zeros = np.zeros(count, np.int64)
        return Ragged(zeros, zeros, null, column.slice(0, 0))
    if pa.types.is_fixed_size_list(column.type):
        size = column.type.list_size
        bounds = (column.offset + np.arange(count + 1, dtype=np.int64)) * size
    else:
        bounds = column.offsets.to_numpy().astype(np.int64)
    # A slice shares the values of the whole column; only its own part is converted.
    first, last = int(bounds[0]), int(bounds[-1])
    lengths = np.where(null, 0, np.diff(bounds))
    return Ragged(bounds[:-1] - first, lengths, null, column.values.slice(first, last - first))


def numbers(column: pa.Array) -> Numbers:
    """Convert a column of numbers to float64."""
    # As in NumPy, integers beyond 2^53 are rounded.
    values = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    return Numbers(values, _null(column))


def first_within(starts: Indices, ends: Indices, wrong: Mask) -> Indices:
    """Find for each stretch of `wrong` how far in its first true entry lies; -1 where there is none."""
    at = np.flatnonzero(wrong)
    found = np.full(len(starts), -1, np.int64)
    if len(at):
        following = np.searchsorted(at, starts)
        first = at[np.minimum(following, len(at) - 1)]
        inside = (following < len(at)) & (first < ends)
        found[inside] = (first - starts)[inside]
    return found


def _null(column: pa.Array) -> Mask:
    if column.null_count == 0:
        return np.zeros(len(column), bool)
    null: Mask = column.is_null().to_numpy(zero_copy_only=False)
    return null
