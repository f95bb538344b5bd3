"""Taylor intervals beside mpmath: they hold exact values and derivatives, rounding included."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from graspforce._internal.taylor_intervals import TaylorIntervals
from graspforce.surfaces import contacts_on, cylinder, ellipse, ellipsoid, line, plane

mpmath = pytest.importorskip("mpmath")


def _unit(vector):
    return [x / mpmath.sqrt(sum(y * y for y in vector)) for x in vector]


def _built_in(random):
    """Every curve and surface with the same formulas in mpmath: positions and normals at parameters."""
    cos, sin, exact = mpmath.cos, mpmath.sin, lambda values: [mpmath.mpf(float(x)) for x in values]
    sizes, far = 10 ** random.uniform(-3, 2, 3), 10 ** random.uniform(-2, 3)
    start, along = far * random.normal(size=2), random.normal(size=2)
    corner, u, v = far * random.normal(size=3), random.normal(size=3), random.normal(size=3)
    (a, b, c), s, d, k, p, q = map(exact, (sizes, start, along, corner, u, v))

    def inward(*outward):
        return [-x for x in _unit(outward)]

    return [
        (ellipse(*sizes[:2]), 1, lambda x: ([a * cos(x), b * sin(x)], inward(cos(x) / a, sin(x) / b))),
        (line(start, along, object_side="left"), 1, lambda x: ([s[0] + x * d[0], s[1] + x * d[1]], None)),
        (
            ellipsoid(*sizes),
            2,
            lambda x, y: (
                [a * cos(y) * cos(x), b * cos(y) * sin(x), c * sin(y)],
                inward(cos(y) * cos(x) / a, cos(y) * sin(x) / b, sin(y) / c),
            ),
        ),
        (cylinder(sizes[0]), 2, lambda x, y: ([a * cos(x), a * sin(x), y], inward(cos(x), sin(x), 0))),
        (
            plane(corner, u, v, object_side="along"),
            2,
            lambda x, y: ([k[i] + x * p[i] + y * q[i] for i in range(3)], None),
        ),
    ]


@pytest.mark.parametrize("seed", range(6))
def test_rounding_included_intervals_hold_every_built_in_curve_and_surface(seed):
    random = np.random.default_rng(seed)
    with mpmath.workdps(40):
        for surface, count, exact in _built_in(random):
            center = random.uniform(-1.5, 1.5, count)
            width = random.choice([0.0, 1e-12, 1e-6, 1e-3, 1.0])
            low, high = (center - width / 2)[None], (center + width / 2)[None]
            axis = int(random.integers(count))
            found = contacts_on(surface)(TaylorIntervals.on_line(low, high, np.eye(count)[axis]))
            place = [mpmath.mpf(float(x)) for x in np.clip(random.uniform(low, high), low, high)[0]]

            def moved(step, which, component, exact=exact, place=place, axis=axis):
                there = [x + step if at == axis else x for at, x in enumerate(place)]
                return exact(*there)[which][component]

            # The normals of lines and planes are constants.
            for which in range(1 if exact(*place)[1] is None else 2):
                for component, order in itertools.product(range(found[which].shape[-1]), range(3)):
                    value = mpmath.diff(lambda h, w=which, c=component: moved(h, w, c), 0, order)
                    slack = mpmath.mpf(10) ** -25 * (1 + abs(value))
                    ends = found[which].low[order, ..., component], found[which].high[order, ..., component]
                    assert not float(ends[0].item()) > value + slack
                    assert not float(ends[1].item()) < value - slack
