"""Wrenches that take forces far greater than themselves: the feasibility tolerance where rounding matters.

Nearly parallel contacts, pinches with frictions down to 1e-9, contacts on a line but for noise, clusters
far from the origin, limits over twelve orders; wrenches that the contacts exert, pushed off by 1e-13 to
1e-6. Grasps in the plane and in space, linearised and true cones, every method, weights and lower bounds.

What an answer leaves over is computed in rational arithmetic. A witness has to hold for all forces whose
objective is at most 1e5 times the size of the wrench.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from benches.trust.judge import EDGE, LARGEST_OBJECTIVE, TOLERANCE, exact, left_over, reach_of_cones, units
from benches.trust.row import Row

import graspforce as gf
from graspforce._core import unwarned_grasp

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Case", "case", "rows", "verdict"]

CASES = 4_000
KINDS = ("implicit", "enumerated", "reduced", "weighted", "bounds", "cones", "cones and bounds")


@dataclass
class Case:
    """A grasp, a wrench with wrenches to be solved before it, and what is minimised."""

    grasp: gf.Grasp
    wrench: np.ndarray
    past: list[np.ndarray]
    objective: str
    method: str = "implicit"
    options: dict[str, Any] = field(default_factory=dict)


def unit(rng: np.random.Generator, dim: int) -> np.ndarray:
    """Draw a direction."""
    v = rng.standard_normal(dim)
    return v / np.linalg.norm(v)


def contacts(rng: np.random.Generator, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals that need large forces for some wrenches."""
    size, noise = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-12, -1)
    count = int(rng.integers(2, 6))
    kind = rng.integers(5)
    axis = unit(rng, dim) if rng.integers(2) else np.eye(dim)[0]
    if kind == 0:  # nearly parallel: opposite normals, all on a line but for noise
        signs = np.where(np.arange(count) % 2, -1.0, 1.0)[:, None]
        positions = -signs * axis * size + noise * size * rng.standard_normal((count, dim))
        normals = signs * axis + noise * rng.standard_normal((count, dim)) * rng.integers(2)
    elif kind == 1:  # feet and a finger from above
        positions = size * rng.standard_normal((count, dim))
        positions -= (positions @ axis)[:, None] * axis
        positions += noise * size * rng.standard_normal((count, dim)) * rng.integers(2)
        signs = np.where(np.arange(count) == 0, -1.0, 1.0)[:, None]
        normals = signs * axis + noise * rng.standard_normal((count, dim))
    elif kind == 2:  # a cluster far from the others, or from the origin
        positions = size * (rng.standard_normal(dim) / noise**0.3 + rng.standard_normal((count, dim)))
        normals = rng.standard_normal((count, dim))
    elif kind == 3:  # a wedge that opens by noise
        side = unit(rng, dim)
        side -= (side @ axis) * axis
        side /= np.linalg.norm(side)
        signs = np.where(np.arange(count) % 2, -1.0, 1.0)[:, None]
        positions = -signs * side * size + size * rng.standard_normal((count, 1)) * axis
        normals = signs * side + noise * axis
    else:
        positions = size * rng.standard_normal((count, dim))
        normals = -positions + 0.3 * size * rng.standard_normal((count, dim))
    return positions, normals / np.linalg.norm(normals, axis=1)[:, None]


def case(kind: str, seed: int) -> Case:
    """Make a case of a kind of `KINDS`."""
    rng = np.random.default_rng([11, KINDS.index(kind), seed])
    cones, listed = kind.startswith("cones"), kind in ("enumerated", "reduced")
    dim = 3 if cones or rng.integers(3) else 2
    positions, normals = contacts(rng, dim)
    count = len(positions)
    limits = [
        10 ** rng.uniform(-1, 2),
        10 ** rng.uniform(-6, 6, count),
        rng.choice([1e-6, 1.0], count),
    ][rng.integers(3)]
    options: dict[str, Any] = {}
    if dim == 3:
        options["edges"] = None if cones else int(rng.integers(3, 5 if listed else 9))
        if not listed and rng.integers(3) == 0:
            options["torsion"] = float(10 ** rng.uniform(-6, -1))
    friction = float(rng.choice([0.0, 0.3, 0.5, 1.0])) if rng.integers(2) else 10 ** rng.uniform(-9, -1)
    if cones and friction == 0.0:
        friction = 1e-3
    grasp = unwarned_grasp(positions, normals, friction=friction, max_normal_force=limits, **options)
    given: dict[str, Any] = {}
    if kind == "weighted":
        given["weight"] = float(10 ** rng.uniform(-3, 4))
    if kind.endswith("bounds"):
        given["min_normal"] = rng.choice([0.0, 0.1, 0.5], count)
        given["min_normal"][0] = 0.25
    objective = "max" if kind == "weighted" else str(rng.choice(["max", "sum"]))
    method = kind if listed else "implicit"
    past = [wrench(rng, grasp) for _ in range(3)]
    if method == "reduced":
        given["samples"] = -grasp.primitive_wrenches[:: max(1, len(grasp.primitive_wrenches) // 6)]
    return Case(grasp, wrench(rng, grasp), past, objective, method, given)


def wrench(rng: np.random.Generator, grasp: gf.Grasp) -> np.ndarray:
    """Draw what random forces exert, or nearly; or any wrench."""
    scale = units(grasp)
    forces = random_forces(rng, grasp)
    exerted = grasp.grasp_matrix @ forces.ravel()
    size = np.abs(exerted / scale).max()
    kind = rng.integers(6)
    if kind == 0 or size == 0.0:
        return scale * unit(rng, len(scale))
    if kind == 1:
        only = np.zeros(len(scale))
        only[rng.integers(len(scale))] = 1.0
        return scale * only * 10 ** rng.uniform(-3, 1)
    if kind == 2:
        return -exerted
    off = 10 ** rng.uniform(-13, -6) * size
    return -exerted + off * scale * unit(rng, len(scale))


def random_forces(rng: np.random.Generator, grasp: gf.Grasp) -> np.ndarray:
    """Return forces on the edges of friction cones, or inside them."""
    if grasp.num_edges.all():
        shares = rng.uniform(size=len(grasp.primitive_wrenches)) * (
            rng.uniform(size=len(grasp.primitive_wrenches)) < 0.3
        )
        forces = np.zeros((grasp.num_contacts, grasp.force_dim))
        owners = np.repeat(np.arange(grasp.num_contacts), grasp.num_edges)
        np.add.at(forces, owners, shares[:, None] * grasp.extreme_forces)
        return forces
    normal = (
        grasp.max_normal_force * rng.uniform(size=grasp.num_contacts) * rng.integers(0, 2, grasp.num_contacts)
    )
    forces = np.zeros((grasp.num_contacts, grasp.force_dim))
    forces[:, 0] = normal
    across = rng.standard_normal((grasp.num_contacts, 2))
    across /= np.linalg.norm(across, axis=1)[:, None]
    forces[:, 1:3] = across * (normal * grasp.friction)[:, None] * rng.choice([0.5, 1.0])
    return forces


def size_of(case: Case, scale) -> Fraction:
    """Compute the size of the wrench, or the largest force that lower bounds ask for, in units."""
    grasp = case.grasp
    strength = grasp.max_normal_force * np.hypot(1, grasp.friction)
    held = float(np.max(case.options.get("min_normal", 0.0) * strength)) / float(scale[0])
    return max([Fraction(held), *(abs(w) / s for w, s in zip(exact(case.wrench), exact(scale), strict=True))])


def reach_along(case: Case, e) -> Fraction:
    """How far forces of an objective of one reach along a direction, zero if they do not."""
    grasp, weight = case.grasp, Fraction(float(case.options.get("weight", 0.0)))
    if grasp.num_edges.all():
        groups = np.split(grasp.primitive_wrenches, np.cumsum(grasp.num_edges)[:-1])
        direction = exact(e)
        reach = [
            max(sum(a * b for a, b in zip(exact(w), direction, strict=True)) for w in each) for each in groups
        ]
    else:
        reach = [Fraction(float(x)) for x in reach_of_cones(grasp, e)]
    positive = [max(h, Fraction(0)) for h in reach]
    if case.objective == "sum":
        return max(positive)
    # p(z) <= 1 with a weight: sum_i max(0, h_i - weight t) = t.
    if not weight:
        return sum(positive)
    low, high = Fraction(0), sum(positive)
    for _ in range(60):
        middle = (low + high) / 2
        if sum(max(h - weight * middle, Fraction(0)) for h in positive) > middle:
            low = middle
        else:
            high = middle
    return high


def held_along(case: Case, e) -> Fraction:
    """How far the lower bounds alone reach along a direction."""
    bounds = case.options.get("min_normal")
    if bounds is None:
        return Fraction(0)
    grasp = case.grasp
    if grasp.num_edges.all():
        groups = np.split(grasp.primitive_wrenches, np.cumsum(grasp.num_edges)[:-1])
        reach = [max(float(w @ e) for w in each) for each in groups]
    else:
        reach = [float(x) for x in reach_of_cones(grasp, e)]
    return sum((Fraction(float(c)) * Fraction(h) for c, h in zip(bounds, reach, strict=True)), Fraction(0))


def inside(grasp, forces) -> bool:
    """Whether forces are in the true cones, up to 2e-9 of the largest force."""
    load = np.linalg.norm(forces[:, 1:3], axis=1)
    slack = 2e-9 * np.abs(forces).max()
    if forces.shape[1] == 4:
        twist = np.divide(forces[:, 3], grasp.torsion, out=np.zeros(len(forces)), where=grasp.torsion > 0)
        load = np.hypot(load, grasp.friction * twist)
        slack *= 1 + (grasp.friction / np.where(grasp.torsion > 0, grasp.torsion, 1)).max()
    return bool((load <= grasp.friction * forces[:, 0] + slack).all())


def answer_of(case: Case, past: list[np.ndarray]):
    """Solve after a past; the answer or the error."""
    distributor = gf.ForceDistributor(case.grasp, case.objective, case.method, **case.options)
    for before in past:
        try:
            distributor.solve(before)
        except gf.GraspForceError:
            continue
    try:
        return distributor.solve(case.wrench)
    except gf.GraspForceError as error:
        return error


def judge(  # noqa: PLR0911 - one return for each way to fail
    case: Case, found
) -> tuple[str, str]:
    """Judge an answer or an error."""
    scale = units(case.grasp)
    size = size_of(case, scale)
    if isinstance(found, gf.InfeasibleWrenchError):
        e = np.asarray(found.direction)
        weight = max(abs(x) * s for x, s in zip(exact(e), exact(scale), strict=True))
        product = -sum(w * x for w, x in zip(exact(case.wrench), exact(e), strict=True))
        reach = reach_along(case, e) / weight
        margin = (product - held_along(case, e)) / weight / size
        clear = margin - Fraction(LARGEST_OBJECTIVE * (1 + case.options.get("weight", 0.0))) * reach
        words = f"margin {float(margin):.1e}, reach {float(reach):.1e}"
        if float(clear) > TOLERANCE * (1 - 1e-3):
            return "right", ("infeasible: " if reach < 1e-14 else "infeasible within limits: ") + words
        return "missed", "a witness that does not separate: " + words
    if isinstance(found, gf.GraspForceError):
        return "missed", str(found)
    rest = left_over(case.grasp, case.wrench, found.forces, scale)
    left = float(sum(abs(x) for x in rest) / size)
    if left > TOLERANCE * (1 + EDGE):
        return "wrong", f"unbalanced by {left:.2e}, forces {np.abs(found.forces).max() / scale[0]:.1e}"
    off = sum(abs(r - x / s) for r, x, s in zip(rest, exact(found.residual), exact(scale), strict=True))
    if float(off / size) > TOLERANCE:
        return "wrong", f"the residual is off by {float(off / size):.1e}"
    if found.gap > found.rtol:
        return "wrong", f"a gap of {found.gap:.1e}"
    if not inside(case.grasp, found.forces):
        return "wrong", "outside the cones"
    bounds = case.options.get("min_normal")
    if bounds is not None and (found.shares < bounds - 2e-9 * max(found.sigma_max, 1e-300)).any():
        return "wrong", "below the lower bounds"
    return "right", "balanced"


def rest_of(case: Case, found) -> tuple[str, str]:
    """Whether `solve_many` and `resistance` say the same as `solve`."""
    distributor = gf.ForceDistributor(case.grasp, case.objective, case.method, **case.options)
    batch = distributor.solve_many(np.array([*case.past, case.wrench]))
    solved = not isinstance(found, Exception)
    if (batch.status[-1] == gf.Status.SOLVED) != solved:
        return "wrong", "solve_many differs"
    if case.method != "implicit" or set(case.options):
        return "right", ""
    most = case.grasp.resistance([case.wrench], case.objective)[0]
    if abs(most - (1 / found_value(case, found) if solved else 0.0)) > 1e-8 * most:
        return "wrong", "resistance differs"
    return "right", ""


def found_value(case: Case, found) -> float:
    """Return the objective of an answer, the maximum or the sum."""
    return float(found.sigma_sum if case.objective == "sum" else found.sigma_max)


def verdict(case: Case) -> tuple[str, str]:
    """Return the worst verdict after three pasts, or that they differ."""
    pasts: list[list[np.ndarray]] = [[], case.past, [*case.past, case.wrench * (1 + 1e-3), 3.0 * case.wrench]]
    found = [answer_of(case, past) for past in pasts]
    verdicts = [judge(case, each) for each in found]
    if verdicts[0][0] == "right":
        verdicts.append(rest_of(case, found[0]))
    for end in ("wrong", "missed"):
        for ended, words in verdicts:
            if ended == end:
                return end, words
    solved = [not isinstance(each, Exception) for each in found]
    if any(solved) != all(solved):
        return "wrong", "solved after one past, infeasible after another"
    return verdicts[0]


def cases(kind: str, number: int) -> Iterator[Case]:
    """Yield cases of a kind."""
    return (case(kind, seed) for seed in range(number))


def rows(share: float) -> list[Row]:
    """Every kind, a seventh of the cases each."""
    found = []
    for kind in KINDS:
        number = max(1, round(CASES / len(KINDS) * share))
        ends = [verdict(each)[0] for each in cases(kind, number)]
        family = f"forces far greater than the wrench, {kind}"
        found.append(Row(family, number, "rationals", ends.count("missed"), ends.count("wrong")))
    return found
