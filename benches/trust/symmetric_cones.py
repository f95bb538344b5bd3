"""Symmetric grasps whose weakest directions are a circle, a sphere or many points.

The oracle of pinches is their exact reduction to two unknowns. That of rings is a multi-start minimisation
of the support function, written out here, which bounds epsilon from above.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from benches.trust.row import Row
from scipy.optimize import minimize

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

WIDTH = 1e-3
"""Relative width of a bracket that counts as an answer."""

NOISE = 1e-9
"""Positions in m and normals of the nearly symmetric pinches are off by this much."""


@dataclass(frozen=True)
class Pinch:
    """Two soft contacts with true cones at (+-width, 0, 0), facing each other."""

    width: float
    friction: float
    torsion: float
    length_scale: float

    def grasp(self, noise: float = 0.0, seed: int = 0) -> gf.Grasp:
        """Build the grasp, every coordinate off by up to `noise`."""
        positions = np.array([(self.width, 0, 0), (-self.width, 0, 0)])
        normals = np.array([(-1.0, 0, 0), (1, 0, 0)])
        rng = np.random.default_rng(seed)
        return gf.Grasp(
            positions + noise * rng.uniform(-1, 1, (2, 3)),
            normals + noise * rng.uniform(-1, 1, (2, 3)),
            friction=self.friction,
            torsion=self.torsion,
            edges=None,
            length_scale=self.length_scale,
        )

    def epsilon(self, criterion: str) -> float:
        """Compute the exact quality.

        With u and v the tangential motions of both contacts by force and torque directions, the least p has
        them parallel. The component along the line of the contacts is free up to where one contact's reach
        vanishes ("max"), or where both reaches are equal ("sum").
        """
        arm, torsion, mu = self.width / self.length_scale, self.torsion / self.length_scale, self.friction

        def value(angles: np.ndarray[Any, Any]) -> Any:
            first, second = angles
            u = np.sin(first)
            twist, bend = np.cos(first) * np.cos(second), np.cos(first) * np.sin(second)
            one = np.hypot(mu * (u + arm * bend), torsion * twist)
            two = np.hypot(mu * (u - arm * bend), torsion * twist)
            if criterion == "max":
                return np.minimum(1.0, (one + two) / np.hypot(1.0, np.maximum(one, two)))
            return np.minimum(1.0, (one + two) / 2 / np.hypot(1.0, (one - two) / 2))

        grid = np.stack(np.meshgrid(np.linspace(-np.pi / 2, np.pi / 2, 801), np.linspace(0, np.pi / 2, 101)))
        values = value(grid)
        starts = np.argsort(values, axis=None)[:5]
        options = {"xatol": 1e-12, "fatol": 1e-15, "maxiter": 2000}
        found = []
        for k in starts:
            start = grid[:, *np.unravel_index(k, values.shape)]
            found.append(minimize(value, start, method="Nelder-Mead", options=options).fun)
        return float(min(found))


def pinches() -> list[Pinch]:
    """All 360 pinches."""
    widths, frictions = (0.01, 0.025, 0.04, 0.07, 0.1), (0.1, 0.3, 0.5, 1.0)
    torsions, scales = (0.001, 0.005, 0.02), (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
    return [Pinch(*numbers) for numbers in itertools.product(widths, frictions, torsions, scales)]


@dataclass(frozen=True)
class Ring:
    """Contacts on a circle of radius 0.04 m that push towards its centre."""

    contacts: int
    friction: float
    torsion: float
    length_scale: float
    edges: int | None = None

    def grasp(self) -> gf.Grasp:
        """Build the grasp."""
        angles = 2 * np.pi * np.arange(self.contacts) / self.contacts
        outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
        return gf.Grasp(
            0.04 * outward,
            -outward,
            friction=self.friction,
            torsion=self.torsion,
            edges=self.edges,
            length_scale=self.length_scale,
        )


def rings() -> list[Ring]:
    """Hard and soft rings of 3 to 8 contacts with true cones."""
    numbers = itertools.product(range(3, 9), (0.3, 0.5, 0.9), (0.0, 0.005), (0.02, 0.1, 1.0))
    return [Ring(*each) for each in numbers]


def least_support(grasp: gf.Grasp, criterion: str, target: float, starts: int = 300) -> float:
    """Bound epsilon from above, for true cones: subgradient steps on the sphere from many starts.

    Each step goes as far as it would have to if `target`, a value from below, were the least one.
    """
    maps = np.asarray(grasp.grasp_matrix, dtype=float).reshape(6, grasp.num_contacts, -1)
    maps = maps / np.array([1, 1, 1, *3 * [grasp.length_scale]])[:, None, None]
    slopes = np.stack([grasp.friction, grasp.friction, grasp.torsion], axis=1)[:, : maps.shape[2] - 1]
    rng = np.random.default_rng(1)
    z = rng.standard_normal((starts, 6)) * rng.choice([0.03, 1.0], (starts, 6))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    best = np.inf
    for _ in range(400):
        h = np.einsum("kd,dic->kic", z, maps)
        sheared = h[:, :, 1:] * slopes
        length = np.linalg.norm(sheared, axis=2, keepdims=True)
        force = np.concatenate([np.ones_like(length), sheared * slopes / np.maximum(length, 1e-300)], axis=2)
        reach = np.einsum("kic,kic->ki", h, force)
        share = (reach > 0) if criterion == "max" else (reach == reach.max(axis=1, keepdims=True))
        value = np.maximum(reach, 0).sum(axis=1) if criterion == "max" else reach.max(axis=1)
        best = min(best, float(value.min()))
        wrench = np.einsum("ki,dic,kic->kd", share.astype(float), maps, force)
        slope = wrench - value[:, None] * z
        z = z - slope * ((value - target) / np.maximum((slope**2).sum(axis=1), 1e-300))[:, None]
        z /= np.linalg.norm(z, axis=1, keepdims=True)
    return best


@dataclass(frozen=True)
class Turned:
    """A ring or a pinch of linearised cones in any pose, with the default tangents or others."""

    positions: np.ndarray
    normals: np.ndarray
    options: dict[str, Any]

    def grasp(self) -> gf.Grasp:
        """Build the grasp."""
        return gf.Grasp(self.positions, self.normals, **self.options)


def turned(count: int, seed: int = 11) -> Iterator[Turned]:
    """Yield pinches and rings of 3 to 8 contacts with 32 to 128 edges."""
    random = np.random.default_rng(seed)
    for k in range(count):
        edges = (32, 64, 128)[k % 3]
        torsion = float(random.choice([0.001, 0.005, 0.02])) if k % 2 == 0 else 0.0
        contacts = 2 if torsion else int(random.integers(3, 9))
        angles = 2 * np.pi * np.arange(contacts) / contacts
        outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        outward = outward @ (turn * np.linalg.det(turn)).T
        radius = float(random.choice([0.01, 0.04, 0.1]))
        shift = random.uniform(-0.05, 0.05, 3) * (random.random() < 0.3)
        options: dict[str, Any] = {
            "friction": float(random.choice([0.3, 0.5, 0.9])),
            "torsion": torsion,
            "edges": edges,
            "length_scale": float(random.choice([0.02, 0.1, 1.0])),
        }
        if random.random() < 0.5:
            options["tangents"] = random.normal(size=(contacts, 3))
        yield Turned(radius * outward + shift, -outward, options)


def shifted(count: int, seed: int = 12) -> Iterator[Turned]:
    """Yield soft contacts with true cones on solids and rings whose centre is not the torque origin."""
    random = np.random.default_rng(seed)
    tetrahedron = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    cube = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    for k in range(count):
        angles = 2 * np.pi * np.arange(3 + k % 6) / (3 + k % 6)
        ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
        directions = np.array((tetrahedron, cube, ring)[k % 3])
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        outward = directions / np.linalg.norm(directions, axis=1)[:, None] @ turn.T
        options = {
            "friction": float(random.choice([0.3, 0.5, 0.9])),
            "torsion": float(random.choice([0.0, 0.005, 0.02])),
            "edges": None,
            "length_scale": float(random.choice([0.02, 0.1, 1.0])),
            "origin": random.uniform(-0.05, 0.05, 3),
        }
        yield Turned(0.04 * outward, -outward, options)


def row_of_shifted(count: int) -> Row:
    """Compare the solids and rings off the torque origin."""
    missed = wrong = 0
    for case, criterion in asked(list(shifted(count))):
        grasp = case.grasp()
        q = grasp.quality(criterion)
        missed += q.upper - q.lower > WIDTH * -q.lower
        wrong += least_support(grasp, criterion, -q.upper, starts=100) < -q.upper * (1 - 1e-12)
    name = "solids and rings of true cones off the torque origin"
    return Row(name, 2 * count, "multi-start minimisation", missed, wrong)


def least_support_of_edges(grasp: gf.Grasp, criterion: str, target: float, starts: int = 20) -> float:
    """Bound epsilon from above as `least_support` does, for linearised cones."""
    wrenches = np.array(grasp.primitive_wrenches)
    wrenches[:, 3:] /= grasp.length_scale
    contacts = np.split(wrenches, np.cumsum(grasp.num_edges)[:-1])
    random = np.random.default_rng(1)
    z = random.standard_normal((starts, 6)) * random.choice([0.03, 1.0], (starts, 6))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    best = np.inf
    for _ in range(60):
        products = [z @ contact.T for contact in contacts]
        reach = np.stack([product.max(axis=1) for product in products], axis=1)
        points = np.stack([c[p.argmax(axis=1)] for c, p in zip(contacts, products, strict=True)], axis=1)
        share = (reach > 0) if criterion == "max" else (reach == reach.max(axis=1, keepdims=True))
        value = np.maximum(reach, 0).sum(axis=1) if criterion == "max" else reach.max(axis=1)
        best = min(best, float(value.min()))
        slope = np.einsum("ki,kid->kd", share.astype(float), points) - value[:, None] * z
        z = z - slope * ((value - target) / np.maximum((slope**2).sum(axis=1), 1e-300))[:, None]
        z /= np.linalg.norm(z, axis=1, keepdims=True)
    return best


def row_of_turned(count: int) -> Row:
    """Compare the turned grasps of linearised cones."""
    missed = wrong = 0
    for case, criterion in asked(list(turned(count))):
        grasp = case.grasp()
        q = grasp.quality(criterion)
        missed += q.upper - q.lower > WIDTH * -q.lower
        wrong += least_support_of_edges(grasp, criterion, -q.upper) < -q.upper * (1 - 1e-12)
    name = "pinches and rings of 32 to 128 edges, turned and shifted"
    return Row(name, 2 * count, "multi-start minimisation", missed, wrong)


def shared(cases: list[Any], share: float) -> list[Any]:
    """Every so-many-th case."""
    return cases[:: max(1, round(1 / share))]


def asked(cases: list[Any]) -> Iterator[tuple[Any, str]]:
    """Each case by both criteria."""
    return itertools.product(cases, ("max", "sum"))


def rows(share: float) -> list[Row]:
    """Brackets wider than `WIDTH` are missed; brackets without the oracle's value are wrong."""
    kept = shared(pinches(), share)
    table = []
    for name, noise in (("soft pinches", 0.0), ("soft pinches, noise 1e-9", NOISE)):
        missed = wrong = 0
        for pinch, criterion in asked(kept):
            q, truth = pinch.grasp(noise).quality(criterion), pinch.epsilon(criterion)
            slack = 1e-9 * truth + 10 * noise / min(1.0, pinch.length_scale)
            missed += q.upper - q.lower > WIDTH * -q.lower
            wrong += not -q.upper - slack <= truth <= -q.lower + slack
        table.append(Row(name, 2 * len(kept), "reduction to two unknowns", missed, wrong))
    some = shared(rings(), share)
    missed = wrong = 0
    for ring, criterion in asked(some):
        grasp = ring.grasp()
        q = grasp.quality(criterion)
        missed += q.upper - q.lower > WIDTH * -q.lower
        wrong += least_support(grasp, criterion, -q.upper) < -q.upper * (1 - 1e-12)
    table.append(Row("rings of 3 to 8 contacts", 2 * len(some), "multi-start minimisation", missed, wrong))
    table.append(row_of_turned(max(6, round(120 * share))))
    table.append(row_of_shifted(max(6, round(90 * share))))
    return table
