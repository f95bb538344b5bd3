"""Values of joints: those of the model, and those that a caller gives for all joints or by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_vector, real_number
from graspforce.errors import InvalidInputError

from .hand_model import named

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def joint_numbers(
    argument: str,
    given: Any,
    joints: Sequence[str],
    known: Sequence[float],
    *,
    positive: bool = False,
    least: float = -np.inf,
) -> Array:
    """(n,) the known values, replaced by one number for all joints or by a mapping from joints to numbers."""
    values = np.array(known, dtype=np.float64)
    if isinstance(given, Mapping):
        for name, value in given.items():
            at = named(argument, name, joints, "joint")
            values[at] = real_number(f"{argument}, {name}", value, positive=positive, least=least)
    elif given is not None:
        values[:] = real_number(argument, given, positive=positive, least=least)
    # What the model itself states is checked, too.
    bad = [int(j) for j in np.flatnonzero(values <= 0)] if positive else []
    if bad:
        listed = ", ".join(joints[j] for j in bad)
        raise InvalidInputError(f"{argument}: {values[bad[0]]:g} for {listed}; they must be positive")
    return values


def joint_limits(
    joints: Sequence[str], known: Sequence[tuple[float, float] | None], given: Mapping[str, Any] | None
) -> Array:
    """(n, 2) limits in rad; every joint must have some."""
    limits = np.array([(np.nan, np.nan) if pair is None else pair for pair in known], dtype=np.float64)
    if given is not None and not isinstance(given, Mapping):
        raise InvalidInputError(f"joint_limits: {given!r}, expected a mapping from joints to (lower, upper)")
    for name, pair in (given or {}).items():
        at = named("joint_limits", name, joints, "joint")
        limits[at] = finite_vector(f"joint_limits, {name}", pair, 2)
    missing = [joints[int(j)] for j in np.flatnonzero(np.isnan(limits).any(axis=1))]
    if missing:
        raise InvalidInputError(
            f"joint_limits: the model has none for {', '.join(missing)}; give them in rad"
        )
    for j in np.flatnonzero(limits[:, 0] >= limits[:, 1]).tolist():
        raise InvalidInputError(
            f"joint_limits, {joints[j]}: lower {limits[j, 0]} is not below upper {limits[j, 1]}"
        )
    return limits
