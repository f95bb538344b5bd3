"""Upper bounds of `plan_global` on contacts with parameters of their own, beside dense sampling.

Each of two or three contacts moves on a circle, or stands still, and turns by a narrow bump of its own
parameter, 0.2% to 10% of the range wide. The curvature within a box is known by a formula, so that the bounds
are proofs.
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

CASES = 300
_GAP = 0.02


def _angle(start: float, speed: float, turn: float, centre: float, width: float, s: np.ndarray) -> np.ndarray:
    return start + speed * s + turn * np.exp(-(((s - centre) / width) ** 2) / 2)


def _point(place: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    angle = _angle(*place, s)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _tangent(heading: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    angle = _angle(*heading, s)
    return np.stack([np.sin(angle), -np.cos(angle)], axis=-1)


def _largest(low: np.ndarray, high: np.ndarray, centre: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of both derivatives of ``exp(-((s - centre) / width)^2 / 2)`` between two ends."""
    ends = np.stack([low - centre, high - centre]) / width
    far = np.abs(ends).max(axis=0)
    near = np.where((ends[0] <= 0) & (ends[1] >= 0), 0.0, np.abs(ends).min(axis=0))

    def most(function: Any, *peaks: float) -> np.ndarray:
        inside = [np.where((near <= peak) & (peak <= far), function(peak), 0.0) for peak in peaks]
        return np.maximum.reduce([function(near), function(far), *inside])

    slope = most(lambda x: x * np.exp(-(x**2) / 2), 1.0)
    bend = most(lambda x: np.abs(x**2 - 1) * np.exp(-(x**2) / 2), np.sqrt(3.0))
    return slope / width, bend / width**2


def problem(seed: int) -> tuple[Any, Any, np.ndarray, float]:
    """Return the surface, bounds of second derivatives in boxes, centres and widths (m, 2), and friction."""
    random = np.random.default_rng([11, seed])
    count, friction = int(random.integers(2, 4)), float(random.uniform(0.2, 0.8))
    length = np.hypot(1, friction)
    curves, moves, bumps = [], [], np.zeros((count, 2))
    for i in range(count):
        start = random.uniform(0, 2 * np.pi)
        bumps[i] = centre, width = random.uniform(0.05, 0.95), 10 ** random.uniform(-2.7, -1)
        shift, turn = random.normal(0, 0.5, 2) * (random.random(2) < 0.6)
        speed = float(random.choice([0.0, 1.0]))
        place = (start, speed, shift, centre, width)
        heading = (start + np.pi + random.normal(0, 0.3), speed, turn, centre, width)
        curves.append(PlanarCurve(partial(_point, place), partial(_tangent, heading), object_side="left"))
        moves.append((speed, abs(turn), abs(turn - shift)))

    def curvature(low: np.ndarray, high: np.ndarray) -> np.ndarray:
        bends = np.zeros((len(low), count, count))
        for i, (speed, turn, apart) in enumerate(moves):
            slope, bend = _largest(low[:, i], high[:, i], *bumps[i])
            forces = (speed + turn * slope) ** 2 + turn * bend
            # Torques are |f| sin(heading - place): the speed cancels.
            torques = (apart * slope) ** 2 + apart * bend
            bends[:, i, i] = length * np.hypot(forces, torques)
        return bends

    return contacts_on(*curves), curvature, bumps, friction


def judged(seed: int, time_limit: float = 60.0) -> str:
    """Return "right", "missed" (the gap stays open) or "wrong" (a sampled grasp exceeds the bound)."""
    surface, curvature, bumps, friction = problem(seed)
    criterion = ("max", "sum")[seed % 2]
    count = len(bumps)
    found = gf.plan_global(
        surface,
        [(0, 1)] * count,
        criterion,
        gap=_GAP,
        curvature=curvature,
        friction=friction,
        time_limit=time_limit,
    )
    number = 60 if count == 2 else 15
    lines = [
        np.r_[np.linspace(0, 1, number), np.clip(centre + width * np.linspace(-3, 3, number), 0, 1)]
        for centre, width in bumps
    ]
    params = np.array(list(itertools.product(*lines)))
    best = gf.quality_many(*surface(params), friction=friction, criterion=criterion, rtol=1e-6).epsilon.max()
    return verdict(found, best, _GAP)


def verdict(found: gf.GlobalOptimum, best: float, gap: float) -> str:
    """Judge a bound beside the best sample: "right", "missed" or "wrong"."""
    if not found.proven or found.epsilon_upper < best - 1e-9:
        return "wrong"
    if found.stopped == "tolerance" and found.gap > gap + 1e-9:
        return "wrong"
    return "right" if found.stopped in ("tolerance", "open") else "missed"


def rows(share: float) -> list[Row]:
    """Compare proven bounds with dense sampling."""
    ends = [judged(seed) for seed in range(max(1, round(CASES * share)))]
    family = "global bounds of separate contacts on narrow bumps, curvature given"
    return [Row(family, len(ends), "dense sampling", ends.count("missed"), ends.count("wrong"))]
