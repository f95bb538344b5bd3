"""Nearest forces of grasps that are degenerate but for noise, also for wrenches on their borders.

Rings, boxes, feet, pinches and parallel normals with noise of 1e-12 to 1e-7 on positions and normals; hard,
soft and frictionless contacts; pyramids and true cones; limits over orders; wrenches inside, on the border,
beyond and tiny.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
from benches.trust.barrier import Barrier, UndecidedError, exact
from benches.trust.nearest import CERTIFIED, Geometry
from benches.trust.row import Row

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

CASES = 6000

GAP = 1e-9
"""Largest gap that counts as proven."""

TINY = 1e-8
"""Wrenches of this part of the limits count as tiny."""

BOX = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)], float)


def contact_points(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions of size 1 and inward normals of a degenerate grasp."""
    kind = rng.integers(6)
    angles = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
    if kind == 0:
        return ring, -ring
    if kind == 1:
        corners = BOX[:count] * rng.uniform(0.3, 1, 3)
        axis = rng.integers(3)
        return corners, -np.sign(corners) * np.eye(3)[axis]
    if kind == 2:
        return ring, np.tile([0.0, 0.0, 1.0], (count, 1))
    if kind == 3:
        sides = np.where(np.arange(count) % 2, -1.0, 1.0)[:, None] * [1.0, 0.0, 0.0]
        along = np.outer(np.arange(count) // 2, [0.0, 0.0, 1.0])
        return sides + along, -sides
    if kind == 4:
        line = np.outer(np.arange(count) - rng.integers(2) * (count - 1) / 2, [0.0, 1.0, 0.0])
        return line, np.tile([0.0, 0.0, 1.0], (count, 1))
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points, -points


def grasp_of(rng: np.random.Generator) -> gf.Grasp:
    """Draw a grasp with noise."""
    count = int(rng.integers(2, 9))
    positions, normals = contact_points(rng, count)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    if rng.integers(2):
        positions, normals = positions @ rotation.T, normals @ rotation.T
    noise = 10.0 ** rng.uniform(-12, -7)
    size = 10.0 ** rng.uniform(-3, 0)
    positions = size * (positions + noise * rng.normal(size=positions.shape))
    if rng.integers(2):
        normals = normals + noise * rng.normal(size=normals.shape)
    options: dict[str, Any] = {"edges": None if rng.integers(2) else int(rng.integers(3, 17))}
    options["friction"] = float(rng.choice([0.0, 0.3, 0.8]))
    if rng.integers(3) == 0 and options["friction"] > 0:
        options["torsion"] = size * 10.0 ** rng.uniform(-2, 0)
        options["edges"] = options["edges"] and max(4, options["edges"])
    spread = rng.choice([0.0, 0.5, 2.0])
    options["max_normal_force"] = 10.0 ** (rng.uniform(-3, 2) + spread * rng.uniform(-1, 1, count))
    options["length_scale"] = float(rng.choice([1.0, size]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gf.GraspWarning)
        return gf.Grasp(positions, normals, **options)


def some_forces(rng: np.random.Generator, grasp: gf.Grasp) -> np.ndarray:
    """Draw forces in their cones: some contacts idle, some at their limits, some on their cones."""
    m, k = grasp.num_contacts, grasp.force_dim
    level = rng.choice([0.0, 0.5, 1.0, rng.uniform()], m) * grasp.max_normal_force
    forces = np.zeros((m, k))
    forces[:, 0] = level
    if (grasp.num_edges > 0).all():
        first = np.concatenate([[0], np.cumsum(grasp.num_edges)])
        for i in range(m):
            each = grasp.extreme_forces[first[i] : first[i + 1]] / grasp.max_normal_force[i]
            mixed = each[rng.integers(len(each), size=rng.integers(1, 4))].mean(axis=0)
            forces[i] = level[i] * mixed[:k]
        return forces
    tangential = rng.normal(size=(m, k - 1))
    tangential /= np.linalg.norm(tangential, axis=1, keepdims=True)
    scales = [grasp.friction, grasp.friction, grasp.torsion][: k - 1]
    tangential *= np.column_stack(scales) * rng.choice([0.0, 0.5, 1.0], (m, 1))
    forces[:, 1:] = level[:, None] * tangential
    return forces


def wrench_of(rng: np.random.Generator, grasp: gf.Grasp) -> np.ndarray:
    """Draw a wrench: exerted, on the border, moved a little, beyond, along an axis, or tiny."""
    forces = some_forces(rng, grasp)
    wrench = -grasp.grasp_matrix @ forces.ravel()
    scale = np.abs(grasp.grasp_matrix).max(axis=1) * grasp.max_normal_force.max()
    arm = max(np.abs(grasp.positions).max(), 1e-6)
    scale[3:] = np.maximum(scale[3:], arm * scale[:3].max())
    kind = rng.integers(6)
    if kind == 0 or (kind == 1 and not wrench.any()):
        wrench = scale * rng.normal(size=6) * 10.0 ** rng.uniform(-2, 1)
    elif kind == 1:
        wrench *= 10.0 ** rng.uniform(-0.5, 1)
    elif kind == 2:
        wrench = np.zeros(6)
        wrench[rng.integers(6)] = scale[0] * 10.0 ** rng.uniform(-2, 0.5)
    elif kind == 3:
        wrench += scale * rng.normal(size=6) * 10.0 ** rng.uniform(-14, -5)
    elif kind == 4:
        wrench = wrench if wrench.any() else scale * rng.normal(size=6)
        wrench *= 10.0 ** rng.uniform(-20, -10)
    return wrench if wrench.any() else scale * rng.normal(size=6)


def cases(count: int, seed: int) -> Iterator[tuple[gf.Grasp, np.ndarray, str, dict[str, Any]]]:
    """Yield grasps, wrenches, and objectives with their options."""
    for turn in range(count):
        rng = np.random.default_rng([seed, turn])
        grasp = grasp_of(rng)
        wrench = wrench_of(rng, grasp)
        objective = ("max", "sum", "squares")[turn % 3]
        options: dict[str, Any] = {}
        if objective == "max" and rng.integers(2):
            options["weight"] = 10.0 ** rng.uniform(-3, 1)
        if objective == "squares":
            options["limits"] = bool(rng.integers(2))
            if rng.integers(2):
                options["weights"] = 10.0 ** rng.uniform(-2, 2, grasp.num_contacts)
        yield grasp, wrench, objective, options


OUTSIDE = "forces outside their cones or limits"


def reach(grasp: gf.Grasp, h: np.ndarray) -> np.ndarray:
    """Return how far each contact reaches within its limit along h, (m, k) in its frame."""
    if (grasp.num_edges > 0).all():
        ends = np.cumsum(grasp.num_edges)[:-1]
        parts = np.split(grasp.extreme_forces.astype(np.longdouble), ends)
        return np.array([(part @ along).max() for part, along in zip(parts, h, strict=True)])
    scales = np.column_stack([grasp.friction, grasp.friction, grasp.torsion][: grasp.force_dim - 1])
    return grasp.max_normal_force * (h[:, 0] + np.sqrt(((scales * h[:, 1:]) ** 2).sum(axis=1)))


def witnesses(residual: np.ndarray, scale: np.ndarray, found: list[gf.ForceSolution]) -> list[np.ndarray]:
    """Return directions that may prove how near forces come; each counts only for what it proves."""
    residuals = [residual, *(answer.residual.astype(np.longdouble) for answer in found)]
    return [-rest * scale**2 for rest in residuals] + [answer.dual.astype(np.longdouble) for answer in found]


def contradiction(
    grasp: gf.Grasp, wrench: np.ndarray, objective: str, options: dict[str, Any], found: gf.ForceSolution
) -> str:
    """Say which claim of an answer is not proven; nothing if all are.

    The forces balance the wrench, or no forces come nearer by more than the gap, as some direction proves:
    that of the residual, the multiplier, or those of the other objectives. If 32 digits gave the answer, no
    forces that come as near have a smaller objective, as the multiplier proves.
    """
    wide = np.longdouble
    matrix, forces = grasp.grasp_matrix.astype(wide), found.forces.astype(wide)
    scale = Geometry(grasp).scale.astype(wide)
    residual = wrench + matrix @ forces.ravel()
    distance, size = np.linalg.norm(residual * scale), np.linalg.norm(wrench * scale)
    shape = (grasp.num_contacts, grasp.force_dim)
    lower, terms = wide(0), wide(0)
    others = [gf.ForceDistributor(grasp, other).nearest(wrench) for other in ("max", "sum", "squares")]
    for z in witnesses(residual, scale, [found, *others]):
        length = np.linalg.norm(z / scale)
        if length > 0:
            along = np.maximum(reach(grasp, (z @ matrix).reshape(shape)), 0).sum()
            lower = max(lower, (-(wrench @ z) - along) / length)
    # What rounding of the forces themselves leaves of the residual.
    rounded = 1e-15 * (size + np.linalg.norm((np.abs(matrix) @ np.abs(forces.ravel())) * scale))
    allowed = max(found.gap, CERTIFIED) * size + rounded
    if not distance - lower <= allowed and not found.balanced:
        return f"others may come nearer by {(distance - lower) / size:.1e}, gap {found.gap:.1e}"
    if Geometry(grasp).outside(found.forces[None])[0] > 1e-8:
        return OUTSIDE
    if not found.fell_back or found.gap >= 1:
        return ""
    z = found.dual.astype(wide)
    h = (z @ matrix).reshape(shape)
    near = distance * np.linalg.norm(z / scale)
    if objective == "squares":
        weights = np.broadcast_to(options.get("weights", 1.0), grasp.num_contacts)[:, None]
        push = h - weights * forces
        value = 0.5 * (weights * forces**2).sum()
        excess = near + z @ residual + (np.maximum(reach(grasp, push), 0) - (push * forces).sum(axis=1)).sum()
    else:
        of_sum = 1.0 if objective == "sum" else options.get("weight", 0.0)
        value = of_sum * found.sigma_sum + (found.sigma_max if objective == "max" else 0)
        gain = np.maximum(reach(grasp, h) - of_sum, 0).sum()
        excess = value + near + wrench @ z + (max(gain - 1, 0) if objective == "max" else gain)
    sizes = (np.abs(z) @ np.abs(matrix)).reshape(shape).sum(axis=1)
    terms = near + np.abs(wrench * z).sum() + (sizes * grasp.max_normal_force).sum()
    far = excess > max(found.gap, GAP) * value + 1e-14 * terms
    return f"an objective of {value:.1e} may be less by {excess:.1e}, gap {found.gap:.1e}" if far else ""


def refuted(
    grasp: gf.Grasp, wrench: np.ndarray, objective: str, options: dict[str, Any], found: gf.ForceSolution
) -> str:
    """Decide a doubt in 90 digits: say what is wrong or stays open; nothing if all is proven."""
    oracle = Barrier(grasp, wrench, objective, options)
    forces = exact(found.forces)
    matrix = exact(grasp.grasp_matrix)
    residual = (exact(wrench) + matrix @ forces.ravel()) * oracle.scale
    distance = mpmath.sqrt(residual @ residual)
    size = mpmath.sqrt(oracle.wrench @ oracle.wrench)
    terms = (np.abs(matrix) @ np.abs(forces.ravel())) * oracle.scale
    allowed = max(found.gap, CERTIFIED) * size + 1e-15 * (size + mpmath.sqrt(terms @ terms))
    lower, upper = oracle.distance()
    if not found.balanced and distance - lower > allowed:
        which = "come" if distance - upper > allowed else "may come"
        return f"others {which} nearer by {float((distance - lower) / size):.1e}, gap {found.gap:.1e}"
    if not found.fell_back or found.gap >= 1:
        return ""
    known = oracle.least(max(distance, upper * (1 + mpmath.mpf(10) ** -20)))
    if known is None:
        return "no forces are as near"
    proven, attained = max(known[0], 0), known[1]
    allowed = max(found.gap, GAP) * found.value
    if found.value - proven > allowed:
        which = "is" if found.value - attained > allowed else "may be"
        return f"an objective of {found.value:.1e} {which} less by {float(found.value - proven):.1e}"
    return ""


def rows(share: float) -> list[Row]:
    """Return the row of all answers."""
    asked = missed = wrong = undecided = 0
    for grasp, wrench, objective, options in cases(max(60, round(share * CASES)), 7):
        found = gf.ForceDistributor(grasp, objective, **options).nearest(wrench)
        asked += 1
        # Forces at the limits act along the noise more than tiny wrenches do.
        tiny = np.abs(wrench[:3]).max() <= TINY * grasp.max_normal_force.max()
        missed += not found.gap <= (1.0 if tiny else GAP)
        doubt = contradiction(grasp, wrench, objective, options, found)
        if doubt and doubt != OUTSIDE:
            try:
                doubt = refuted(grasp, wrench, objective, options, found)
            except UndecidedError:
                undecided, doubt = undecided + 1, ""
        wrong += bool(doubt)
    family = f"nearest forces, degenerate but for noise, gap 1e-9 ({undecided} undecided by the oracle)"
    return [Row(family, asked, "duality in extended precision, 90 digits in doubt", missed, wrong)]
