"""Quality by convex hulls: SciPy's Qhull, and Drake's polyhedra, which call Qhull too.

Both get the points ready made, and only the hull and the distance to its nearest facet are timed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .timing import Call

if TYPE_CHECKING:
    from collections.abc import Callable

    from .problems import Contacts

AGREEMENT = 1e-7


def scipy_qhull() -> Callable[[np.ndarray], float]:
    from scipy.spatial import ConvexHull  # noqa: PLC0415

    def radius(points: np.ndarray) -> float:
        return float(-ConvexHull(points).equations[:, -1].max())

    return radius


def drake_polyhedron() -> Callable[[np.ndarray], float]:
    from pydrake.geometry.optimization import HPolyhedron, VPolytope  # noqa: PLC0415

    def radius(points: np.ndarray) -> float:
        facets = HPolyhedron(VPolytope(points.T))
        return float((facets.b() / np.linalg.norm(facets.A(), axis=1)).min())

    return radius


def calls(points: Callable[[Contacts], np.ndarray]) -> list[Call]:
    return [
        Call("SciPy Qhull", "scipy", scipy_qhull, AGREEMENT, points),
        Call("Drake HPolyhedron", "drake", drake_polyhedron, AGREEMENT, points),
    ]
