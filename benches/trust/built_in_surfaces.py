"""Upper bounds of `plan_global` on every curve and surface of `graspforce.surfaces`, beside dense sampling.

Contacts lie on ellipses, lines, ellipsoids, cylinders and planes, some of them thin, and depend on one to
three parameters through ties and mirror images. Nothing about curvature is given: formulas prove the bounds.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from benches.trust.row import Row
from benches.trust.separable_bounds import verdict

import graspforce as gf
from graspforce.surfaces import contacts_on, cylinder, ellipse, ellipsoid, line, mirrored, plane, tied

__all__ = ["judged", "problem", "rows"]

CASES = 300
_GAP = 0.05
_SAMPLES = {1: 4001, 2: 65, 3: 17}


def _place(random: np.random.Generator, dim: int) -> Any:
    kind, side = random.integers(3), random.choice(["outside", "inside"], p=[0.9, 0.1])
    sizes = 10 ** random.uniform(-1.5, 0, 3)
    if dim == 2:
        if kind:
            return ellipse(sizes[0], sizes[1], pressed_from=side)
        return line(
            random.normal(0, 0.5, 2), random.normal(0, 0.5, 2), object_side=random.choice(["left", "right"])
        )
    if kind == 0:
        return ellipsoid(*sizes, pressed_from=side)
    if kind == 1:
        return cylinder(sizes[0], pressed_from=side)
    corner, u, v = random.normal(0, 0.5, (3, 3))
    return plane(corner, u, v, object_side=random.choice(["along", "against"]))


def problem(seed: int) -> tuple[Any, int, dict[str, Any]]:
    """Return an arrangement, its number of parameters, each from 0 to 1, and the options of its grasps."""
    random = np.random.default_rng([23, seed])
    dim, num_params = int(random.integers(2, 4)), int(random.integers(1, 4))
    count = int(random.integers(2, 4))
    surface = contacts_on(*(_place(random, dim) for _ in range(count)))
    if random.random() < 0.5:
        surface = mirrored(surface, random.normal(size=dim))
    # Each parameter of a contact follows one of those that are searched, or stands still.
    ties = np.zeros((surface.num_params, num_params))
    follows = random.integers(0, num_params, surface.num_params)
    ties[np.arange(len(ties)), follows] = random.normal(0, 1.5, len(ties)) * (random.random(len(ties)) < 0.8)
    surface = tied(surface, ties, random.uniform(-3, 3, len(ties)))
    options: dict[str, Any] = {"friction": float(random.uniform(0.3, 1.0)), "length_scale": 0.5}
    if dim == 3:
        options["edges"] = random.choice([4, 6, 8, None])
        options["torsion"] = float(random.choice([0.0, 0.05]))
    return surface, num_params, options


def judged(seed: int, time_limit: float = 60.0) -> str:
    """Return "right", "missed" (the gap stays open) or "wrong" (no proof, or a sample exceeds the bound)."""
    surface, num_params, options = problem(seed)
    criterion = ("max", "sum")[seed % 2]
    found = gf.plan_global(
        surface, [(0, 1)] * num_params, criterion, gap=_GAP, time_limit=time_limit, **options
    )
    random = np.random.default_rng(seed)
    grid = np.array(list(itertools.product(np.linspace(0, 1, _SAMPLES[num_params]), repeat=num_params)))
    near = np.clip(found.params + 0.02 * random.standard_normal((500, num_params)), 0, 1)
    params = np.concatenate([grid, near])
    best = gf.quality_many(*surface(params), criterion=criterion, rtol=1e-3, **options).epsilon.max()
    return verdict(found, best, _GAP)


def rows(share: float) -> list[Row]:
    """Compare proven bounds with dense sampling."""
    ends = [judged(seed) for seed in range(max(1, round(CASES * share)))]
    family = "global bounds on built-in curves and surfaces, curvature by formula"
    return [Row(family, len(ends), "dense sampling", ends.count("missed"), ends.count("wrong"))]
