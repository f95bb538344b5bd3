"""The columns of least friction and of closure under placement noise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import least_friction_many
from graspforce.uncertainty.clopper_pearson import binomial_interval
from graspforce.uncertainty.closure_probability import closure_counts

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .options import GradeOptions

__all__ = ["add_uncertainty"]


def add_uncertainty(
    columns: dict[str, NDArray[np.float64]],
    rows: NDArray[np.int64],
    arguments: dict[str, Any],
    valid: NDArray[np.bool_],
    options: GradeOptions,
    messages: dict[int, str],
) -> None:
    """Fill in the columns that were asked for, in the valid rows among equally large grasps.

    A row without an answer keeps NaN and gets the reason as its message.
    """
    rows, count = rows[valid], len(valid)
    given = {name: _rows(value, valid, count) for name, value in arguments.items() if name != "rtol"}
    if options.least_friction and len(rows):
        lower, upper, errors = least_friction_many(**given)
        columns["least_friction"][rows], columns["least_friction_lower"][rows] = upper, lower
        for at, reason in errors.items():
            messages.setdefault(int(rows[at]), f"least_friction: {reason}")
    if options.noise is not None and len(rows):
        positions, normals = given.pop("positions"), given.pop("normals")
        closed, reasons = closure_counts(positions, normals, options.noise, options.friction_std, given)
        samples = options.noise.samples
        # Grasps with equally many closed samples share their interval.
        counts, which = np.unique(closed, return_inverse=True)
        ends = np.array([binomial_interval(int(k), samples, options.confidence) for k in counts])[which]
        columns["closure_probability"][rows] = closed / samples
        columns["closure_probability_lower"][rows] = ends[:, 0]
        columns["closure_probability_upper"][rows] = ends[:, 1]
        for at, reason in reasons.items():
            messages.setdefault(int(rows[at]), f"closure_probability: {reason}")
            for name in ("", "_lower", "_upper"):
                columns[f"closure_probability{name}"][rows[at]] = np.nan


def _rows(value: Any, valid: NDArray[np.bool_], count: int) -> Any:
    """Take the valid rows of what has a row for each grasp."""
    return value[valid] if isinstance(value, np.ndarray) and value.ndim and len(value) == count else value
