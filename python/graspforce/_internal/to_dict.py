"""Results as plain dictionaries, ready for JSON.

The classes of the extension module call these functions.
"""

from __future__ import annotations

import dataclasses
import os
import reprlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import unwarned_grasp
from graspforce._internal.restored import expect
from graspforce._internal.vectors import read_only
from graspforce.errors import InvalidGraspError
from graspforce.typing import GRASP_ARGUMENTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce._core import (
        ForceBatch,
        ForceDistributor,
        ForceSolution,
        Gradient,
        Grasp,
        MinkowskiSum,
        Quality,
        QualityBatch,
    )


class ReadOnly:
    """A frozen dataclass whose arrays and dictionaries are read-only, also after a copy."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # type: ignore[arg-type] # of dataclasses alone
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                object.__setattr__(self, field.name, read_only(value))
            elif isinstance(value, dict):
                object.__setattr__(self, field.name, MappingProxyType(value))

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        names = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type] # of dataclasses alone
        values = {name: getattr(self, name) for name in names}
        return _made, (
            type(self),
            {name: dict(v) if isinstance(v, MappingProxyType) else v for name, v in values.items()},
        )


class Record(ReadOnly):
    """A frozen dataclass, read-only also after a copy, that can be written as JSON."""

    __slots__ = ()

    def _check(self) -> None:
        """Refuse fields of a pickle that do not belong together."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain Python numbers and lists, ready for JSON; None in place of NaN."""
        values = ((field.name, getattr(self, field.name)) for field in dataclasses.fields(self))  # type: ignore[arg-type] # of dataclasses alone
        return {name: _plain(value) for name, value in values}


def _made(kind: Any, fields: Any) -> ReadOnly:
    expect(isinstance(kind, type) and issubclass(kind, ReadOnly), "class", "one of results")
    expect(isinstance(fields, dict), "fields", "a dictionary")
    record: ReadOnly = kind(**fields)
    if isinstance(record, Record):
        record._check()  # noqa: SLF001
    return record


def _plain(value: Any) -> Any:
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict | MappingProxyType):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return None if isinstance(value, float) and not np.isfinite(value) else value


_DIMENSIONS = ("wrench_dim", "num_contacts", "force_dim", "num_edges")


def grasp_dict(grasp: Grasp) -> dict[str, Any]:
    """Everything a grasp is made of, by the names of its arguments, with its dimensions."""
    return {
        **{name: _plain(getattr(grasp, name)) for name in _DIMENSIONS},
        **{name: _plain(value) for name, value in grasp._arguments().items()},  # noqa: SLF001
    }


def grasp_of(given: Mapping[str, Any]) -> Grasp:
    """Build the grasp whose dictionary this is; `Grasp.from_dict` calls this."""
    if not isinstance(given, Mapping):
        raise InvalidGraspError(f"given: {reprlib.repr(given)} is not the dictionary of a grasp")
    for name in given:
        if name not in GRASP_ARGUMENTS and name not in _DIMENSIONS:
            raise InvalidGraspError(f"{name}: no argument of a grasp; known are {', '.join(GRASP_ARGUMENTS)}")
    for name in GRASP_ARGUMENTS[:2]:
        if name not in given:
            raise InvalidGraspError(f"{name}: missing")
    grasp = unwarned_grasp(**{name: given[name] for name in GRASP_ARGUMENTS if name in given})
    known = grasp_dict(grasp)
    for name in _DIMENSIONS:
        if name in given and not np.array_equal(given[name], known[name]):
            raise InvalidGraspError(f"{name}: {given[name]}, but the contacts make it {known[name]}")
    return grasp


_BRACKET = ("rho", "epsilon", "epsilon_lower", "epsilon_upper", "lower", "upper")


def quality_dict(quality: Quality) -> dict[str, Any]:
    """Everything a quality knows but its gradient."""
    return {
        **_listed(quality, "criterion", "external_wrench", "metric"),
        "length_scale": quality.grasp.length_scale if quality.metric is None else None,
        **_listed(quality, "rtol", "max_facets", *_BRACKET),
        **_listed(quality, "converged", "closure", "direction", "wrench", "supports", "hint"),
    }


def gradient_dict(gradient: Gradient) -> dict[str, Any]:
    """Both halves of a gradient, and whether it is one."""
    return _listed(gradient, "positions", "normals", "spins", "friction", "max_normal_force", "unique")


def batch_dict(batch: QualityBatch) -> dict[str, Any]:
    """Columns of a batch; None where a row is no grasp."""
    return {
        **{name: _known(getattr(batch, name)) for name in _BRACKET},
        **_listed(batch, "closure", "status", "errors"),
        "gradient": _plain(batch.gradient),
        "bundle": _plain(batch.bundle),
    }


def minkowski_dict(points: MinkowskiSum) -> dict[str, Any]:
    """All points and the index arrays A and B."""
    return _listed(points, "wrenches", "starts", "ends", "contacts", "edges")


_SOLUTION = (
    "external_wrench", "objective", "weight", "rtol", "value", "sigma_max", "sigma_sum", "max_normal_force",
    "balanced", "within_limits", "gap", "pivots", "unique", "fell_back", "dual", "residual", "distance",
    "shares", "forces", "world_forces", "contact_wrenches",
)  # fmt: skip


def solution_dict(solution: ForceSolution) -> dict[str, Any]:
    """Collect the forces of one wrench with their certificate; None for a margin that is not defined."""
    return {**_listed(solution, *_SOLUTION), "slip_margin": _known(solution.slip_margin)}


def forces_dict(batch: ForceBatch) -> dict[str, Any]:
    """Rows of a batch; None in place of what has no answer."""

    def solved(rows: NDArray[np.float64]) -> list[Any]:
        pairs = zip(rows.tolist(), np.isfinite(batch.sigma_max), strict=True)
        return [row if answered else None for row, answered in pairs]

    return {
        "forces": solved(batch.forces),
        "sigma_max": _known(batch.sigma_max),
        "sigma_sum": _known(batch.sigma_sum),
        "residual": solved(batch.residual),
        "balanced": batch.balanced.tolist(),
        "distance": _known(batch.distance),
        "gap": _known(batch.gap),
        "status": batch.status.tolist(),
    }


def distributor_dict(distributor: ForceDistributor) -> dict[str, Any]:
    """Collect what a distributor was made of."""
    return {
        "grasp": grasp_dict(distributor.grasp),
        **_listed(distributor, "objective", "method", "weight", "min_normal", "samples", "reference"),
        **_listed(distributor, "weights", "slack", "limits", "max_normal_force", "rtol"),
    }


def _listed(of: object, *names: str) -> dict[str, Any]:
    """Attributes by name, arrays as lists."""
    values = {name: getattr(of, name) for name in names}
    return {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _known(column: NDArray[np.float64]) -> list[float | None]:
    return [None if np.isnan(x) else x for x in column.tolist()]
