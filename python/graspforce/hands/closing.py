"""Pregrasps: fingers backed off from their contacts, in straight motions of the joints that touch together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .snap import SnapOptions, snap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .distances import Distances
    from .kinematics import Poses

    Array = NDArray[np.float64]

__all__ = ["pregrasps"]


def pregrasps(distances: Distances, poses: Poses, retreat: float) -> tuple[Poses, Array]:
    """Return poses whose tips are `retreat` in m away from their contacts, and each one's least distance in m.

    The palm stays. Each tip backs off along its contact normal by the same way, so that all arrive together
    when the joints move straight from the pregrasp to the grasp.
    """
    _, touches, _ = distances.measure(poses, 5e-4)
    targets = touches.centers + retreat * touches.outward
    options = SnapOptions(steps=15, posture=0.002, margin=1e-3, palm_fixed=True, tolerance=5e-4, overlap=0.0)
    opened = snap(distances, poses, options, targets=targets)
    _, after, near = distances.measure(opened, retreat)
    return opened, np.minimum(after.gaps.min(axis=1), near.least(len(poses), retreat))
