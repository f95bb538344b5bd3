"""Upper bounds of `plan_global` on contacts with parameters of their own, beside dense sampling.

Each of two or three contacts moves on a circle, or stands still, and turns by a narrow bump of its own
parameter. The curvature is known by a formula, so that the bounds are proofs.
"""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np
from benches.trust.row import Row

import graspforce as gf
from graspforce.surfaces import PlanarCurve, contacts_on

__all__ = ["judged", "problem", "rows"]

CASES = 100
_GAP = 0.02
_STEEPEST = np.exp(-0.5)  # of exp(-x^2 / 2); its second derivative is at most 1


def _angle(start: float, speed: float, turn: float, centre: float, width: float, s: np.ndarray) -> np.ndarray:
    return start + speed * s + turn * np.exp(-(((s - centre) / width) ** 2) / 2)


def _point(place: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    angle = _angle(*place, s)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _tangent(heading: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    angle = _angle(*heading, s)
    return np.stack([np.sin(angle), -np.cos(angle)], axis=-1)


def problem(seed: int) -> tuple[Any, np.ndarray, np.ndarray, float]:
    """Return the surface, bounds of second derivatives (m, m), centres and widths (m, 2), and friction."""
    random = np.random.default_rng([11, seed])
    count, friction = int(random.integers(2, 4)), float(random.uniform(0.2, 0.8))
    length = np.hypot(1, friction)
    curves, bends, bumps = [], np.zeros((count, count)), np.zeros((count, 2))
    for i in range(count):
        start = random.uniform(0, 2 * np.pi)
        bumps[i] = centre, width = random.uniform(0.05, 0.95), 10 ** random.uniform(-1.5, -0.7)
        shift, turn = random.normal(0, 0.5, 2) * (random.random(2) < 0.6)
        speed = float(random.choice([0.0, 1.0]))
        place = (start, speed, shift, centre, width)
        heading = (start + np.pi + random.normal(0, 0.3), speed, turn, centre, width)
        curves.append(PlanarCurve(partial(_point, place), partial(_tangent, heading), object_side="left"))

        def bend(speed: float, rate: float, width: float = width) -> float:
            rate = abs(rate)
            return float(((speed + rate * _STEEPEST / width) ** 2 + rate / width**2) * length)

        # Torques are |f| sin(heading - place): the speed cancels.
        bends[i, i] = np.hypot(bend(speed, turn), bend(0.0, turn - shift))
    return contacts_on(*curves), bends, bumps, friction


def judged(seed: int) -> str:
    """Return "right", "missed" (the gap stays open) or "wrong" (a sampled grasp exceeds the bound)."""
    surface, bends, bumps, friction = problem(seed)
    criterion = ("max", "sum")[seed % 2]
    count = len(bends)
    found = gf.plan_global(
        surface, [(0, 1)] * count, criterion, gap=_GAP, curvature=bends, friction=friction, time_limit=60.0
    )
    number = 60 if count == 2 else 15
    lines = [
        np.r_[np.linspace(0, 1, number), np.clip(centre + width * np.linspace(-3, 3, number), 0, 1)]
        for centre, width in bumps
    ]
    params = np.array(list(itertools.product(*lines)))
    best = gf.quality_many(*surface(params), friction=friction, criterion=criterion, rtol=1e-6).epsilon.max()
    if not found.proven or found.epsilon_upper < best - 1e-9:
        return "wrong"
    if found.stopped == "tolerance" and found.gap > _GAP + 1e-9:
        return "wrong"
    return "right" if found.stopped in ("tolerance", "open") else "missed"


def rows(share: float) -> list[Row]:
    """Compare proven bounds with dense sampling."""
    ends = [judged(seed) for seed in range(max(1, round(CASES * share)))]
    family = "global bounds of separate contacts on narrow bumps, curvature given"
    return [Row(family, len(ends), "dense sampling", ends.count("missed"), ends.count("wrong"))]
