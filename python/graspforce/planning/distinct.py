"""Distinct grasps. Two grasps are the same if their contacts, once matched, nearly coincide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.optional_imports import optional

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from .candidates import CandidateSource
    from .plan_result import Plan


def default_distance(positions: NDArray[np.float64]) -> float:
    """Return a fiftieth of the distance in m that contacts (B, m, dim) range over."""
    places = positions.reshape(-1, positions.shape[-1])
    return float(np.linalg.norm(np.ptp(places, axis=0))) / 50


def distinct_plans(plans: Sequence[Plan], best: int, same: float, *, interchangeable: bool) -> list[Plan]:
    """Keep the first `best` of the plans, best first, that are further than `same` m from those before."""
    kept: list[Plan] = []
    for plan in plans:
        if all(_distance(plan, other, interchangeable) > same for other in kept):
            kept.append(plan)
        if len(kept) == best:
            break
    return kept


def interchangeable_contacts(source: CandidateSource) -> bool:
    """Whether contacts may be matched in any order: where nothing but their place tells them apart."""
    if source.gives_tangents:
        return False
    forces = source.options.get("extreme_forces")
    if forces is not None and any(not np.array_equal(other, forces[0]) for other in forces):
        return False
    values = [source.options.get(name) for name in ("friction", "max_normal_force", "torsion", "edges")]
    return all(value is None or np.ptp(np.asarray(value, dtype=float)) == 0 for value in values)


def _distance(one: Plan, other: Plan, interchangeable: bool) -> float:
    """Largest distance in m between matched contacts of two grasps."""
    apart = np.linalg.norm(one.grasp.positions[:, None] - other.grasp.positions[None], axis=-1)
    if not interchangeable:
        return float(np.diagonal(apart).max())
    assignment = optional("scipy.optimize", "search").linear_sum_assignment
    return float(apart[assignment(apart)].max())
