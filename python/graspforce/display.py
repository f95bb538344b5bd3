"""How results read in a notebook, and the same as plain dictionaries.

The classes of the extension module call this; they are the public names.
"""

from __future__ import annotations

import dataclasses
import html
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from ._core import (
        ForceBatch,
        ForceDistributor,
        ForceSolution,
        Gradient,
        Grasp,
        MinkowskiSum,
        Quality,
        QualityBatch,
    )
    from .planning import Plan, PlanSet

__all__ = [
    "Record",
    "batch_dict",
    "batch_html",
    "distributor_dict",
    "forces_dict",
    "forces_html",
    "gradient_dict",
    "grasp_dict",
    "grasp_html",
    "minkowski_dict",
    "plan_dict",
    "plan_html",
    "plan_set_dict",
    "plan_set_html",
    "quality_dict",
    "quality_html",
    "solution_dict",
    "solution_html",
]

_CLOSURES = {1: "force", 0: "partial", -1: "none"}
_STATUSES = {0: "solved", 1: "infeasible", 2: "not finite", 3: "tolerance not met"}
_ROWS_SHOWN = 10


class Record:
    """A dataclass that can be written as JSON."""

    __slots__ = ()

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain Python numbers and lists, ready for JSON; None in place of NaN."""
        values = ((field.name, getattr(self, field.name)) for field in dataclasses.fields(self))  # type: ignore[arg-type] # of dataclasses alone
        return {name: _plain(value) for name, value in values}


def _plain(value: Any) -> Any:
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(name): _plain(item) for name, item in value.items()}
    return None if isinstance(value, float) and not np.isfinite(value) else value


# In the order of its constructor, which is how a grasp is pickled.
_CONTACTS = (
    "positions",
    "normals",
    "friction",
    "max_normal_force",
    "edges",
    "torsion",
    "tangents",
    "origin",
    "length_scale",
    "friction_margin",
    "extreme_forces",
)


def grasp_dict(grasp: Grasp) -> dict[str, Any]:
    """Everything a grasp is made of, by the names of its arguments, with its dimensions."""
    return {
        "wrench_dim": grasp.wrench_dim,
        "num_contacts": grasp.num_contacts,
        "force_dim": grasp.force_dim,
        "num_edges": grasp.num_edges.tolist(),
        **{name: _plain(value) for name, value in zip(_CONTACTS, grasp.__reduce__()[1], strict=True)},
    }


def quality_dict(quality: Quality) -> dict[str, Any]:
    """Everything a quality knows but its gradient."""
    return {
        "criterion": quality.criterion,
        "rho": quality.rho,
        "epsilon": quality.epsilon,
        "lower": quality.lower,
        "upper": quality.upper,
        "converged": quality.converged,
        "closure": quality.closure,
        "direction": quality.direction.tolist(),
        "wrench": quality.wrench.tolist(),
        "supports": quality.supports,
    }


def gradient_dict(gradient: Gradient) -> dict[str, Any]:
    """Both halves of a gradient, and whether it is one."""
    return {
        "positions": gradient.positions.tolist(),
        "normals": gradient.normals.tolist(),
        "spins": gradient.spins.tolist(),
        "unique": gradient.unique,
    }


def batch_dict(batch: QualityBatch) -> dict[str, Any]:
    """Columns of a batch; None where a row is no grasp."""
    numbers = {name: getattr(batch, name) for name in ("rho", "epsilon", "lower", "upper")}
    return {
        **{name: _known(column) for name, column in numbers.items()},
        "closure": batch.closure.tolist(),
        "status": batch.status.tolist(),
        "errors": dict(batch.errors),
    }


def minkowski_dict(points: MinkowskiSum) -> dict[str, Any]:
    """All points and the index arrays A and B."""
    return {
        name: getattr(points, name).tolist() for name in ("wrenches", "starts", "ends", "contacts", "edges")
    }


def solution_dict(solution: ForceSolution) -> dict[str, Any]:
    """Collect the forces of one wrench with their certificate; None for a margin that is not defined."""
    return {
        "sigma_max": solution.sigma_max,
        "sigma_sum": solution.sigma_sum,
        "within_limits": solution.within_limits,
        "gap": solution.gap,
        "pivots": solution.pivots,
        "unique": solution.unique,
        "fell_back": solution.fell_back,
        "dual": solution.dual.tolist(),
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
        "status": batch.status.tolist(),
    }


def distributor_dict(distributor: ForceDistributor) -> dict[str, Any]:
    """Collect what a distributor was made of."""
    bounds = distributor.min_normal
    return {
        "grasp": grasp_dict(distributor.grasp),
        "objective": distributor.objective,
        "method": distributor.method,
        "weight": distributor.weight,
        "min_normal": None if bounds is None else bounds.tolist(),
        "tol": distributor.tol,
    }


def plan_dict(plan: Plan) -> dict[str, Any]:
    """Where a plan ended, how good that is, and every iterate."""
    return {
        "criterion": plan.criterion,
        "params": plan.params.tolist(),
        "quality": quality_dict(plan.quality),
        "grasp": grasp_dict(plan.grasp),
        "num_candidates": plan.num_candidates,
        "counts": plan.counts.to_dict(),
        "blocks": _plain(plan.blocks),
        "stopped": plan.stopped,
        "history": [row.to_dict() for row in plan.history],
    }


def plan_set_dict(found: PlanSet) -> dict[str, Any]:
    """Show the grasps kept, best first, and where every search began and ended."""
    return {
        "plans": [plan_dict(plan) for plan in found.plans],
        "starts": found.starts.tolist(),
        "epsilon": _known(found.epsilon),
        "failures": {str(row): reason for row, reason in found.failures.items()},
        "stopped": found.stopped,
        "seconds": found.seconds,
    }


def grasp_html(grasp: Grasp) -> str:
    """One row for each contact."""
    header = ("contact", "position (m)", "normal", "friction", "limit (N)")
    columns = zip(grasp.positions, grasp.normals, grasp.friction, grasp.max_normal_force, strict=True)
    rows = (
        (str(i), _vector(r), _vector(n), f"{mu:g}", f"{limit:g}")
        for i, (r, n, mu, limit) in enumerate(columns)
    )
    return _table(repr(grasp), header, rows)


def solution_html(solution: ForceSolution) -> str:
    """One row for each contact."""
    names = {2: "[n, t]", 3: "[n, o, t]", 4: "[n, o, t, torsion]"}[solution.grasp.force_dim]
    columns = zip(solution.forces, solution.shares, solution.slip_margin, strict=True)
    rows = (
        (str(i), _vector(force), f"{share:.4f}", f"{margin:.4f}")
        for i, (force, share, margin) in enumerate(columns)
    )
    header = ("contact", f"force {names} (N)", "share of limit", "slip margin")
    return _table(repr(solution), header, rows)


def forces_html(batch: ForceBatch) -> str:
    """Show the first rows of a batch."""
    rows = [
        (str(i), f"{largest:.6g}", f"{total:.6g}", _STATUSES[status])
        for i, (largest, total, status) in enumerate(
            zip(
                batch.sigma_max[:_ROWS_SHOWN].tolist(),
                batch.sigma_sum[:_ROWS_SHOWN].tolist(),
                batch.status[:_ROWS_SHOWN].tolist(),
                strict=True,
            )
        )
    ]
    if len(batch) > _ROWS_SHOWN:
        rows.append(("...", "", "", f"{len(batch) - _ROWS_SHOWN} more"))
    return _table(repr(batch), ("row", "sigma_max", "sigma_sum", "status"), rows)


def quality_html(quality: Quality) -> str:
    """Numbers of a quality, one a row."""
    rows = [
        ("epsilon", f"{quality.epsilon:.9g}"),
        ("rho", f"{quality.rho:.9g}, proven within [{quality.lower:.9g}, {quality.upper:.9g}]"),
        ("closure", quality.closure),
        ("weakest along", _vector(quality.direction)),
        ("converged", "yes" if quality.converged else "no: the bound on the work was reached"),
    ]
    return _table(f"Quality, criterion {quality.criterion}", ("", ""), rows)


def batch_html(batch: QualityBatch) -> str:
    """Show the first rows of a batch."""
    errors = batch.errors
    rows = [
        (str(i), f"{epsilon:.6g}", _CLOSURES.get(closure, errors.get(i, "")))
        for i, (epsilon, closure) in enumerate(
            zip(batch.epsilon[:_ROWS_SHOWN].tolist(), batch.closure[:_ROWS_SHOWN].tolist(), strict=True)
        )
    ]
    if len(batch) > _ROWS_SHOWN:
        rows.append(("...", "", f"{len(batch) - _ROWS_SHOWN} more"))
    return _table(repr(batch), ("row", "epsilon", "closure"), rows)


def plan_html(plan: Plan) -> str:
    """One row for each iterate."""
    header = ("iteration", "parameters", f"rho_{plan.criterion}", "steps after")
    rows = (
        (str(k), _vector(row.params), f"{row.rho:.6g}", _vector(row.step))
        for k, row in enumerate(plan.history)
    )
    title = f"Plan: {len(plan.history) - 1} iterations, {plan.num_candidates} candidates"
    return _table(title, header, rows)


def plan_set_html(found: PlanSet) -> str:
    """One row for each grasp kept."""
    rows = (
        (str(k), f"{plan.quality.epsilon:.6g}", plan.quality.closure, _vector(plan.params))
        for k, plan in enumerate(found.plans, start=1)
    )
    return _table(repr(found), ("grasp", "epsilon", "closure", "parameters"), rows)


def _known(column: NDArray[np.float64]) -> list[float | None]:
    return [None if np.isnan(x) else x for x in column.tolist()]


def _vector(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{value + 0.0:.5g}" for value in values) + "]"


def _table(title: str, header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    def line(cells: tuple[str, ...], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    head = f"<thead>{line(header, 'th')}</thead>" if any(header) else ""
    body = "".join(line(row, "td") for row in rows)
    return f"<table><caption>{html.escape(title)}</caption>{head}<tbody>{body}</tbody></table>"
