"""Coupled joints: all joints q (n,) follow the driven ones z (k,) by q = C z + c."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_array, finite_vector, known_options, real_number
from graspforce.errors import InvalidInputError

from .hand_model import named

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def coupling_matrix(
    joints: Sequence[str], relations: Sequence[tuple[str, str, float, float]], given: Any
) -> tuple[Array, Array]:
    """Return C (n, k) and c (n,) as given, or else from the relations that the model states.

    `given` is a matrix (n, k), a pair of matrix and offset, or a mapping from each dependent joint to
    ``{"joint": driver, "ratio": r, "offset": o}`` in rad.
    """
    if given is None:
        return _from_relations(joints, relations)
    if isinstance(given, Mapping):
        found = []
        for name, fields in given.items():
            named("coupling", name, joints, "joint")
            if not isinstance(fields, Mapping) or "joint" not in fields:
                raise InvalidInputError(
                    f"coupling, {name}: {fields!r}, expected fields joint, ratio and offset"
                )
            known_options(fields, ("joint", "ratio", "offset"))
            named(f"coupling, {name}", fields["joint"], joints, "joint")
            ratio = real_number(f"coupling, {name}: ratio", fields.get("ratio", 1.0))
            shift = real_number(f"coupling, {name}: offset", fields.get("offset", 0.0))
            found.append((name, fields["joint"], ratio, shift))
        return _from_relations(joints, found)
    matrix, offset = given if isinstance(given, tuple) and len(given) == 2 else (given, np.zeros(len(joints)))
    C = finite_array("coupling", matrix)
    if C.ndim != 2 or len(C) != len(joints) or not 1 <= C.shape[1] <= len(joints):
        raise InvalidInputError(
            f"coupling: shape {C.shape}, expected ({len(joints)}, k): a row for each joint"
        )
    c = finite_vector("coupling: offset", offset, len(joints))
    for row in np.flatnonzero((C != 0).sum(axis=1) != 1).tolist():
        raise InvalidInputError(
            f"coupling, row {row}: {joints[row]} must follow one driven joint, not {np.count_nonzero(C[row])}"
        )
    for column in range(C.shape[1]):
        if not ((np.eye(C.shape[1])[column] == C).all(axis=1) & (c == 0)).any():
            raise InvalidInputError(
                f"coupling, column {column}: no row is 1 there and 0 elsewhere: no joint is driven"
            )
    return C, c


def _from_relations(
    joints: Sequence[str], relations: Sequence[tuple[str, str, float, float]]
) -> tuple[Array, Array]:
    index = {name: j for j, name in enumerate(joints)}
    follows: dict[int, tuple[int, float, float]] = {}
    for name, driver, ratio, offset in relations:
        if index[name] in follows:
            raise InvalidInputError(
                f"coupling: {name!r} follows two joints, {driver!r} among them; give the coupling"
            )
        follows[index[name]] = (index[driver], ratio, offset)
    driven = [j for j in range(len(joints)) if j not in follows]
    C, c = np.zeros((len(joints), len(driven))), np.zeros(len(joints))
    for j in range(len(joints)):
        at, ratio, offset = j, 1.0, 0.0
        for _ in range(len(joints)):
            if at not in follows:
                break
            at, own, shift = follows[at]
            ratio, offset = ratio * own, offset + (ratio * shift)
        else:
            raise InvalidInputError(f"coupling: {joints[j]!r} follows itself")
        C[j, driven.index(at)], c[j] = ratio, offset
    return C, c


def driven_limits(joints: Sequence[str], limits: Array, C: Array, c: Array) -> Array:
    """(k, 2) limits in rad of the driven joints, within which all joints are within theirs (n, 2)."""
    low, high = np.full(C.shape[1], -np.inf), np.full(C.shape[1], np.inf)
    for j, k in np.argwhere(C).tolist():
        ends = np.sort((limits[j] - c[j]) / C[j, k])
        low[k], high[k] = max(low[k], ends[0]), min(high[k], ends[1])
    for k in np.flatnonzero(low > high).tolist():
        names = ", ".join(joints[j] for j in np.flatnonzero(C[:, k]).tolist())
        raise InvalidInputError(f"coupling: no position keeps {names} within their limits")
    return np.stack([low, high], axis=1)
