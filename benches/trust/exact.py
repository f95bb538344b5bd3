"""Quality in exact rational arithmetic, from positions and normals on; square roots to 40 digits.

Nothing here calls the library. A functional y on physical wrenches has the dual norm sqrt(y^T M^-1 y), and
epsilon is the least p(y) / |y| over all y: every y bounds epsilon from above, and a normal of the nearest
facet of the wrench set attains it.
"""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import TypeAlias

Vector: TypeAlias = list[Fraction]
Matrix: TypeAlias = list[Vector]

_DIGITS = 10**40


def root(x: Fraction) -> Fraction:
    """Return the square root to 40 digits of the number."""
    if x == 0:
        return x
    # Scaled by an even power of ten, so that tiny numbers keep their digits, too.
    power = max(0, 2 * (len(str(x.denominator)) - len(str(x.numerator))) + 2)
    scale = 10 ** (power // 2 * 2)
    return Fraction(math.isqrt(int(x * scale * _DIGITS**2)), _DIGITS * math.isqrt(scale))


def dot(a: Vector, b: Vector) -> Fraction:
    """Return the inner product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _unit(v: Vector) -> Vector:
    length = root(dot(v, v))
    return [x / length for x in v]


def _wrench(position: Vector, force: Vector) -> Vector:
    if len(position) == 2:
        return [*force, position[0] * force[1] - position[1] * force[0]]
    return [*force, *_cross(position, force)]


def wrenches(positions, normals, friction, limits, edges: int = 4, origin=None) -> list[list[Vector]]:
    """Eqs. 3 and 8 for 4 or 8 edges, contact by contact, with the library's default tangents."""
    centre = [Fraction(0)] * len(positions[0]) if origin is None else [Fraction(float(x)) for x in origin]
    half = root(Fraction(1, 2))
    circle = [(0, 1), (-1, 0), (0, -1), (1, 0)] if edges == 4 else [
        (half, half), (0, 1), (-half, half), (-1, 0), (-half, -half), (0, -1), (half, -half), (1, 0)
    ]  # fmt: skip
    found = []
    for row, normal, given, most in zip(positions, normals, friction, limits, strict=True):
        r, n = _less([Fraction(float(x)) for x in row], centre), _unit([Fraction(float(x)) for x in normal])
        mu, limit = Fraction(float(given)), Fraction(float(most))
        if len(r) == 2:
            t = [-n[1], n[0]]
            forces = [[a + s * mu * b for a, b in zip(n, t, strict=True)] for s in ((1, -1) if mu else (0,))]
        else:
            seed = [Fraction(k) for k in ((0, 1, 0) if abs(n[0]) > Fraction(0.7) else (1, 0, 0))]
            along = dot(n, seed)
            o = _unit([s - along * x for s, x in zip(seed, n, strict=True)])
            t = _cross(n, o)
            turns = circle if mu else [(0, 0)]
            forces = [[n[k] + mu * (c * o[k] + s * t[k]) for k in range(3)] for c, s in turns]
        found.append([_wrench(r, [limit * x for x in force]) for force in forces])
    return found


def support(sets: list[list[Vector]], criterion: str, y: Vector) -> Fraction:
    """Return p(y) of the wrench set."""
    best = [max(dot(w, y) for w in contact) for contact in sets]
    if criterion == "sum" or max(best) <= 0:
        return max(best)
    return sum((h for h in best if h > 0), Fraction(0))


def solve(matrix: Matrix, right: Vector) -> Vector | None:
    """Solve a square system; None where it is singular."""
    size = len(right)
    rows = [[*row, b] for row, b in zip(matrix, right, strict=True)]
    for step in range(size):
        pivot = next((k for k in range(step, size) if rows[k][step] != 0), None)
        if pivot is None:
            return None
        rows[step], rows[pivot] = rows[pivot], rows[step]
        top = rows[step]
        for k in range(size):
            if k != step and rows[k][step] != 0:
                factor = rows[k][step] / top[step]
                rows[k] = [x - factor * y for x, y in zip(rows[k], top, strict=True)]
    return [rows[k][size] / rows[k][k] for k in range(size)]


def inverse(matrix: Matrix) -> Matrix | None:
    """Return the inverse of a symmetric matrix; None where it is singular."""
    units = [[Fraction(int(i == k)) for i in range(len(matrix))] for k in range(len(matrix))]
    columns = [solve(matrix, unit) for unit in units]
    return None if any(column is None for column in columns) else [c for c in columns if c is not None]


def dual_norm(y: Vector, metric_inverse: Matrix) -> Fraction:
    """Return sqrt(y^T M^-1 y)."""
    return root(sum((a * dot(row, y) for a, row in zip(y, metric_inverse, strict=True)), Fraction(0)))


def planar_normals(sets: list[list[Vector]], criterion: str) -> list[Vector]:
    """Every normal that a facet of a planar wrench set can have."""
    if criterion == "sum":
        points = [w for contact in sets for w in contact]
        triples = itertools.combinations(points, 3)
        pairs = ([_less(b, a), _less(c, a)] for a, b, c in triples)
    else:
        edges = [w for contact in sets for w in contact]
        edges += [_less(a, b) for contact in sets for a, b in itertools.combinations(contact, 2)]
        pairs = (list(pair) for pair in itertools.combinations(edges, 2))
    normals = [_cross(a, b) for a, b in pairs]
    return [[s * x for x in y] for y in normals if any(y) for s in (1, -1)]


def _less(a: Vector, b: Vector) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def planar_epsilon(sets: list[list[Vector]], criterion: str, metric: Matrix) -> Fraction | None:
    """Return the exact epsilon of a planar grasp, outside minus the distance."""
    metric_inverse = inverse(metric)
    if metric_inverse is None:
        return None
    normals = planar_normals(sets, criterion)
    reach = [support(sets, criterion, y) for y in normals]
    points = [w for contact in sets for w in contact]
    spans = any(
        solve([list(a), list(b), list(c)], [Fraction(0)] * 3) for a, b, c in itertools.combinations(points, 3)
    )
    if normals and spans and min(reach) > 0:
        return min(p / dual_norm(y, metric_inverse) for p, y in zip(reach, normals, strict=True))
    return -distance(points, metric)


def distance(points: list[Vector], metric: Matrix) -> Fraction:
    """Return the distance of the hull from the origin, over all faces of at most d points."""
    size = len(metric)
    inner = [[dot(a, [dot(row, b) for row in metric]) for b in points] for a in points]
    best = min(inner[k][k] for k in range(len(points)))
    for count in range(2, size + 2):
        for chosen in itertools.combinations(range(len(points)), count):
            # The point of least norm in the affine hull: equal inner products with all of its points.
            rows = [[*(inner[a][b] for b in chosen), Fraction(-1)] for a in chosen]
            rows.append([*([Fraction(1)] * count), Fraction(0)])
            weights = solve(rows, [*([Fraction(0)] * count), Fraction(1)])
            if weights is not None and min(weights[:-1]) >= 0:
                best = min(best, weights[-1])
    return root(max(best, Fraction(0)))


def rational(matrix) -> Matrix:
    """Return the exact value of a matrix of floats, made symmetric."""
    exact = [[Fraction(float(x)) for x in row] for row in matrix]
    return [[(exact[i][k] + exact[k][i]) / 2 for k in range(len(exact))] for i in range(len(exact))]
