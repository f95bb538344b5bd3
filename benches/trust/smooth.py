"""Whether epsilon has one gradient: random grasps, and symmetric ones that have several."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from benches.trust.row import Row

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

STEP = {1e-12: 1e-6, 1e-10: 1e-4}
"""Of differences, in m, by the tolerance of quality: beside contacts a metre apart."""

AGREE = {1e-12: 1e-3, 1e-10: 2e-2}
"""Relative difference of slopes that are the same: true cones are curved, and less exact."""


def random_grasps(count: int, seed: int = 4) -> Iterator[tuple[gf.Grasp, str]]:
    """Yield generic grasps: planar, with edges, with true cones; hard and soft."""
    random = np.random.default_rng(seed)
    for k in range(count):
        kind, criterion = k % 4, ("max", "sum")[k // 4 % 2]
        while True:
            if kind == 0:
                angles = random.uniform(0, 2 * np.pi, 4)
                outward = np.column_stack([np.cos(angles), np.sin(angles)])
                grasp = gf.Grasp(
                    outward * [1.3, 1.0], -outward / [1.3, 1.0], friction=random.uniform(0.2, 0.8)
                )
            else:
                outward = random.normal(size=(int(random.integers(4, 6)), 3))
                outward /= np.linalg.norm(outward, axis=1)[:, None]
                given = {"friction": random.uniform(0.3, 0.9), "edges": (6, 7, None)[kind - 1]}
                soft = {"torsion": 0.2} if kind == 2 else {}
                grasp = gf.Grasp(outward * [1.0, 0.8, 0.6], -outward / [1.0, 0.8, 0.6], **given, **soft)
            if grasp.quality(criterion).epsilon > 1e-3:
                break
        yield grasp, criterion


def symmetric_grasps() -> Iterator[tuple[gf.Grasp, str]]:
    """Yield grasps several of whose directions are equally bad."""
    corners = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    for friction in (0.3, 0.5, 0.8):
        for edges in (4, 8, None):
            yield gf.Grasp(corners, -corners, friction=friction, edges=edges), "sum"
        for count in (2, 3, 4, 5, 6):
            angles = 2 * np.pi * np.arange(count) / count
            ring = np.column_stack([np.cos(angles), np.sin(angles)])
            yield gf.Grasp(ring, -ring, friction=friction), "max"
            yield gf.Grasp(ring, -ring, friction=friction), "sum"


def is_smooth(grasp: gf.Grasp, criterion: str, rtol: float) -> bool:
    """Whether one-sided differences agree with the gradient and with each other."""
    gradient = grasp.quality(criterion).gradient.positions
    random = np.random.default_rng(5)
    size = STEP[rtol]
    for trial in range(4):
        along = gradient if trial == 0 else random.normal(size=gradient.shape)
        along = along / np.linalg.norm(along)
        plus, here, minus = (
            _moved(grasp, step * along).quality(criterion, rtol=rtol).epsilon_upper
            for step in (size, 0.0, -size)
        )
        ahead, behind = (plus - here) / size, (here - minus) / size
        if abs(ahead - behind) > AGREE[rtol] * np.linalg.norm(gradient):
            return False
        if abs((ahead + behind) / 2 - float((gradient * along).sum())) > AGREE[rtol] * np.linalg.norm(
            gradient
        ):
            return False
    return True


def _moved(grasp: gf.Grasp, by: np.ndarray) -> gf.Grasp:
    names = ("normals", "friction", "max_normal_force", "edges", "torsion", "length_scale")
    given = grasp.to_dict()
    return gf.Grasp(grasp.positions + by, **{name: given[name] for name in names if name in given})


def compare(count: int) -> tuple[int, int, int]:
    """Count smooth grasps, those called otherwise, and kinks called smooth."""
    asked = missed = wrong = 0
    for grasp, criterion in random_grasps(count):
        unique = grasp.quality(criterion).gradient.unique
        smooth = is_smooth(grasp, criterion, 1e-10 if grasp.to_dict().get("edges", 2) is None else 1e-12)
        asked += 1
        missed += bool(smooth) and not unique
        wrong += not smooth and unique
    for grasp, criterion in symmetric_grasps():
        asked += 1
        wrong += grasp.quality(criterion).gradient.unique
    return asked, missed, wrong


def rows(share: float) -> list[Row]:
    """Smooth grasps called otherwise are missed, kinks called smooth wrong."""
    asked, missed, wrong = compare(max(8, round(share * 400)))
    return [Row("gradients of random and of symmetric grasps", asked, "one-sided differences", missed, wrong)]
