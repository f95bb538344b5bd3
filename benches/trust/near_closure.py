"""Grasps whose friction, or whose distance from closure, is hardly more than rounding."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from benches.trust import exact
from benches.trust.metrics import Case, metric
from benches.trust.row import Row

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

FRICTIONS = (0.0, *(10.0**k for k in range(-16, -2)))


def slippery_cases(count: int, seed: int = 2) -> Iterator[list[Case]]:
    """Yield one grasp of little friction in many metrics, limits, length scales and origins."""
    random = np.random.default_rng(seed)
    for k in range(count):
        friction = FRICTIONS[k % len(FRICTIONS)]
        positions, normals = _shape(random, int(random.integers(4)))
        contacts, dim = len(positions), 3 if positions.shape[1] == 2 else 6
        mu = np.full(contacts, friction)
        even = np.ones(contacts)
        hard = [metric(random, dim, condition) for condition in (1e2, 1e6, 1e12)]
        cases = [Case(positions, normals, mu, even, metric=matrix) for matrix in (None, *hard)]
        cases += [Case(positions, normals, mu, even, {"length_scale": scale}) for scale in (1e-3, 1e3)]
        cases.append(Case(positions, normals, mu, 10.0 ** random.uniform(-3, 3, contacts)))
        cases.append(
            Case(
                positions, normals, mu, np.ones(contacts), {"origin": random.normal(size=positions.shape[1])}
            )
        )
        yield cases


def _shape(random: np.random.Generator, kind: int) -> tuple[np.ndarray, np.ndarray]:
    if kind == 0:
        return np.array([[-1.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 0.0], [-1.0, 0.0]])
    if kind == 1:
        angles = 2 * np.pi * np.arange(3) / 3 + random.uniform(0, 6)
        positions = np.column_stack([np.cos(angles), np.sin(angles)])
        return positions, -positions
    if kind == 2:
        across, up = random.uniform(0.02, 0.2, 2)
        corners = np.array([[-across, 0.0], [across, 0.0], [-across, up], [across, up]])
        return corners, np.array([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0]])
    corners = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    return corners, -corners


def open_cases(count: int, seed: int = 3) -> Iterator[Case]:
    """Two feet whose cones miss each other by an angle of 1e-12 to 1e-3, planar, in any plane pose."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        mu, apart = random.uniform(0.05, 1.0), random.uniform(0.01, 1.0)
        angle = np.arctan(mu) + 10.0 ** random.uniform(-12, -3)
        turn = random.uniform(0, 6) * (random.random() < 0.5)
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, -s], [s, c]])
        positions = np.array([[-apart / 2, 0.0], [apart / 2, 0.0]]) @ rotation.T
        normals = np.array([[np.cos(angle), np.sin(angle)], [-np.cos(angle), np.sin(angle)]]) @ rotation.T
        limits = 10.0 ** random.uniform(-1, 3, 2)
        scale = 10.0 ** random.uniform(-2, 1)
        yield Case(positions, normals, np.full(2, mu), limits, {"length_scale": scale})


def in_space(case: Case, edges: int | None) -> gf.Grasp:
    """Return a planar case as a grasp in space, whose wrenches within the plane are the same."""
    pad = np.zeros((len(case.positions), 1))
    normals = np.hstack([case.normals, pad])
    given = {"friction": case.friction, "max_normal_force": case.limits, **case.options}
    tangents = np.column_stack([-normals[:, 1], normals[:, 0], pad])
    return gf.Grasp(np.hstack([case.positions, pad]), normals, tangents=tangents, edges=edges, **given)


def compare_slippery(count: int) -> tuple[int, int, int]:
    """Count questions, open brackets, and classes that differ or brackets that are wrong."""
    asked = missed = wrong = 0
    for cases in slippery_cases(count):
        classes = set()
        for case in cases:
            for criterion in ("max", "sum"):
                found = case.grasp().quality(criterion, metric=case.metric)
                classes.add(found.closure)
                asked += 1
                missed += not found.converged
                if case.positions.shape[1] == 2:
                    sets = case.sets()
                    epsilon = exact.planar_epsilon(sets, criterion, case.exact_metric())
                    wrong += epsilon is None or not found.epsilon_lower <= epsilon <= found.epsilon_upper
                # Resistance is at least epsilon along every direction, as exactly as forces are solved for.
                if case.friction[0] >= 1e-6:
                    along = found.direction / np.abs(found.direction).max()
                    reach = case.grasp().resistance([-along], criterion)[0] * _norm(case, along)
                    wrong += bool(reach < found.epsilon_lower * (1 - 1e-2))
        wrong += len(classes) != 1
    return asked, missed, wrong


def _norm(case: Case, wrench: np.ndarray) -> float:
    matrix = np.array(case.exact_metric(), float)
    return float(np.sqrt(wrench @ matrix @ wrench))


def compare_open(count: int) -> tuple[int, int, int]:
    """Count open grasps, brackets not converged, and brackets that exclude the exact distance."""
    asked = missed = wrong = 0
    for case in open_cases(count):
        points = [w for contact in case.sets() for w in contact]
        rho = exact.distance(points, case.exact_metric())
        for grasp in (case.grasp(), in_space(case, 4), in_space(case, None)):
            found = grasp.quality("max")
            asked += 1
            missed += not found.converged
            wrong += not found.lower <= rho <= found.upper
    return asked, missed, wrong


def rows(share: float) -> list[Row]:
    """Classes that depend on the metric, and brackets that exclude the exact value, are wrong."""
    families = (
        ("frictions of 0 and 1e-16 to 1e-3, in metrics, limits, scales", compare_slippery, 120),
        ("feet 1e-12 to 1e-3 rad from closure, linearised and true cones", compare_open, 300),
    )
    return [Row(name, *_between(compare(max(4, round(share * count))))) for name, compare, count in families]


def _between(counts: tuple[int, int, int]) -> tuple[int, str, int, int]:
    asked, missed, wrong = counts
    return asked, "exact rational arithmetic", missed, wrong
