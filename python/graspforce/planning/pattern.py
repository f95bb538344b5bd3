"""The moves of the pattern search: which variables move together, and which candidates that makes."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["Blocks", "choose_blocks", "pattern"]

Blocks = tuple[tuple[int, ...], ...]


def choose_blocks(num_params: int, num_contacts: int, max_candidates: int) -> Blocks:
    """Group variables so that no group's pattern has more than `max_candidates` candidates.

    All variables at once where their 3^p candidates fit; else the variables of each contact where parameters
    divide evenly among contacts; else as many neighbours as fit.

    Examples
    --------
    >>> from graspforce.planning.pattern import choose_blocks
    >>> choose_blocks(4, 4, 729)
    ((0, 1, 2, 3),)
    >>> choose_blocks(8, 4, 729)
    ((0, 1), (2, 3), (4, 5), (6, 7))
    """
    if 3**num_params <= max_candidates:
        return (tuple(range(num_params)),)
    size, left_over = divmod(num_params, num_contacts)
    if left_over or 3**size > max_candidates:
        size = 1
        while 3 ** (size + 1) <= max_candidates:
            size += 1
    return tuple(tuple(range(start, min(start + size, num_params))) for start in range(0, num_params, size))


def pattern(
    center: Array, steps: Array, lower: Array, upper: Array, block: tuple[int, ...]
) -> tuple[Array, int]:
    """All candidates (B, p) that move the block, last variable fastest, and which of them is the centre."""
    moving = list(block)
    here = center[moving]
    down = np.maximum(lower[moving], here - steps[moving])
    up = np.minimum(upper[moving], here + steps[moving])
    # At a bound, or where a step is lost to rounding, two offsets coincide and one candidate is enough.
    axes = [sorted(set(values)) for values in zip(down.tolist(), here.tolist(), up.tolist(), strict=True)]
    moves = np.array(list(itertools.product(*axes)))
    candidates = np.tile(center, (len(moves), 1))
    candidates[:, moving] = moves
    at = 0
    for axis, value in zip(axes, here.tolist(), strict=True):
        at = at * len(axis) + axis.index(value)
    return candidates, at
