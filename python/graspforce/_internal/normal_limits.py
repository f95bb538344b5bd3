"""The largest normal force of each contact, for pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce._core import Grasp


def normal_limits(grasp: Grasp) -> NDArray[np.float64]:
    """Largest normal force (m,) of each contact in N; of general extreme forces, the largest among them."""
    if (grasp.num_edges == 0).any():
        return grasp.max_normal_force
    starts = np.cumsum(grasp.num_edges) - grasp.num_edges
    largest = np.maximum.reduceat(grasp.extreme_forces[:, 0], starts)
    return np.where(largest > 0, largest, grasp.max_normal_force)
