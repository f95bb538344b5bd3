"""Brackets in hard metrics, at extreme length scales and limits, beside exact rational arithmetic."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from benches.trust import exact
from benches.trust.row import Row
from scipy.spatial import ConvexHull

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

WIDE = 1e-6
"""A bracket of a larger share of epsilon counts as missed, unless the bracket says that it is open."""


@dataclass(frozen=True)
class Case:
    """A grasp and the norm in which it is measured."""

    positions: np.ndarray
    normals: np.ndarray
    friction: np.ndarray
    limits: np.ndarray
    options: dict[str, Any] = field(default_factory=dict)
    metric: np.ndarray | None = None

    def grasp(self) -> gf.Grasp:
        """Return the library's grasp, with 4 edges in space."""
        edges = {} if self.positions.shape[1] == 2 else {"edges": 4}
        given = {"friction": self.friction, "max_normal_force": self.limits, **edges, **self.options}
        return gf.Grasp(self.positions, self.normals, **given)

    def sets(self) -> list[list[exact.Vector]]:
        """Return the exact primitive wrenches."""
        origin = self.options.get("origin")
        return exact.wrenches(self.positions, self.normals, self.friction, self.limits, origin=origin)

    def exact_metric(self) -> exact.Matrix:
        """Return the exact metric."""
        if self.metric is not None:
            return exact.rational(self.metric)
        dim = 3 if self.positions.shape[1] == 2 else 6
        scale = Fraction(float(self.options.get("length_scale", 1.0)))
        torque = [Fraction(1) if row < (2 if dim == 3 else 3) else 1 / scale**2 for row in range(dim)]
        return [[torque[i] if i == k else Fraction(0) for k in range(dim)] for i in range(dim)]


def metric(random: np.random.Generator, dim: int, condition: float) -> np.ndarray:
    """Return `Q D Q^T` of a random orthogonal Q and a condition number."""
    q, _ = np.linalg.qr(random.normal(size=(dim, dim)))
    diagonal = condition ** -np.sort(np.concatenate([[0.0, 1.0], random.uniform(0, 1, dim - 2)]))
    matrix = q @ np.diag(diagonal) @ q.T
    return (matrix + matrix.T) / 2


def planar_cases(count: int, seed: int = 0) -> Iterator[Case]:
    """Yield contacts around a disc; conditions 1 to 1e16, or length scales and limits over decades."""
    random = np.random.default_rng(seed)
    for k in range(count):
        contacts = int(random.integers(3, 5))
        angles = 2 * np.pi * np.arange(contacts) / contacts + random.uniform(-0.3, 0.3, contacts) * (
            k % 3 > 0
        )
        positions = np.column_stack([np.cos(angles), np.sin(angles)])
        tilt = random.uniform(-0.2, 0.2, contacts) * (k % 3 > 1)
        normals = -np.column_stack([np.cos(angles + tilt), np.sin(angles + tilt)])
        yield _dressed(random, k, positions, normals)


def spatial_cases(count: int, seed: int = 1) -> Iterator[Case]:
    """Yield three or four contacts on an ellipsoid, alike."""
    random = np.random.default_rng(seed)
    for k in range(count):
        while True:
            outward = random.normal(size=(int(random.integers(3, 5)), 3))
            outward /= np.linalg.norm(outward, axis=1)[:, None]
            positions, normals = outward * [1.0, 0.8, 0.6], -outward / [1.0, 0.8, 0.6]
            if gf.Grasp(positions, normals, friction=0.7, edges=4).quality("sum").epsilon > 0.01:
                break
        yield _dressed(random, k, positions, normals, 0.7)


def _dressed(random, k: int, positions, normals, friction: float | None = None) -> Case:
    contacts, dim = positions.shape
    mu = np.full(contacts, friction or random.uniform(0.2, 1.0))
    limits = np.ones(contacts)
    if k % 4:
        hard = metric(random, 3 if dim == 2 else 6, 10.0 ** random.uniform(0, 16))
        return Case(positions, normals, mu, limits, metric=hard)
    positions = positions * 10.0 ** random.uniform(-4, 2)
    limits = 10.0 ** random.uniform(-4, 4, contacts)
    return Case(positions, normals, mu, limits, {"length_scale": 10.0 ** random.uniform(-5, 5)})


def spatial_bounds(case: Case, found: gf.Quality) -> tuple[Fraction, Fraction]:
    """Return the least exact p(y) / |y| over Qhull's nearest facets, and along the library's direction.

    Both bound epsilon from above; the first is epsilon, since facets do not depend on the metric.
    """
    sets, matrix, criterion = case.sets(), case.exact_metric(), found.criterion
    inverse = exact.inverse(matrix)
    assert inverse is not None

    def reach(y: exact.Vector) -> Fraction:
        return exact.support(sets, criterion, y) / exact.dual_norm(y, inverse)

    along = reach([exact.dot(row, [Fraction(float(x)) for x in found.direction]) for row in matrix])
    choices = [[[Fraction(0)] * 6, *contact] for contact in sets]
    points = [w for contact in sets for w in contact]
    if criterion == "max":
        sums = itertools.product(*choices)
        points = [[sum(parts, Fraction(0)) for parts in zip(*choice, strict=True)] for choice in sums]
    floats = np.array(points, float)
    scale = np.abs(floats).max(axis=0)
    hull = ConvexHull(floats / scale, qhull_options="Qt")
    y = hull.equations[:, :-1] / scale
    size = np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", y, np.array(inverse, float), y), 1e-300))
    nearest = np.argsort(-hull.equations[:, -1] / size)[:6]
    best = None
    for facet in nearest:
        plane = exact.solve([points[v] for v in hull.simplices[facet]], [Fraction(1)] * 6)
        if plane is not None:
            best = min(best or reach(plane), reach(plane))
    assert best is not None
    return best, along


def wrong_planar(case: Case, found: gf.Quality) -> bool:
    """Whether the bracket excludes the exact epsilon."""
    epsilon = exact.planar_epsilon(case.sets(), found.criterion, case.exact_metric())
    return epsilon is None or not found.epsilon_lower <= epsilon <= found.epsilon_upper


def wrong_spatial(case: Case, found: gf.Quality) -> bool:
    """Whether the bracket excludes the exact epsilon."""
    epsilon, along = spatial_bounds(case, found)
    return not found.epsilon_lower <= min(epsilon, along) or not epsilon <= found.epsilon_upper


def compare(cases: Iterator[Case], wrong) -> tuple[int, int, int]:
    """Count cases, brackets that are too wide without saying so, and brackets that are wrong."""
    counts = [0, 0, 0]
    for case in cases:
        for criterion in ("max", "sum"):
            try:
                found = case.grasp().quality(criterion, metric=case.metric)
            except gf.InvalidInputError:
                continue  # rounding has made the metric indefinite
            counts[0] += 1
            width = found.epsilon_upper - found.epsilon_lower
            counts[1] += width > WIDE * abs(found.epsilon_upper) or not found.converged
            counts[2] += wrong(case, found)
    return counts[0], counts[1], counts[2]


def rows(share: float) -> list[Row]:
    """Brackets that exclude the exact epsilon are wrong, those wider than a millionth of it missed."""
    found = []
    for name, cases, wrong, count in (
        ("planar", planar_cases, wrong_planar, 600),
        ("spatial", spatial_cases, wrong_spatial, 60),
    ):
        asked, missed, excluded = compare(cases(max(4, round(share * count))), wrong)
        family = f"{name} grasps, metrics of condition 1 to 1e16, length scales and limits over 1e8"
        found.append(Row(family, asked, "exact rational arithmetic", missed, excluded))
    return found
