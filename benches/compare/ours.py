"""Calls of this library, which the peers are measured against."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import graspforce as gf

from .timing import Call

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .problems import Contacts


def grasp_of(contacts: Contacts) -> gf.Grasp:
    return contacts.grasp


def quality_calls(criterion: str, options: dict[str, Any] | None = None) -> list[Call]:
    """``options`` are those of the grasps, where a batch can share them."""

    def one() -> Callable[[gf.Grasp], float]:
        return lambda grasp: grasp.quality(criterion).epsilon

    def many() -> Callable[[Sequence[Contacts]], np.ndarray]:
        def ask(batch: Sequence[Contacts]) -> np.ndarray:
            positions, normals = (np.stack([getattr(c, x) for c in batch]) for x in ("positions", "normals"))
            return gf.quality_many(positions, normals, **options, criterion=criterion).epsilon

        return ask

    calls = [Call("quality", "graspforce", one, 1e-9, grasp_of, reference=True)]
    if options is not None:
        calls.append(Call("quality_many, a grasp", "graspforce", many, 1e-9, whole=True))
    return calls


def closure_calls() -> list[Call]:
    def build_and_ask(contacts: Contacts) -> bool:
        return gf.Grasp(contacts.positions, contacts.normals, **contacts.options).is_force_closure

    return [
        Call("is_force_closure", "graspforce", lambda: lambda grasp: grasp.is_force_closure, 0, grasp_of,
             reference=True),
        Call("Grasp(...).is_force_closure", "graspforce", lambda: build_and_ask, 0),
    ]  # fmt: skip


def force_calls(grasp: gf.Grasp, tol: float) -> list[Call]:
    """Every call keeps a distributor of its own, as every peer keeps its own state."""

    def into() -> Callable[[np.ndarray], float]:
        distributor = gf.ForceDistributor(grasp, "max", rtol=tol)
        forces = np.empty((grasp.num_contacts, grasp.force_dim))
        return lambda external: distributor.solve_into(external, forces)

    def one() -> Callable[[np.ndarray], float]:
        distributor = gf.ForceDistributor(grasp, "max", rtol=tol)
        return lambda external: distributor.solve(external).sigma_max

    def many() -> Callable[[Sequence[np.ndarray]], np.ndarray]:
        distributor = gf.ForceDistributor(grasp, "max", rtol=tol)
        return lambda batch: distributor.solve_many(np.array(batch)).sigma_max

    agreement = 10 * tol
    return [
        Call("solve_into", "graspforce", into, agreement, reference=True),
        Call("solve", "graspforce", one, agreement, reference=True),
        Call("solve_many, a row", "graspforce", many, agreement, whole=True),
    ]


def squares_calls(grasp: gf.Grasp, *, nearest: bool) -> list[Call]:
    """Least squares of the forces, or the distance of the nearest wrench within the limits."""

    def made() -> gf.ForceDistributor:
        return gf.ForceDistributor(grasp, "squares", limits=nearest)

    def into() -> Callable[[np.ndarray], float]:
        distributor, forces = made(), np.empty((grasp.num_contacts, grasp.force_dim))
        ask = distributor.nearest_into if nearest else distributor.solve_into
        return lambda external: ask(external, forces)

    def one() -> Callable[[np.ndarray], float]:
        distributor = made()
        if nearest:
            return lambda external: distributor.nearest(external).distance

        def ask(external: np.ndarray) -> float:
            forces = distributor.solve(external).forces.ravel()
            return float(forces @ forces / 2)

        return ask

    name = "nearest" if nearest else "solve"
    return [
        Call(f"{name}_into", "graspforce", into, 1e-9, reference=True),
        Call(name, "graspforce", one, 1e-9, reference=True),
    ]


def least_sum(grasp: gf.Grasp, external: np.ndarray) -> float:
    """Ask a new distributor each time: nothing is kept."""
    try:
        return gf.ForceDistributor(grasp, "sum").solve(external).sigma_sum
    except gf.InfeasibleWrenchError:
        return np.inf


def least_sum_calls(external: np.ndarray) -> list[Call]:
    def make() -> Callable[[gf.Grasp], float]:
        return lambda grasp: least_sum(grasp, external)

    return [Call("ForceDistributor(...).solve", "graspforce", make, 1e-9, grasp_of, reference=True)]


def held_calls(external: np.ndarray) -> list[Call]:
    def make() -> Callable[[gf.Grasp], bool]:
        return lambda grasp: least_sum(grasp, external) < np.inf

    return [Call("ForceDistributor(...).solve", "graspforce", make, 0, grasp_of, reference=True)]
