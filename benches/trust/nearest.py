"""Nearest forces of a million wrenches on a thousand grasps, half of them infeasible or beyond the limits.

Every residual is certified: its own direction proves that no other forces come nearer. A sample is compared
with Clarabel.
"""

from __future__ import annotations

import itertools
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import clarabel
import numpy as np
from benches.trust.row import Row
from scipy import sparse

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

GRASPS, WRENCHES, PROVEN, SAMPLED = 1000, 1000, 100, 5
"""Grasps, wrenches on each, of how many of them the gap counts, and how many of them Clarabel is asked."""

GAP = 1e-9
"""Largest gap that counts as proven."""

CERTIFIED = 2e-9
"""Largest distance between the residual and what its direction proves, relative to the wrench."""

AGREE = 1e-6
"""Largest difference from Clarabel's distance, relative to the wrench."""

OBJECTIVES = ("max", "sum", "squares")


def contact_points(rng: np.random.Generator, kind: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and inward normals: scattered, symmetric, pinching, in a line, or planar."""
    count = int(rng.integers(2, 7))
    if kind == 0:
        outward = rng.normal(size=(count, 3))
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        axes = np.array([1.0, 0.8, 1.3])
        return outward * axes, -outward / axes
    if kind == 1:
        angle = 2.0 * np.pi * np.arange(count) / count
        ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
        return ring, -ring
    if kind == 2:
        sides = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])[:count]
        return sides, -sides
    if kind == 3:
        return np.outer(rng.normal(size=count), [1.0, 0.0, 0.0]), np.tile([0.0, 0.0, 1.0], (count, 1))
    outward = rng.normal(size=(count, 2))
    return outward, -outward + 0.3 * rng.normal(size=(count, 2))


def grasps(count: int, seed: int) -> Iterator[tuple[np.random.Generator, gf.Grasp]]:
    """Yield hard and soft fingers with true cones and pyramids."""
    rng = np.random.default_rng(seed)
    for turn in range(count):
        positions, normals = contact_points(rng, turn % 5)
        options: dict[str, Any] = {}
        if positions.shape[1] == 3:
            options["edges"] = None if turn % 2 else int(rng.integers(4, 10))
            if turn % 3 == 0:
                options["torsion"] = rng.uniform(0.02, 0.2)
        friction = rng.uniform(0.1, 0.9, len(positions)) if turn % 7 else 0.0
        limits = 10.0 ** rng.uniform(-0.5, 0.5, len(positions))
        scale = float(rng.choice([0.2, 1.0, 3.0]))
        options |= {"friction": friction, "max_normal_force": limits, "length_scale": scale}
        with warnings.catch_warnings():
            # A few planar grasps press from inside.
            warnings.simplefilter("ignore", gf.GraspWarning)
            grasp = gf.Grasp(positions, normals, **options)
        yield rng, grasp


def half_beyond(rng: np.random.Generator, grasp: gf.Grasp, count: int) -> np.ndarray:
    """Return wrenches: every other one can be balanced within the limits, if any direction can."""
    d = grasp.wrench_dim
    wrenches = rng.normal(size=(count, d))
    # What contacts exert can be balanced; a direction that nothing balances gets one of these instead.
    forces = inside_cones(rng, grasp, count)
    wrenches[::2] = -np.einsum("dk,ck->cd", grasp.grasp_matrix, forces.reshape(count, -1))[::2]
    beyond = wrenches[1::2]
    length = np.linalg.norm(wrenches[::2]) / np.sqrt(len(wrenches[::2]))
    beyond *= length * 10.0 ** rng.uniform(0.0, 1.0, (len(beyond), 1))
    return wrenches


def inside_cones(rng: np.random.Generator, grasp: gf.Grasp, count: int) -> np.ndarray:
    """Return forces well within cones and limits, (count, m, k)."""
    m, k = grasp.num_contacts, grasp.force_dim
    forces = np.zeros((count, m, k))
    normal = rng.uniform(0.05, 0.9, (count, m)) * grasp.max_normal_force
    forces[..., 0] = normal
    if k == 2:
        forces[..., 1] = normal * grasp.friction * rng.uniform(-0.9, 0.9, (count, m))
        return forces
    # A square inside the circle of half the friction, and a pyramid of four edges holds it, too.
    forces[..., 1:3] = (normal * grasp.friction)[..., None] * rng.uniform(-0.3, 0.3, (count, m, 2))
    if k == 4:
        forces[..., 3] = normal * grasp.torsion * rng.uniform(-0.3, 0.3, (count, m))
    return forces


@dataclass
class Geometry:
    """What the oracle needs of a grasp: its limits, its norm and its furthest forces."""

    grasp: gf.Grasp

    @property
    def scale(self) -> np.ndarray:
        """Return the diagonal that makes the norm Euclidean."""
        d = self.grasp.wrench_dim
        return np.where(np.arange(d) < (3 if d == 6 else 2), 1.0, 1.0 / self.grasp.length_scale)

    def reach(self, z: np.ndarray) -> np.ndarray:
        """Return how far forces within the limits reach along each row of z."""
        grasp = self.grasp
        if (grasp.num_edges > 0).all():
            pushes = z @ grasp.primitive_wrenches.reshape(-1, grasp.wrench_dim).T
            ends = np.cumsum(grasp.num_edges)[:-1]
            return sum(np.maximum(part.max(axis=1), 0.0) for part in np.split(pushes, ends, axis=1))
        h = (z @ grasp.grasp_matrix).reshape(len(z), grasp.num_contacts, grasp.force_dim)
        slope = (grasp.friction * np.linalg.norm(h[..., 1:3], axis=2)) ** 2
        if grasp.force_dim == 4:
            slope += (grasp.torsion * h[..., 3]) ** 2
        return (grasp.max_normal_force * np.maximum(h[..., 0] + np.sqrt(slope), 0.0)).sum(axis=1)

    def certified(
        self, wrenches: np.ndarray, forces: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return distances, the bounds that their directions prove, and the norms of the wrenches."""
        residual = wrenches + forces.reshape(len(forces), -1) @ self.grasp.grasp_matrix.T
        distance = np.linalg.norm(residual * self.scale, axis=1)
        size = np.linalg.norm(wrenches * self.scale, axis=1)
        z = -residual * self.scale**2 / np.maximum(distance, 1e-300)[:, None]
        lower = -(wrenches * z).sum(axis=1) - self.reach(z)
        # Of a distance of rounding the direction says nothing.
        lower[distance <= CERTIFIED * size] = 0.0
        return distance, lower, size

    def outside(self, forces: np.ndarray) -> np.ndarray:
        """Return how far the forces of each row break limits or round cones, relative to the limits."""
        grasp = self.grasp
        normal = forces[..., 0]
        load = np.linalg.norm(forces[..., 1:3], axis=2) - grasp.friction * normal
        if grasp.force_dim == 4:
            slip = np.linalg.norm(forces[..., 1:3], axis=2) / np.maximum(grasp.friction, 1e-12)
            twist = np.abs(forces[..., 3]) / np.maximum(grasp.torsion, 1e-12)
            load = np.where(grasp.friction > 0, np.hypot(slip, twist) - normal, load)
        worst = np.maximum(np.maximum(load, -normal), normal - grasp.max_normal_force)
        return (worst / grasp.max_normal_force).max(axis=1)


def clarabel_distance(grasp: gf.Grasp, wrench: np.ndarray) -> float | None:
    """Ask Clarabel for the least distance within the limits; None where it finds none."""
    scale = Geometry(grasp).scale
    size = np.linalg.norm(scale * wrench)
    m, k, limits = grasp.num_contacts, grasp.force_dim, grasp.max_normal_force
    if (grasp.num_edges > 0).all():
        maps = grasp.primitive_wrenches.reshape(-1, grasp.wrench_dim).T
        n = maps.shape[1]
        owner = np.repeat(np.arange(m), grasp.num_edges)
        rows = [-np.eye(n), (owner == np.arange(m)[:, None]).astype(float)]
        right = [np.zeros(n), np.ones(m)]
        cones = [clarabel.NonnegativeConeT(n), clarabel.NonnegativeConeT(m)]
    else:
        maps, n = grasp.grasp_matrix * np.repeat(limits, k), m * k
        rows, right, cones = [np.eye(n)[::k]], [np.ones(m)], [clarabel.NonnegativeConeT(m)]
        for i in range(m):
            mu, gamma = grasp.friction[i], (grasp.torsion[i] if k == 4 else 0.0)
            # mu gamma f_n >= |(gamma f_o, gamma f_t, mu f_torsion)|, without divisions.
            weights = [mu * gamma, gamma, gamma, mu] if gamma > 0 else [mu, 1.0, 1.0, 1.0][:k]
            rows.append(-np.diag(weights) @ np.eye(n)[k * i : k * i + k])
            right.append(np.zeros(k))
            cones.append(clarabel.SecondOrderConeT(k))
            rows.append(-np.eye(n)[k * i : k * i + 1])
            right.append(np.zeros(1))
            cones.append(clarabel.NonnegativeConeT(1))
    d = grasp.wrench_dim
    # The residual is a variable of its own: its square would lose half of the digits.
    quadratic = np.r_[np.zeros(n), np.ones(d)]
    balance = np.hstack([scale[:, None] * maps / size, -np.eye(d)])
    rows = [balance, *(np.hstack([row, np.zeros((len(row), d))]) for row in rows)]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix(np.diag(quadratic)),
        np.zeros(n + d),
        sparse.csc_matrix(np.vstack(rows)),
        np.concatenate([-scale * wrench / size, *right]),
        [clarabel.ZeroConeT(d), *cones],
        settings,
    )
    found = solver.solve()
    if str(found.status) not in {"Solved", "AlmostSolved"}:
        return None
    return float(np.linalg.norm(np.array(found.x)[n:])) * size


def rows(share: float) -> list[Row]:
    """Return the row of the certificates and the row of the sample."""
    count, wrenches = max(15, round(share * GRASPS)), WRENCHES if share >= 0.1 else 100
    asked = beyond = missed = wrong = unproven = sampled = unanswered = contradicted = 0
    for (rng, grasp), objective in zip(grasps(count, 11), itertools.cycle(OBJECTIVES), strict=False):
        geometry, external = Geometry(grasp), half_beyond(rng, grasp, wrenches)
        options = {"limits": True} if objective == "squares" else {}
        distributor = gf.ForceDistributor(grasp, objective, **options)
        batch = distributor.solve_many(external, infeasible="nearest")
        forces = np.asarray(batch.forces)
        distance, lower, size = geometry.certified(external, forces)
        asked += wrenches
        missed += int((batch.status != gf.Status.SOLVED).sum())
        unproven += sum(not distributor.nearest(wrench).gap <= GAP for wrench in external[:PROVEN])
        beyond += int((distance > 1e-7 * size).sum())
        far = ~(distance - lower <= CERTIFIED * size)
        wrong += int((far | ~(geometry.outside(forces) <= 1e-8)).sum())
        for k in rng.integers(0, wrenches, SAMPLED):
            theirs = clarabel_distance(grasp, external[k])
            sampled += 1
            unanswered += theirs is None
            contradicted += theirs is not None and not abs(distance[k] - theirs) <= AGREE * size[k]
    family = f"nearest forces, {count:,} grasps, {beyond:,} wrenches infeasible or beyond limits"
    proven = "the same, a gap of the least forces of 1e-9"
    sample = f"the same, sampled ({unanswered} without Clarabel's answer)"
    return [
        Row(family, asked, "the residual's direction", missed, wrong),
        Row(proven, count * PROVEN, "duality", unproven, 0),
        Row(sample, sampled, "Clarabel", 0, contradicted),
    ]
