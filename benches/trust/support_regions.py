"""Support regions of random stances beside linear programs by HiGHS and conic programs by Clarabel.

Feet stand on ground of any slope, on walls and in a line, some of them twice; fingers hold from all sides.
Bodies weigh from a millionth to a million N, are from a millimetre to a kilometre large, accelerate and are
pulled. The programs know nothing of the library but the grasp matrix.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from benches.trust.row import Row
from scipy.optimize import linprog
from scipy.sparse import csc_matrix, diags

import graspforce as gf

__all__ = ["furthest", "judged", "rows", "stance"]

CASES = 200
DIRECTIONS = 12

KINDS = ("even", "uneven", "walls", "line", "repeated", "fingers", "frictionless", "one")


def stance(seed: int, *, cones: bool) -> tuple[gf.Grasp, float, str, dict[str, Any]]:
    """Contacts, the weight, the criterion, and the options of the region."""
    rng = np.random.default_rng([18, seed])
    kind = KINDS[seed % len(KINDS)]
    size, weight = 10 ** rng.uniform(-3, 3), 10 ** rng.uniform(-6, 6)
    number = 1 if kind == "one" else int(rng.integers(2, 7))
    places = rng.uniform(-1, 1, (number, 3)) * [1, 1, 0]
    normals = np.tile([0.0, 0.0, 1.0], (number, 1))
    if kind != "even":
        places[:, 2] = rng.uniform(-0.5, 0.5, number)
        normals = normals + 0.3 * rng.standard_normal((number, 3))
    if kind in ("walls", "fingers"):
        side = rng.standard_normal((number, 3)) * [1, 1, 1 if kind == "fingers" else 0]
        walls = rng.integers(0, 2, number) == 0 if kind == "walls" else np.full(number, True)
        normals[walls] = side[walls]
        if kind == "fingers":
            places = -side / np.linalg.norm(side, axis=1)[:, None]
    if kind == "line":
        places = rng.uniform(-1, 1, (number, 1)) * rng.standard_normal(3)
    if kind == "repeated":
        again = rng.integers(0, number, number + 2)
        places, normals = places[again], normals[again]
    number = len(places)
    spread = 10 ** rng.uniform(-0.3, 1.5, number if rng.integers(2) else 1)
    options: dict[str, Any] = {}
    if rng.integers(3) == 0:
        options["torsion"] = 0.1 * size * rng.uniform(0.1, 1, number)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gf.GraspWarning)
        grasp = gf.Grasp(
            size * (places + rng.choice([0, 0, 1, 100]) * rng.standard_normal(3)),
            normals,
            friction=0.0 if kind == "frictionless" else rng.uniform(0.4, 1.2, number),
            max_normal_force=np.broadcast_to(weight * spread, number),
            edges=None if cones else int(rng.choice([4, 6, 8, 12])),
            origin=size * rng.standard_normal(3) if rng.integers(2) else None,
            **options,
        )
    load: dict[str, Any] = {}
    if rng.integers(2):
        load |= {"acceleration": rng.standard_normal(3), "height": size * rng.uniform(0, 2)}
    if rng.integers(3) == 0:
        pull = weight * rng.uniform(0, 0.5) * rng.standard_normal(6)
        pull[3:] *= size
        load["external_wrench"] = pull
    return grasp, weight, str(rng.choice(["max", "sum"])), load


def scaled(grasp: gf.Grasp, weight: float, load: dict[str, Any]) -> tuple[Any, ...]:
    """Return the balance ``A s + X (x, y) = b`` in units of weight and extent about the contacts' mean.

    The columns of A belong to the components of contact forces in units of the weight, torsions in units of
    weight times extent; (x, y) is the centre of mass from the mean in units of the extent.
    """
    positions, center = grasp.positions, grasp.positions.mean(axis=0)
    extent = max(np.linalg.norm(positions - center, axis=1).max(), np.max(grasp.torsion))
    # Contacts in one place have none but for rounding.
    extent = extent if extent > 1e-15 * np.abs(positions).max() else 1.0
    columns = []
    for place, frame in zip(positions, grasp.frames, strict=True):
        axes = np.asarray(frame)
        lever = (place - center) / extent
        columns += [np.r_[axis, np.cross(lever, axis)] for axis in axes]
        columns.append(np.r_[0, 0, 0, axes[0]])
    force = np.array([0, 0, -1.0]) - np.asarray(load.get("acceleration", np.zeros(3))) / 9.80665
    height = (load.get("height", 0.0) - center[2]) / extent
    extra = np.asarray(load.get("external_wrench", np.zeros(6))) / weight
    torque = extra[3:] / extent - np.cross((center - grasp.origin) / extent, extra[:3])
    moving = np.column_stack([np.r_[0, 0, 0, np.cross(axis, force)] for axis in np.eye(3)[:2]])
    fixed = np.r_[force + extra[:3], np.cross([0, 0, height], force) + torque]
    return np.column_stack(columns), moving, -fixed, center[:2], extent


def furthest(
    grasp: gf.Grasp,
    weight: float,
    criterion: str,
    load: dict[str, Any],
    direction: np.ndarray,
    *,
    cones: bool,
) -> float | None:
    """Return the largest ``direction @ (x, y)``, scaled; None if there is no place, NaN if undecided."""
    maps, moving, right, *_, extent = scaled(grasp, weight, load)
    solve = _by_clarabel if cones else _by_highs
    return solve(grasp, weight, criterion, maps, moving, right, direction, extent)


def _by_highs(
    grasp: gf.Grasp,
    weight: float,
    criterion: str,
    maps: Any,
    moving: Any,
    right: Any,
    direction: Any,
    extent: float,
) -> float | None:
    forces = np.zeros((len(grasp.extreme_forces), 4))
    forces[:, : grasp.force_dim] = grasp.extreme_forces
    forces /= weight
    forces[:, 3] /= extent
    counts = np.asarray(grasp.num_edges)
    owner = np.repeat(np.arange(len(counts)), counts)
    edges = np.column_stack(
        [maps[:, 4 * i : 4 * i + 4] @ force for i, force in zip(owner, forces, strict=True)]
    )
    shares = (owner == np.arange(len(counts))[:, None]).astype(float)
    limits = shares if criterion == "max" else np.ones((1, len(owner)))
    found = linprog(
        np.r_[np.zeros(len(owner)), -direction],
        A_ub=np.column_stack([limits, np.zeros((len(limits), 2))]),
        b_ub=np.ones(len(limits)),
        A_eq=np.column_stack([edges, moving]),
        b_eq=right,
        bounds=[(0, None)] * len(owner) + [(None, None)] * 2,
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    return None if found.status == 2 else -found.fun if found.status == 0 else np.nan


def _by_clarabel(
    grasp: gf.Grasp,
    weight: float,
    criterion: str,
    maps: Any,
    moving: Any,
    right: Any,
    direction: Any,
    extent: float,
) -> float | None:
    import clarabel  # noqa: PLC0415

    number = grasp.num_contacts
    limit, mu = grasp.max_normal_force / weight, np.asarray(grasp.friction)
    gamma = np.broadcast_to(np.asarray(grasp.torsion) / extent, number)
    size = 4 * number + 2
    rows, bounds, cones = [np.column_stack([maps, moving])], [right], [clarabel.ZeroConeT(6)]
    upper = np.zeros((number, size))
    upper[np.arange(number), 4 * np.arange(number)] = 1 / limit
    upper = upper if criterion == "max" else upper.sum(axis=0, keepdims=True)
    rows.append(upper)
    bounds.append(np.ones(len(upper)))
    cones.append(clarabel.NonnegativeConeT(len(upper)))
    for i in range(number):
        cone = np.zeros((4, size))
        cone[0, 4 * i] = -1
        free = [(1, mu[i]), (2, mu[i]), (3, gamma[i])]
        for row, by in free:
            cone[row, 4 * i + row] = -1 / by if by > 0 else 0.0
        rows.append(cone)
        bounds.append(np.zeros(4))
        cones.append(clarabel.SecondOrderConeT(4))
        fixed = [row for row, by in free if by == 0]
        if fixed:
            zero = np.zeros((len(fixed), size))
            zero[np.arange(len(fixed)), [4 * i + row for row in fixed]] = 1
            rows.append(zero)
            bounds.append(np.zeros(len(fixed)))
            cones.append(clarabel.ZeroConeT(len(fixed)))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    cost = np.r_[np.zeros(size - 2), -direction]
    nothing = csc_matrix(diags(np.zeros(size)))
    found = clarabel.DefaultSolver(
        nothing, cost, csc_matrix(np.vstack(rows)), np.concatenate(bounds), cones, settings
    ).solve()
    status = str(found.status)
    if "Infeasible" in status:
        return None
    return -found.obj_val if status == "Solved" else np.nan


def judged(seed: int, *, cones: bool, tolerance: float, gap: float) -> str:
    """Return "right", "missed" (no answer, or an open gap) or "wrong"; "undecided" where the programs are."""
    grasp, weight, criterion, load = stance(seed, cones=cones)
    try:
        region = gf.support_region(grasp, weight, criterion, gap=gap, **load)
    except gf.NotConvergedError:
        return "missed"
    *_, center, extent = scaled(grasp, weight, load)
    rng = np.random.default_rng([19, seed])
    angles = rng.uniform(0, 2 * np.pi, DIRECTIONS)
    decided = 0
    for direction in np.column_stack([np.cos(angles), np.sin(angles)]):
        reach = furthest(grasp, weight, criterion, load, direction, cones=cones)
        if reach is not None and np.isnan(reach):
            continue
        decided += 1
        if (reach is None) != (region.shape == "empty"):
            return "wrong"
        if reach is None:
            return "right" if _separates(grasp, weight, criterion, load, region, rng) else "wrong"
        inner, outer = (
            ((vertices - center) / extent @ direction).max() for vertices in (region.inner, region.outer)
        )
        rounding = tolerance * (1 + abs(reach))
        if not inner - rounding <= reach <= outer + rounding:
            return "wrong"
        if gap == 0 and outer - inner > 2 * rounding:
            return "missed"
    return ("right" if region.converged else "missed") if decided else "undecided"


def _separates(
    grasp: gf.Grasp, weight: float, criterion: str, load: dict[str, Any], region: gf.SupportRegion, rng: Any
) -> bool:
    """Whether the witness proves that no place exists, at some far places."""
    z = region.witness
    maps = np.asarray(grasp.grasp_matrix).reshape(6, grasp.num_contacts, -1)
    reaches = []
    for i in range(grasp.num_contacts):
        h = np.zeros(4)
        h[: maps.shape[2]] = z @ maps[:, i]
        if grasp.num_edges[i] > 0:
            own = slice(sum(grasp.num_edges[:i]), sum(grasp.num_edges[: i + 1]))
            reaches.append((grasp.extreme_forces[own] @ h[: maps.shape[2]]).max())
        else:
            across = np.hypot(grasp.friction[i] * np.hypot(h[1], h[2]), np.asarray(grasp.torsion)[i] * h[3])
            reaches.append(grasp.max_normal_force[i] * (h[0] + across))
    reach = np.maximum(reaches, 0).sum() if criterion == "max" else max(0, *reaches)
    force = weight * (np.array([0, 0, -1.0]) - np.asarray(load.get("acceleration", np.zeros(3))) / 9.80665)
    extra = np.asarray(load.get("external_wrench", np.zeros(6)))
    extent = np.ptp(grasp.positions, axis=0).max() + 1e-9
    for place in rng.uniform(-10, 10, (4, 2)) * extent + grasp.positions[0, :2]:
        lever = np.r_[place, load.get("height", 0.0)] - grasp.origin
        demand = -(np.r_[force, np.cross(lever, force)] + extra) @ z
        if reach > demand + 1e-9 * (abs(reach) + abs(demand)):
            return False
    return True


def rows(share: float) -> list[Row]:
    """Both kinds of cones."""
    found = []
    for cones, oracle, tolerance, gap in (
        (False, "HiGHS, to 1e-8", 1e-8, 0.0),
        (True, "Clarabel, to 1e-7", 1e-7, 1e-6),
    ):
        ends = [
            judged(seed, cones=cones, tolerance=tolerance, gap=gap) for seed in range(round(CASES * share))
        ]
        family = f"support regions of {'true' if cones else 'linearised'} cones"
        decided = [end for end in ends if end != "undecided"]
        found.append(Row(family, len(decided), oracle, decided.count("missed"), decided.count("wrong")))
    return found
