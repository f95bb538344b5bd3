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

__all__ = [
    "ReadOnly",
    "Record",
    "batch_dict",
    "distributor_dict",
    "forces_dict",
    "gradient_dict",
    "grasp_dict",
    "grasp_of",
    "minkowski_dict",
    "quality_dict",
    "solution_dict",
]


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


def quality_dict(quality: Quality) -> dict[str, Any]:
    """Everything a quality knows but its gradient."""
    return {
        "criterion": quality.criterion,
        "external_wrench": _plain(quality.external_wrench),
        "metric": _plain(quality.metric),
        "length_scale": quality.grasp.length_scale if quality.metric is None else None,
        "rtol": quality.rtol,
        "max_facets": quality.max_facets,
        "rho": quality.rho,
        "epsilon": quality.epsilon,
        "epsilon_lower": quality.epsilon_lower,
        "epsilon_upper": quality.epsilon_upper,
        "lower": quality.lower,
        "upper": quality.upper,
        "converged": quality.converged,
        "closure": quality.closure,
        "direction": quality.direction.tolist(),
        "wrench": quality.wrench.tolist(),
        "supports": quality.supports,
        "hint": quality.hint,
    }


def gradient_dict(gradient: Gradient) -> dict[str, Any]:
    """Both halves of a gradient, and whether it is one."""
    return {
        "positions": gradient.positions.tolist(),
        "normals": gradient.normals.tolist(),
        "spins": gradient.spins.tolist(),
        "friction": gradient.friction.tolist(),
        "max_normal_force": gradient.max_normal_force.tolist(),
        "unique": gradient.unique,
    }


_BATCH_NUMBERS = ("rho", "epsilon", "epsilon_lower", "epsilon_upper", "lower", "upper")


def batch_dict(batch: QualityBatch) -> dict[str, Any]:
    """Columns of a batch; None where a row is no grasp."""
    numbers = {name: getattr(batch, name) for name in _BATCH_NUMBERS}
    return {
        **{name: _known(column) for name, column in numbers.items()},
        "closure": batch.closure.tolist(),
        "status": batch.status.tolist(),
        "errors": dict(batch.errors),
        "gradient": _plain(batch.gradient),
        "bundle": _plain(batch.bundle),
    }


def minkowski_dict(points: MinkowskiSum) -> dict[str, Any]:
    """All points and the index arrays A and B."""
    return {
        name: getattr(points, name).tolist() for name in ("wrenches", "starts", "ends", "contacts", "edges")
    }


def solution_dict(solution: ForceSolution) -> dict[str, Any]:
    """Collect the forces of one wrench with their certificate; None for a margin that is not defined."""
    return {
        "external_wrench": solution.external_wrench.tolist(),
        "objective": solution.objective,
        "weight": solution.weight,
        "rtol": solution.rtol,
        "value": solution.value,
        "sigma_max": solution.sigma_max,
        "sigma_sum": solution.sigma_sum,
        "max_normal_force": solution.max_normal_force.tolist(),
        "balanced": solution.balanced,
        "within_limits": solution.within_limits,
        "gap": solution.gap,
        "pivots": solution.pivots,
        "unique": solution.unique,
        "fell_back": solution.fell_back,
        "dual": solution.dual.tolist(),
        "residual": solution.residual.tolist(),
        "distance": solution.distance,
        "shares": solution.shares.tolist(),
        "forces": solution.forces.tolist(),
        "world_forces": solution.world_forces.tolist(),
        "contact_wrenches": solution.contact_wrenches.tolist(),
        "slip_margin": _known(solution.slip_margin),
    }


def forces_dict(batch: ForceBatch) -> dict[str, Any]:
    """Rows of a batch; None in place of what has no answer."""
    solved = batch.status == 0
    return {
        "forces": [row if good else None for row, good in zip(batch.forces.tolist(), solved, strict=True)],
        "sigma_max": _known(batch.sigma_max),
        "sigma_sum": _known(batch.sigma_sum),
        "residual": [
            row if good else None for row, good in zip(batch.residual.tolist(), solved, strict=True)
        ],
        "balanced": batch.balanced.tolist(),
        "distance": _known(batch.distance),
        "status": batch.status.tolist(),
    }


def distributor_dict(distributor: ForceDistributor) -> dict[str, Any]:
    """Collect what a distributor was made of."""
    optional = {
        "min_normal": distributor.min_normal,
        "samples": distributor.samples,
        "reference": distributor.reference,
        "weights": distributor.weights,
        "slack": distributor.slack,
    }
    return {
        "grasp": grasp_dict(distributor.grasp),
        "objective": distributor.objective,
        "method": distributor.method,
        "weight": distributor.weight,
        **{name: _plain(value) for name, value in optional.items()},
        "limits": distributor.limits,
        "max_normal_force": distributor.max_normal_force.tolist(),
        "rtol": distributor.rtol,
    }


def _known(column: NDArray[np.float64]) -> list[float | None]:
    return [None if np.isnan(x) else x for x in column.tolist()]
