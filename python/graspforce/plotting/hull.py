"""The convex hull of few points, which may lie in a plane, on a line or in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.optional_imports import optional

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def hull_faces(points: Array) -> list[Array]:
    """Return polygons (k, dim) that bound the hull of points (n, dim): one of all corners if it is flat."""
    spokes = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(spokes, full_matrices=False)
    rank = int((sizes > 1e-9 * max(float(sizes[0]), 1e-300)).sum())
    if rank < 2:
        along = spokes @ axes[0]
        return [points[[int(np.argmin(along)), int(np.argmax(along))]]]
    hull = optional("scipy.spatial", "plot").ConvexHull(spokes @ axes[:rank].T)
    return [points[hull.vertices]] if rank == 2 else list(points[hull.simplices])
