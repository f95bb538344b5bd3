"""Upper bounds of `plan_global` on objects with narrow bumps, beside dense sampling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from benches.trust.row import Row

import graspforce as gf

__all__ = ["Bumps", "bumps", "rows", "sampled"]

CASES = 446
_STEEPEST = np.exp(-0.5)  # of exp(-x^2 / 2); its second derivative is at most 1


@dataclass(frozen=True, slots=True)
class Bumps:
    """Contacts on a circle whose places and normals turn by a narrow bump of one parameter.

    Contact i is at angle ``place[i] + shift[i] g`` and presses along ``heading[i] + turn[i] g``, with
    ``g = exp(-((p - centre) / width)^2 / 2)`` and p from 0 to 1.
    """

    place: np.ndarray
    heading: np.ndarray
    shift: np.ndarray
    turn: np.ndarray
    centre: float
    width: float
    friction: float

    def __call__(self, params: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and normals (B, m, 2) at parameters (B, 1)."""
        bump = np.exp(-(((params - self.centre) / self.width) ** 2) / 2)
        place, heading = self.place + self.shift * bump, self.heading + self.turn * bump
        return (
            np.stack([np.cos(place), np.sin(place)], axis=-1),
            np.stack([np.cos(heading), np.sin(heading)], axis=-1),
        )

    @property
    def curvature(self) -> np.ndarray:
        """(m, 1) bounds of the second derivatives of wrenches; torques are ``|f| sin(heading - place)``."""
        length = np.hypot(1.0, self.friction)

        def bend(rate: np.ndarray) -> np.ndarray:
            rate = np.abs(rate)
            return ((rate * _STEEPEST / self.width) ** 2 + rate / self.width**2) * length

        return np.hypot(bend(self.turn), bend(self.turn - self.shift))[:, None]


def bumps(seed: int) -> Bumps:
    """Draw one problem: two to four contacts, bumps of 0.2% to 5% of the range."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 5))
    place = random.uniform(0, 2 * np.pi, count)
    moves = random.random(count) < 0.7
    return Bumps(
        place,
        place + np.pi + random.normal(0, 0.4, count),
        np.where(moves, random.normal(0, 0.7, count), 0.0),
        np.where(moves, random.normal(0, 0.7, count), 0.0),
        float(random.uniform(0.05, 0.95)),
        float(10 ** random.uniform(np.log10(0.002), np.log10(0.05))),
        float(random.uniform(0.2, 0.8)),
    )


def sampled(problem: Bumps, criterion: str, number: int = 2000) -> float:
    """Return the largest epsilon on a grid, and on a finer one across the bump."""
    reach = np.clip(problem.centre + problem.width * np.linspace(-5, 5, number), 0, 1)
    params = np.concatenate([np.linspace(0, 1, number), reach])[:, None]
    found = gf.quality_many(*problem(params), friction=problem.friction, criterion=criterion)
    return float(found.epsilon.max())


def rows(share: float) -> list[Row]:
    """Compare bounds from a given curvature, which are proofs, and from an estimated one, which say so."""
    cases = max(1, round(CASES * share))
    missed = wrong = called_proof = exceeded = 0
    for seed in range(cases):
        problem, criterion = bumps(seed), ("max", "sum")[seed % 2]
        best = sampled(problem, criterion)
        options: dict[str, Any] = {"criterion": criterion, "friction": problem.friction}
        proof = gf.plan_global(problem, [(0, 1)], curvature=problem.curvature, max_boxes=200_000, **options)
        missed += proof.stopped not in ("tolerance", "open")
        wrong += not proof.proven or proof.epsilon_upper < best - 1e-9
        wrong += proof.stopped == "tolerance" and proof.gap > 0.01 + 1e-12
        estimate = gf.plan_global(problem, [(0, 1)], **options)
        called_proof += estimate.proven or estimate.stopped in ("tolerance", "open")
        called_proof += "estimate" not in repr(estimate)
        exceeded += estimate.epsilon_upper < best - 1e-9
    oracle = "dense sampling"
    estimates = f"global bounds on narrow bumps, curvature estimated: {exceeded} exceeded, called estimates"
    return [
        Row("global bounds on narrow bumps, curvature given", cases, oracle, missed, wrong),
        Row(estimates, cases, oracle, 0, called_proof),
    ]
