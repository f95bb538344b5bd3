"""Support regions that are points, segments, empty, thin, tiny or unbounded, beside linear programs.

Up to four contacts stand in one place, in a line, nearly in a line, at equal heights, in a corner of space,
or press against each other. Limits bear the weight just so, or there are none. Forces count as balanced to
within a billionth of the weight. A region is therefore right if it holds the exact one, and lies within the
one of demands that are relaxed by three billionths. HiGHS solves both programs; where it contradicts,
rational arithmetic decides.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from benches.trust import rational_program
from benches.trust.row import Row
from benches.trust.support_regions import scaled
from scipy.optimize import linprog

import graspforce as gf

__all__ = ["KINDS", "judged", "rows", "stance"]

CASES = 2000
DIRECTIONS = 8
RELAXED = 3e-9  # of the weight: what may be left unbalanced, with a margin
RESOLUTION = 2e-9  # of the extent: widths below a billionth are none
UNLIMITED = 1e5  # of the weight: larger forces count as none

KINDS = (
    "one place", "two", "line", "near line", "equal heights", "thin", "tiny", "just enough", "frictionless",
    "leaning", "pressing",
)  # fmt: skip


def stance(seed: int) -> tuple[gf.Grasp, float, str, dict[str, Any]]:
    """Contacts, the weight, the criterion, and the options of the region."""
    rng = np.random.default_rng([20, seed])
    kind = KINDS[seed % len(KINDS)]
    number = {"two": 2, "pressing": int(rng.integers(2, 4)), "thin": 4}.get(kind, int(rng.integers(1, 4)))
    places = rng.uniform(-1, 1, (number, 3)) * [1, 1, rng.choice([0, 0.5])]
    normals = rng.choice([0, 0.05, 0.3]) * rng.standard_normal((number, 3)) + [0, 0, 1]
    near = 10 ** rng.uniform(-12, -2)
    if kind == "one place":
        places = np.tile(places[:1], (number, 1))
    elif kind in ("line", "near line"):
        places = rng.uniform(-1, 1, (number, 1)) * rng.standard_normal(3) + rng.uniform(-1, 1, 3)
        places += near * rng.standard_normal((number, 3)) if kind == "near line" else 0
    elif kind == "thin":
        places[2:] = places[:2] + near * rng.standard_normal((2, 3))
    elif kind == "tiny":
        places = near * places + rng.uniform(-1, 1, 3)
    elif kind == "leaning":
        normals += [rng.uniform(0, 2), 0, 0]
    elif kind == "pressing":
        places[:, 2] *= 0.1
        normals[:2] = [(1, 0, 0), (-1, 0, 0)] + rng.choice([0, 0.3]) * rng.standard_normal((2, 3))
    weight = float(rng.choice([1, 100, 1e-4, 1e5]))
    enough = 1 + (near * rng.choice([0, 1, -1]) if kind == "just enough" else 10 ** rng.uniform(-0.5, 1.5))
    load: dict[str, Any] = {"limits": bool(kind == "just enough" or rng.integers(2))}
    if rng.integers(3) == 0:
        load |= {"acceleration": 0.5 * rng.standard_normal(3), "height": float(rng.uniform(0, 2))}
    if rng.integers(4) == 0:
        load["external_wrench"] = 0.05 * weight * rng.standard_normal(6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gf.GraspWarning)
        grasp = gf.Grasp(
            places,
            normals,
            friction=0.0 if kind == "frictionless" else float(rng.choice([0.3, 0.6, 1.0])),
            max_normal_force=weight * enough / number,
            edges=int(rng.choice([4, 6, 8])),
        )
    return grasp, weight, str(rng.choice(["max", "sum"])), load


class _Program:
    """Forces that hold the body, as a linear program over extreme forces and the place."""

    def __init__(self, grasp: gf.Grasp, weight: float, criterion: str, load: dict[str, Any]) -> None:
        maps, moving, self._right, self.center, self.extent = scaled(grasp, weight, load)
        # Positions far from the origin are rounded, and so is their mean.
        self.rounding = 1e-15 * np.abs(grasp.positions).max() / self.extent
        forces = np.zeros((len(grasp.extreme_forces), 4))
        forces[:, : grasp.force_dim] = grasp.extreme_forces / weight
        forces[:, 3] /= self.extent
        owner = np.repeat(np.arange(grasp.num_contacts), np.asarray(grasp.num_edges))
        edges = np.column_stack(
            [maps[:, 4 * i : 4 * i + 4] @ force for i, force in zip(owner, forces, strict=True)]
        )
        self._balance = np.column_stack([edges, moving, -moving])
        shares = (owner == np.arange(grasp.num_contacts)[:, None]).astype(float)
        if not load["limits"]:
            # All forces together are at most so many times the weight, where they are limited.
            self._limits = np.linalg.norm(forces[:, :3], axis=1)[None] / UNLIMITED
        else:
            self._limits = shares if criterion == "max" else shares.sum(axis=0, keepdims=True)

    def reach(self, direction: np.ndarray, relaxed: float, *, limited: bool, exact: bool = False) -> float:
        """How far the place may lie along a direction; minus infinite if there is none, NaN if undecided."""
        count = self._balance.shape[1] - 4
        costs = np.r_[np.zeros(count), direction, -direction]
        limits = np.column_stack([self._limits, np.zeros((len(self._limits), 4))]) if limited else None
        balance, right = self._balance, self._right
        if relaxed:
            # What is left unbalanced, from above and from below, is as small as this together.
            six = np.eye(len(right))
            balance = np.column_stack([balance, six, -six])
            costs = np.r_[costs, np.zeros(12)]
            left = np.r_[np.zeros(count + 4), np.full(12, 1 / relaxed)]
            wide = np.zeros((0 if limits is None else len(limits), count + 16))
            wide[:, : count + 4] = 0 if limits is None else limits
            limits = np.vstack([wide, left])
        if exact:
            if limits is not None:
                more = len(limits)
                balance = np.block([[balance, np.zeros((6, more))], [limits, np.eye(more)]])
                right, costs = np.r_[right, np.ones(more)], np.r_[costs, np.zeros(more)]
            return float(rational_program.largest(costs, balance, right))
        tight = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
        found = linprog(
            -costs, A_ub=limits, b_ub=None if limits is None else np.ones(len(limits)), A_eq=balance,
            b_eq=right, method="highs-ds", options=tight,
        )  # fmt: skip
        return {0: -(found.fun or 0.0), 2: -np.inf, 3: np.inf}.get(found.status, np.nan)


def judged(seed: int, gap: float = 1e-6) -> str:
    """Return "right", "missed" (no answer, or an open gap) or "wrong"."""
    grasp, weight, criterion, load = stance(seed)
    program = _Program(grasp, weight, criterion, load)
    try:
        region = gf.support_region(grasp, weight, criterion, gap=gap, **load)
    except gf.NotConvergedError:
        return "missed"
    except gf.InvalidInputError:
        return "missed" if load["limits"] or _is_bounded(program) else "right"
    end = _verdict(program, region, load, seed, exact=False)
    return end if end == "right" else _verdict(program, region, load, seed, exact=True)


def _is_bounded(program: _Program) -> bool:
    """Whether as large forces as count make no difference along four directions."""
    for direction in np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]):
        free, limited = (program.reach(direction, 0, limited=side, exact=True) for side in (False, True))
        if not free <= limited + RESOLUTION:
            return False
    return True


def _verdict(
    program: _Program, region: gf.SupportRegion, load: dict[str, Any], seed: int, *, exact: bool
) -> str:
    angles = np.random.default_rng([21, seed]).uniform(0, 2 * np.pi) + np.pi * np.arange(DIRECTIONS) / 4
    widths = []
    for direction in np.column_stack([np.cos(angles), np.sin(angles)]):
        options = {"limited": load["limits"], "exact": exact}
        low = program.reach(direction, 0, **options)
        if region.shape == "empty":
            if np.isnan(low):
                return "undecided"
            return "right" if low == -np.inf else "wrong"
        high = program.reach(direction, RELAXED, **options)
        if np.isnan(low) or np.isnan(high):
            return "undecided"
        inner, outer = (
            ((vertices - program.center) / program.extent @ direction).max()
            for vertices in (region.inner, region.outer)
        )
        rounding = RESOLUTION * (1 + abs(outer)) + program.rounding
        if low > outer + rounding or inner > high + rounding:
            return "wrong"
        widths.append(low)
    across = np.array(widths[:4]) + widths[4:]
    if np.isfinite(across).all() and across.max() < 1e-10 and region.shape != "point":
        return "wrong"
    return "right" if region.converged else "missed"


def rows(share: float) -> list[Row]:
    """All kinds in turn."""
    ends = [judged(seed) for seed in range(round(CASES * share))]
    family = "degenerate support regions of linearised cones"
    decided = [end for end in ends if end != "undecided"]
    return [Row(family, len(decided), "HiGHS and rationals", decided.count("missed"), decided.count("wrong"))]
