"""Pregrasps: fingers backed off so far that straight motions of the joints touch together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .kinematics import Poses
from .snap import SnapOptions, snap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .distances import Distances

    Array = NDArray[np.float64]


_ON_THE_WAY = 0.25, 0.5, 0.75, 1.0  # of the way from the grasp to the pregrasp
_OVERLAP = 4e-4  # m
_ENOUGH = 0.7  # of the retreat


def pregrasps(distances: Distances, poses: Poses, retreat: float) -> tuple[Poses, Array]:
    """Return poses whose tips are backed off by `retreat` in m, and how far each motion keeps clear, in m.

    The palm stays. Where the joints do not let all tips back off as far, they back off less. Of several ways
    to open, the one is kept whose tips stay furthest from the object on the joints' straight motion, with
    links and fingers clear of everything. Fingers that arrive together do not push a free object away.
    """
    best, clear = poses.copy(), np.full(len(poses), -np.inf)
    for share in (1.0, 0.5, 0.25):
        way = share * retreat
        options = SnapOptions(
            steps=20,
            posture=0.002,
            palm_fixed=True,
            tolerance=2e-4,
            overlap=0.0,
            gap=way,
            margin=min(1e-3, way / 2),
        )
        left = np.flatnonzero(clear <= _ENOUGH * retreat)
        if not len(left):
            break
        closed = poses[left]
        _, touches, _ = distances.measure(closed, 5e-4)
        opened = snap(distances, closed, options, targets=touches.centers + way * touches.outward)
        # The second way keeps only the distance, and lets tips slide along the surface.
        for free in (False, True):
            if free:
                opened = snap(distances, opened, options)
            kept = _clearance(distances, closed, opened, way)
            better = np.flatnonzero(kept > clear[left] + 1e-5)
            best.put(left[better], opened[better])
            clear[left[better]] = kept[better]
    return best, clear


def _clearance(distances: Distances, closed: Poses, opened: Poses, way: float) -> Array:
    """(B,) least distance in m of tips, relative to their share of the way; negative after an overlap."""
    least = np.full(len(closed), way)
    for share in _ON_THE_WAY:
        driven = closed.driven + share * (opened.driven - closed.driven)
        _, touches, near = distances.measure(Poses(closed.positions, closed.quaternions, driven), 5e-4)
        gaps = touches.gaps.min(axis=1) / share
        depth = np.maximum(near.deepest(len(closed), own=False), near.deepest(len(closed), own=True))
        least = np.minimum(least, np.where(depth > _OVERLAP, -depth, gaps))
    return least
