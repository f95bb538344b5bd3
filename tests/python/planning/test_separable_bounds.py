"""Bounds of contacts with parameters of their own.

The full run is `python -m benches.trust separable_bounds`.
"""

from __future__ import annotations

import numpy as np
import pytest
from benches.trust.separable_bounds import judged

import graspforce as gf
from graspforce._core import ProductBound
from graspforce.planning.contact_groups import contact_groups
from graspforce.planning.contact_wrenches import ContactWrenches
from graspforce.planning.problem import SearchProblem
from graspforce.surfaces import contacts_on, ellipse, ellipsoid, mirrored, tied

EGG = ellipsoid(0.05, 0.04, 0.03)
RIM = ellipse(0.05, 0.03)


@pytest.mark.parametrize("seed", range(6))
def test_no_sampled_grasp_exceeds_a_proven_bound(seed):
    assert judged(seed) == "right"


@pytest.mark.parametrize("criterion", ["max", "sum"])
@pytest.mark.parametrize(
    "options",
    [
        {"edges": 6},
        {"edges": None},
        {"edges": None, "torsion": 0.01, "friction_margin": 1.3},
        {"edges": 8, "torsion": [0.01, 0, 0.02, 0.01], "max_normal_force": [1, 2, 3, 4]},
        {"edges": 6, "metric": np.diag([1, 2, 3, 900, 400, 600.0]), "origin": (0.01, 0, 0)},
        {"edges": 6, "external_wrench": [0, 0, -0.1, 0, 0.001, 0]},
        {"planar": True, "friction_margin": 1.2},
    ],
    ids=str,
)
def test_a_product_of_cells_without_width_has_the_quality_of_its_grasp(options, criterion):
    options = dict(options)
    place = RIM if options.pop("planar", False) else EGG
    surface = contacts_on(*[place] * 4)
    quality = {name: options.pop(name, None) for name in ("metric", "external_wrench")}
    given = {"friction": [0.6, 0.5, 0.7, 0.6], "length_scale": 0.04, **options}
    problem = SearchProblem.of(
        gf.plan_global, surface, given, None, 0.0, criterion=criterion, rtol=None, **quality
    )
    params = np.random.default_rng(4).uniform(-3, 3, (40, surface.num_params)) * 0.5 ** (place is EGG)
    wrenches = ContactWrenches(problem, params[0])
    closed = 0
    for row in params:
        _, found = problem.answer(row)
        if found.epsilon <= 0:
            continue
        closed += 1
        contacts = [np.array([i]) for i in range(4)]
        forces = [wrenches.force_sets(one) for one in contacts]
        bound = ProductBound(2 + wrenches.is_spatial, criterion, forces, wrenches.center)
        for group, one in enumerate(contacts):
            bound.plant(group, [-1], [0, 1], [0], [0.0], wrenches.columns(row[None], one))
        z = wrenches.critical_directions(row[None])
        assert bound.learn(z) == 1
        # Along its critical direction the product reaches as far as the grasp.
        bound.descend(0.0, 100, 10.0)
        assert bound.top == pytest.approx(found.epsilon_upper, rel=2e-3, abs=1e-6)
        assert bound.top >= found.epsilon
        bound.ask([0], 0.0, True, 10.0)
        # Mixing ends where no further direction closes 2% of what lies above the zero that would be enough.
        assert bound.top == pytest.approx(found.epsilon, rel=2e-2)
        assert bound.top >= found.epsilon
        bound.descend(found.epsilon_upper * 1.01, 100, 10.0)
        assert len(bound) == 0
    assert closed > 2


def test_contacts_that_share_a_parameter_belong_together():
    def groups(surface, contacts, params):
        return [(c.tolist(), a.tolist()) for c, a in contact_groups(surface, contacts, params)]

    apart = contacts_on(RIM, RIM, RIM)
    assert groups(apart, 3, 3) == [([0], [0]), ([1], [1]), ([2], [2])]
    pair = tied(apart, [[1, 0], [-1, 0], [0, 1]])
    assert groups(pair, 3, 2) == [([0, 1], [0]), ([2], [1])]
    assert groups(mirrored(apart, (1, 0)), 6, 3) == [([0, 3], [0]), ([1, 4], [1]), ([2, 5], [2])]
    chained = tied(contacts_on(RIM, RIM, RIM, RIM), [[1, 0, 0], [1, 1, 0], [0, 0, 1], [0, 0, 0]])
    assert groups(chained, 4, 3) == [([0, 1, 3], [0, 1]), ([2], [2])]
    assert groups(lambda params: apart(params + 0), 3, 3) == [([0, 1, 2], [0, 1, 2])]


@pytest.mark.parametrize("calls", [2, 5, 20, 60])
def test_an_interrupt_keeps_a_bound_that_holds(calls):
    surface = contacts_on(RIM, RIM, RIM)
    options = {"friction": 0.3, "length_scale": 0.04, "bounds": [(0, 2), (2, 4), (4, 6)]}
    best = gf.plan_global(surface, **options).epsilon_upper
    left = [calls]

    class Interrupted:
        depends, grasp_options = surface.depends, surface.grasp_options

        def __call__(self, params):
            left[0] -= 1
            if left[0] == -1:
                raise KeyboardInterrupt
            return surface(params)

    try:
        found = gf.plan_global(Interrupted(), gap=1e-3, time_limit=10.0, **options)
    except KeyboardInterrupt:
        # Nothing was known by then.
        assert calls < 10
        return
    assert found.stopped == "interrupted"
    assert found.quality.epsilon <= found.epsilon_upper
    assert found.epsilon_upper >= best * (1 - 0.01)
