"""Numbers nobody means: every one is answered with finite numbers in order, or refused by name."""

import numpy as np
import pytest

import graspforce as gf

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")  # contacts are drawn at random

EXTREMES = [0.0, -0.0, 1.0, -1.0, 5e-324, 1e-300, 1e-160, 1e-8, 1e100, -1e100, 1e150, 1e300]


def number(rng):
    if rng.random() < 0.7:
        return EXTREMES[rng.integers(len(EXTREMES))]
    return rng.normal() * 10 ** rng.uniform(-12, 12)


def array(rng, *shape):
    if rng.random() < 0.4:
        return rng.normal(size=shape)
    return np.array([number(rng) for _ in range(np.prod(shape))]).reshape(shape)


def hostile_grasp(rng):
    dim, count = rng.integers(2, 4), rng.integers(1, 6)
    options = {"friction": abs(number(rng)), "edges": [None, 3, 8][rng.integers(3)]}
    if rng.random() < 0.5:
        options["max_normal_force"] = abs(number(rng))
    if dim == 3 and rng.random() < 0.3:
        options["torsion"] = abs(number(rng))
    if rng.random() < 0.2:
        options["length_scale"] = abs(number(rng))
    if rng.random() < 0.2:
        options["origin"] = array(rng, dim)
    if rng.random() < 0.2:
        options["friction_margin"] = 1 + abs(number(rng))
    return gf.Grasp(array(rng, count, dim), array(rng, count, dim), **options)


@pytest.mark.parametrize("seed", range(8))
def test_every_quality_is_finite_and_in_order_or_refused(seed):
    rng = np.random.default_rng(seed)
    answered = refused = 0
    for _ in range(500):
        try:
            grasp = hostile_grasp(rng)
            for criterion in ("max", "sum"):
                q = grasp.quality(criterion)
                numbers = np.hstack([q.rho, q.lower, q.upper, q.direction, q.wrench])
                assert np.isfinite(numbers).all()
                assert q.lower <= q.rho <= q.upper
                assert np.isfinite(q.gradient.positions).all()
                assert np.isfinite(q.gradient.normals).all()
            answered += 1
        except gf.GraspForceError:
            refused += 1
    assert answered > 100
    assert refused > 100
