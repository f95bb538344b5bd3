"""Wrenches of very different lengths: the distance from the origin is still the distance."""

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest

import graspforce as gf

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")  # contacts are drawn at random


def exact_distance(points):
    """Return the distance of the origin from the hull of points, in rational arithmetic.

    The nearest point lies in the relative interior of some simplex of the points, and is the nearest of
    that simplex's affine hull; every such point with nonnegative weights belongs to the hull, so the least
    of them is the nearest.
    """
    exact = [[Fraction(x) for x in point] for point in points]
    best = None
    for size in range(1, len(exact[0]) + 1):
        for corners in combinations(exact, size):
            weights = nearest_weights(corners)
            if weights is None or min(weights) < 0:
                continue
            rows = zip(*corners, strict=True)
            square = sum(sum(w * x for w, x in zip(weights, row, strict=True)) ** 2 for row in rows)
            best = square if best is None else min(best, square)
    return float(best) ** 0.5


def nearest_weights(corners):
    """Return the barycentric weights of an affine hull's point nearest to the origin, if they are unique."""
    base, *others = corners
    edges = [[x - b for x, b in zip(other, base, strict=True)] for other in others]
    table = [[dot(a, b) for b in edges] + [-dot(a, base)] for a in edges]
    for column in range(len(edges)):
        pivot = next((row for row in range(column, len(edges)) if table[row][column]), None)
        if pivot is None:
            return None
        table[column], table[pivot] = table[pivot], table[column]
        table[column] = [x / table[column][column] for x in table[column]]
        for row in range(len(edges)):
            if row != column:
                table[row] = [
                    x - table[row][column] * y for x, y in zip(table[row], table[column], strict=True)
                ]
    weights = [row[-1] for row in table]
    return [1 - sum(weights), *weights]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("decades", [0, 3, 8, 16, 40, 110])
def test_the_bracket_of_an_open_grasp_contains_the_exact_distance_however_limits_spread(decades, dim):
    rng = np.random.default_rng(decades)
    outside = 0
    for _ in range(60 if dim == 2 else 8):
        count = rng.integers(2, 5 if dim == 2 else 4)
        positions = rng.normal(size=(count, dim))
        normals = rng.normal(size=(count, dim))
        normals[:, 0] += 1.5
        limits = 10.0 ** rng.uniform(-decades, decades, count)
        friction = rng.uniform(0, 0.6, count)
        grasp = gf.Grasp(positions, normals, friction=friction, max_normal_force=limits, edges=3)
        quality = grasp.quality(rng.choice(["max", "sum"]))
        if quality.rho <= 0:
            continue
        outside += 1
        distance = exact_distance(grasp.primitive_wrenches)
        rounding = 1e-9 * distance
        assert quality.lower - rounding <= distance <= quality.upper + rounding
        assert quality.converged
    assert outside >= (20 if dim == 2 else 4)


def exact_radius(points):
    """Return the radius of the largest ball about the origin in the hull of points in space.

    The hull's facets are the planes through three points that have all others on one side.
    """
    exact = [[Fraction(x) for x in point] for point in points]
    best = None
    for a, b, c in combinations(exact, 3):
        u, v = ([x - y for x, y in zip(other, a, strict=True)] for other in (b, c))
        normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        if not any(normal):
            continue
        heights = [dot(normal, point) - dot(normal, a) for point in exact]
        if min(heights) >= 0 or max(heights) <= 0:
            square = dot(normal, a) ** 2 / dot(normal, normal)
            best = square if best is None else min(best, square)
    return float(best) ** 0.5


@pytest.mark.parametrize("decades", [0, 2, 4, 6, 8, 12])
def test_the_bracket_of_a_closed_grasp_contains_the_exact_radius_however_limits_and_levers_spread(decades):
    rng = np.random.default_rng(decades)
    inside, converged = 0, 0
    for _ in range(60):
        count = rng.integers(3, 5)
        positions = rng.normal(size=(count, 2)) * 10.0 ** rng.uniform(-decades / 4, decades / 4, (count, 1))
        normals = (
            -positions + rng.normal(size=(count, 2)) * np.linalg.norm(positions, axis=1, keepdims=True) / 3
        )
        limits = 10.0 ** rng.uniform(-decades / 2, decades / 2, count)
        grasp = gf.Grasp(positions, normals, friction=0.6, max_normal_force=limits)
        quality = grasp.quality("sum")
        if quality.closure != "force":
            continue
        inside += 1
        converged += quality.converged
        radius = exact_radius(grasp.primitive_wrenches)
        rounding = 1e-9 * radius + 1e-14 * np.abs(grasp.primitive_wrenches).max()
        assert -quality.upper - rounding <= radius <= -quality.lower + rounding
    assert inside >= 15
    assert converged >= 0.8 * inside
