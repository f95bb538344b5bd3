"""Least distances and least objectives of contact forces by an interior-point method in 90 digits.

Nothing here calls the library. Newton's method follows the central path of
``min t objective(x) - log(D^2 - |A x + w|^2) - sum log(slacks of x)``, or of half the squared distance in
place of objective and ball. The slacks are those of cones, pyramids and limits, contact by contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mpmath
import numpy as np

if TYPE_CHECKING:
    import graspforce as gf

DIGITS = 90

LAST = mpmath.mpf(10) ** 34
"""How much the weight of the objective grows along the path."""

FASTER = 20
"""The factor between two weights."""

MAX_STEPS = 500


class UndecidedError(Exception):
    """The path did not end within the steps allowed."""


def exact(array: np.ndarray) -> np.ndarray:
    """Return the same numbers with 90 digits."""
    return np.vectorize(mpmath.mpf, otypes=[object])(np.asarray(array, float))


def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve a positive definite system by elimination."""
    a, x = matrix.copy(), right.copy()
    n = len(a)
    for k in range(n):
        for r in range(k + 1, n):
            by = a[r, k] / a[k, k]
            if by:
                a[r, k:] -= by * a[k, k:]
                x[r] -= by * x[k]
    for k in reversed(range(n)):
        x[k] = (x[k] - a[k, k + 1 :] @ x[k + 1 :]) / a[k, k]
    return x


def solve_near_diagonal(diagonal: np.ndarray, columns: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve with the matrix ``diag(diagonal) + columns @ columns.T``."""
    scaled, lifted = columns / diagonal[:, None], right / diagonal[:, None]
    inner = np.diag(exact(np.ones(columns.shape[1]))) + columns.T @ scaled
    return lifted - scaled @ solve(inner, columns.T @ lifted)


@dataclass
class Contact:
    """Unknowns of a contact: the force in its cone, or coefficients of extreme forces."""

    forces: np.ndarray
    """(k, n) the force of each unknown."""
    share: np.ndarray
    """(n,) the share of each unknown."""
    cone: np.ndarray | None
    """(n,) the diagonal of the form that is positive in the cone, or None for coefficients."""
    weight: mpmath.mpf

    def start(self) -> np.ndarray:
        """Return a point inside."""
        n = len(self.share)
        if self.cone is None:
            return np.array([mpmath.mpf(1) / (2 * n)] * n, dtype=object)
        return np.array([1 / (2 * self.share[0]), *[mpmath.mpf(0)] * (n - 1)], dtype=object)

    def slacks(self, x: np.ndarray) -> list[mpmath.mpf]:
        """Return what has to stay positive."""
        if self.cone is None:
            return [*x, 1 - self.share @ x]
        return [x[0], x @ (self.cone * x), 1 - self.share @ x]

    def barrier(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the gradient of the barrier, and its Hessian: a diagonal, and columns that are squared."""
        limit = self.share / (1 - self.share @ x)
        if self.cone is None:
            return limit - 1 / x, 1 / x**2, limit[:, None]
        form = x @ (self.cone * x)
        slope = 2 * self.cone * x / form
        return limit - slope, -2 * self.cone / form, np.stack([limit, slope], axis=1)

    def solve(self, diagonal: np.ndarray, columns: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Solve with a Hessian."""
        if self.cone is None:
            return solve_near_diagonal(diagonal, columns, right)
        return solve(np.diag(diagonal) + columns @ columns.T, right)


class Barrier:
    """A grasp with an external wrench."""

    def __init__(self, grasp: gf.Grasp, wrench: np.ndarray, objective: str, options: dict) -> None:
        mpmath.mp.dps = DIGITS
        m, k, d = grasp.num_contacts, grasp.force_dim, grasp.wrench_dim
        self.objective = objective
        self.of_sum = mpmath.mpf(1 if objective == "sum" else options.get("weight", 0.0))
        weights = np.broadcast_to(options.get("weights", 1.0), m)
        length = np.where(np.arange(d) < (3 if d == 6 else 2), 1.0, 1.0 / grasp.length_scale)
        self.scale = exact(length)
        self.wrench = exact(wrench) * self.scale
        maps = (exact(grasp.grasp_matrix) * self.scale[:, None]).reshape(d, m, k)
        self.contacts: list[Contact] = []
        first = np.concatenate([[0], np.cumsum(grasp.num_edges)])
        for i in range(m):
            if grasp.num_edges[i] > 0:
                forces = exact(grasp.extreme_forces[first[i] : first[i + 1], :k]).T
                share, cone = exact(np.ones(forces.shape[1])), None
            else:
                scales = (
                    [grasp.friction[i]] * 2 + [grasp.torsion[i]] if k == 4 else [grasp.friction[i]] * (k - 1)
                )
                moves = [0, *(j + 1 for j, s in enumerate(scales) if s > 0)]
                forces = exact(np.eye(k)[:, moves])
                share = np.array(
                    [1 / mpmath.mpf(grasp.max_normal_force[i]), *[mpmath.mpf(0)] * (len(moves) - 1)]
                )
                cone = np.array([mpmath.mpf(1), *(-1 / mpmath.mpf(scales[j - 1]) ** 2 for j in moves[1:])])
            self.contacts.append(Contact(forces, share, cone, mpmath.mpf(float(weights[i]))))
        self.maps = [maps[:, i] @ contact.forces for i, contact in enumerate(self.contacts)]

    def residual(self, xs: list[np.ndarray]) -> np.ndarray:
        """Return what the forces leave, where the metric is Euclidean."""
        return self.wrench + sum(a @ x for a, x in zip(self.maps, xs, strict=True))

    def value(self, xs: list[np.ndarray]) -> mpmath.mpf:
        """Return the objective."""
        shares = [c.share @ x for c, x in zip(self.contacts, xs, strict=True)]
        if self.objective == "squares":
            pairs = zip(self.contacts, xs, strict=True)
            return sum(c.weight / 2 * sum(f * f for f in c.forces @ x) for c, x in pairs)
        return self.of_sum * sum(shares) + (max(shares) if self.objective == "max" else 0)

    def step(self, xs, t, top, ball):
        """One damped step of Newton's method; also its decrement."""
        r, d = self.residual(xs), len(self.wrench)
        eye = np.diag(exact(np.ones(d)))
        if ball is None:
            outer, pull = eye / t, t * r
        else:
            q = ball - r @ r
            pull = 2 * r / q
            outer = solve(2 * eye / q + np.outer(pull, pull), eye)
        blocks, rights, schur, moved, border, corner, slope = [], [], outer, 0, [], 0, 0
        for c, a, x in zip(self.contacts, self.maps, xs, strict=True):
            g, diagonal, squares = c.barrier(x)
            cross = None
            if ball is not None:
                if self.objective == "squares":
                    g = g + t * c.weight * c.forces.T @ (c.forces @ x)
                    squares = np.concatenate([squares, mpmath.sqrt(t * c.weight) * c.forces.T], axis=1)
                else:
                    g = g + t * self.of_sum * c.share
                if self.objective == "max":
                    by = 1 / (top - c.share @ x)
                    g, squares = g + by * c.share, np.concatenate([squares, by * c.share[:, None]], axis=1)
                    cross, corner, slope = -(by**2) * c.share, corner + by**2, slope - by
            g = g + a.T @ pull
            columns = [a.T, g[:, None]] + ([] if cross is None else [cross[:, None]])
            found = c.solve(diagonal, squares, np.concatenate(columns, axis=1))
            blocks.append(found)
            rights.append(g)
            border.append(cross)
            schur = schur + a @ found[:, :d]
            moved = moved + a @ found[:, d:]
        lifted = solve(schur, moved)
        # Columns of the inverse of all blocks times gradient, and times border.
        solved = [b[:, d:] - b[:, :d] @ lifted for b in blocks]
        raised = mpmath.mpf(0)
        if self.objective == "max" and ball is not None:
            slope = slope + t
            known = sum(c @ s[:, 1] for c, s in zip(border, solved, strict=True))
            right = slope - sum(c @ s[:, 0] for c, s in zip(border, solved, strict=True))
            raised = -right / (corner - known)
            moves = [-s[:, 0] - raised * s[:, 1] for s in solved]
        else:
            moves = [-s[:, 0] for s in solved]
        decrement = -sum(g @ move for g, move in zip(rights, moves, strict=True)) - slope * raised
        decrement = mpmath.sqrt(abs(decrement))
        by = 1 if decrement < mpmath.mpf("0.25") else 1 / (1 + decrement)
        moved_to = [x + by * move for x, move in zip(xs, moves, strict=True)]
        return moved_to, top + by * raised, decrement

    def follow(self, xs, t, last, top=0, ball=None, *, until=None):
        """Follow the path to its end, or until the forces are nearer than asked for."""
        for _ in range(MAX_STEPS):
            xs, top, decrement = self.step(xs, t, top, ball)
            if decrement < mpmath.mpf("0.3"):
                r = self.residual(xs)
                if until is not None and r @ r < until:
                    return xs, t
                if t >= last:
                    return xs, t
                t *= FASTER
        raise UndecidedError

    def reach(self, z: np.ndarray) -> list[mpmath.mpf]:
        """Return how far each contact reaches along z within its limit."""
        found = []
        for c, a in zip(self.contacts, self.maps, strict=True):
            h = a.T @ z
            if c.cone is None:
                found.append(max(h))
            else:
                tangential = sum(x * x / -by for x, by in zip(h[1:], c.cone[1:], strict=True))
                found.append((h[0] + mpmath.sqrt(tangential)) / c.share[0])
        return found

    def distance(self) -> tuple[mpmath.mpf, mpmath.mpf]:
        """Return proven bounds of the least distance."""
        size = self.wrench @ self.wrench
        xs = [c.start() for c in self.contacts]
        r = self.residual(xs)
        xs, _ = self.follow(xs, 1 / (r @ r), LAST / size)
        r = self.residual(xs)
        upper = mpmath.sqrt(r @ r)
        along = r @ self.wrench - sum(max(p, 0) for p in self.reach(-r))
        lower = max(along / upper, mpmath.mpf(0))
        return lower, upper

    def least(self, distance: mpmath.mpf) -> tuple[mpmath.mpf, mpmath.mpf] | None:
        """Return proven bounds of the least objective within a distance; None if no forces lie inside."""
        size = self.wrench @ self.wrench
        ball = distance**2
        xs = [c.start() for c in self.contacts]
        r = self.residual(xs)
        xs, _ = self.follow(xs, 1 / (r @ r), LAST / size, until=ball)
        r = self.residual(xs)
        if not r @ r < ball:
            return None
        shares = [c.share @ x for c, x in zip(self.contacts, xs, strict=True)]
        top = max(shares) + 1
        value = self.value(xs)
        xs, t = self.follow(xs, 1 / value, LAST / value, top, ball)
        r = self.residual(xs)
        z = -2 * r / (ball - r @ r) / t
        return self.proven(z, distance, xs), self.value(xs)

    def proven(self, z: np.ndarray, distance: mpmath.mpf, xs: list[np.ndarray]) -> mpmath.mpf:
        """Return the objective that a multiplier proves of all forces within the distance."""
        base = -(z @ self.wrench) - mpmath.sqrt(z @ z) * distance
        if self.objective == "squares":
            for c, a, x in zip(self.contacts, self.maps, xs, strict=True):
                # The gradient at x bounds the convex cost of the contact from below.
                f = c.forces @ x
                slope = c.weight * (c.forces.T @ f) - a.T @ z
                base += c.weight / 2 * (f @ f) - c.weight * (f @ f)
                base += min(mpmath.mpf(0), -self.support(c, -slope))
            return base
        gains = sum(max(p - self.of_sum, 0) for p in self.reach(z))
        return base - (max(gains - 1, 0) if self.objective == "max" else gains)

    def support(self, contact: Contact, h: np.ndarray) -> mpmath.mpf:
        """Return how far the unknowns of a contact reach along h within its limit."""
        if contact.cone is None:
            return max(h)
        tangential = sum(x * x / -by for x, by in zip(h[1:], contact.cone[1:], strict=True))
        return (h[0] + mpmath.sqrt(tangential)) / contact.share[0]
