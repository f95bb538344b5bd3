"""Bounds of curvature by formula: no second difference exceeds them, and they come near to it."""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust import built_in_surfaces

import graspforce as gf
from graspforce._internal.taylor_intervals import TaylorIntervals
from graspforce.paper import RACKET, TILE
from graspforce.planning.contact_wrenches import ContactWrenches
from graspforce.planning.problem import SearchProblem
from graspforce.planning.wrench_curvature import FormulaCurvature
from graspforce.surfaces import (
    PlanarCurve,
    contacts_on,
    cylinder,
    ellipse,
    ellipsoid,
    line,
    mirrored,
    plane,
    tied,
)

SOLID = contacts_on(
    ellipsoid(0.05, 0.04, 0.03), cylinder(0.04), plane((0, 0, 0), (1, 0, 0), (0, 1, 1), object_side="along")
)


@pytest.mark.parametrize("width", [0.05, 0.005])
@pytest.mark.parametrize(
    ("surface", "bounds", "options"),
    [
        (RACKET["three fingers"].surface, RACKET["three fingers"].bounds, {"friction": 0.1}),
        (RACKET["four fingers"].surface, RACKET["four fingers"].bounds, {"friction": 0.2}),
        (TILE.surface, TILE.bounds, {"friction": 0.68, "edges": 10}),
        (SOLID, [(-3, 3), (-1.5, 1.5), (-3, 3), (-0.1, 0.1), (0, 1), (0, 1)], {"torsion": 0.01}),
        (mirrored(SOLID, (1, 2, 3)), [(-1, 1)] * 6, {"edges": None, "torsion": 0.02}),
        (tied(SOLID, np.ones((6, 2))), [(-1, 1)] * 2, {"edges": 6, "metric": np.diag([1, 2, 3, 4, 5, 6.0])}),
    ],
)
def test_no_second_difference_exceeds_the_formula(surface, bounds, options, width):
    options = dict(options)
    metric = options.pop("metric", None)
    problem = SearchProblem.of(
        gf.plan_global,
        surface,
        options,
        None,
        0.0,
        criterion="max",
        rtol=None,
        metric=metric,
        external_wrench=None,
    )
    low, high = np.array(bounds, dtype=float).T
    wrenches = ContactWrenches(problem, (low + high) / 2)
    curvature = FormulaCurvature.of(surface, wrenches, low, high)
    random = np.random.default_rng(0)
    centers = random.uniform(low, high, (15, len(low)))
    lower, upper = np.maximum(centers - width / 2, low), np.minimum(centers + width / 2, high)
    contacts = np.arange(wrenches.num_contacts)
    for axis in range(len(low)):
        found = curvature.over(lower, upper, contacts, np.array([axis]))
        half = (upper - lower)[:, axis, None] / 2
        step = 2e-2 * half.min()
        frames = list(zip(found.seeds, found.needs.T, strict=True)) or [(None, np.ones(15, dtype=bool))]
        for seed, use in frames:
            places = random.uniform(lower, upper)
            places[:, axis] = np.clip(places[:, axis], lower[:, axis] + step, upper[:, axis] - step)
            move = np.eye(len(low))[axis] * step
            before, here, after = (wrenches.columns(places + k * move, contacts, seed) for k in (-1, 0, 1))
            second = (before - 2 * here + after) / step**2
            for contact in contacts:
                samples = wrenches._samples(contact)
                departs = np.linalg.norm(second[:, contact] @ samples.T, axis=1).max(axis=1)
                largest = found.each[:, contact] / (0.5 * half[:, 0] ** 2)
                assert (departs[use] <= largest[use] * (1 + 1e-3) + 1e-4).all()


@pytest.mark.parametrize("seed", range(6))
def test_every_built_in_surface_is_proven_and_never_below_a_dense_sampling(seed):
    assert built_in_surfaces.judged(seed, time_limit=10.0) != "wrong"


def test_functions_of_the_caller_are_estimates():
    rim = PlanarCurve(
        lambda s: np.stack([np.cos(s), np.sin(s)], axis=-1),
        lambda s: np.stack([-np.sin(s), np.cos(s)], axis=-1),
    )
    surface = contacts_on(rim, ellipse(1, 1))
    assert not surface.has_formulas
    assert not gf.plan_global(surface, [(0, 1), (2, 5)], friction=0.5).proven
    assert gf.plan_global(contacts_on(ellipse(1, 1), ellipse(1, 1)), [(0, 1), (2, 5)], friction=0.5).proven


def test_a_function_may_bound_the_curvature_of_each_box():
    def curvature(low, high):
        assert (low <= high).all()
        return np.broadcast_to(np.eye(2) * np.hypot(1, 0.5), (len(low), 2, 2))

    circle = contacts_on(ellipse(1, 1), ellipse(1, 1))
    found = gf.plan_global(circle, [(0, 1), (2, 5)], friction=0.5, curvature=curvature)
    assert (found.stopped, found.proven) == ("tolerance", True)
    with pytest.raises(gf.InvalidInputError, match=r"curvature: shape \(1, 1\), expected"):
        gf.plan_global(circle, [(0, 1), (2, 5)], curvature=lambda *_: np.zeros((1, 1)))


def test_intervals_hold_what_functions_do():
    random = np.random.default_rng(1)
    low = random.uniform(-2, 2, (200, 2))
    high = low + 10 ** random.uniform(-3, 0.5, (200, 2))

    def function(x):
        a, b = x.T
        vector = np.stack([np.sin(a) * b - 2, np.cos(a - b) ** 3, 1.5 - a**2 + 0 * b], axis=-1)
        length = (vector**2) @ np.ones(3)
        return np.concatenate([vector, length[:, None], (vector @ np.array([[1.0], [-2.0], [0.5]]))], axis=1)

    found = function(TaylorIntervals.on_line(low, high, np.array([1.0, -0.5])))
    for _ in range(20):
        x, h = random.uniform(low, high), 1e-4 * np.array([1.0, -0.5])
        value, before, after = function(x), function(x - h), function(x + h)
        for order, exact in enumerate((value, (after - before) / 2e-4, (after - 2 * value + before) / 1e-8)):
            slack = (1e-9, 1e-5, 1e-3)[order] * (1 + np.abs(exact))
            assert (found.low[order] - slack <= exact).all()
            assert (exact <= found.high[order] + slack).all()


def test_a_line_has_no_curvature():
    surface = contacts_on(line((0, 0), (1, 0), object_side="left"), line((0, 1), (1, 0), object_side="right"))
    found = gf.plan_global(surface, [(0, 1), (0, 1)], friction=0.5)
    assert found.proven
    assert (
        found.epsilon_upper >= gf.Grasp([(0, 0), (0, 1)], [(0, 1), (0, -1)], friction=0.5).quality().epsilon
    )
