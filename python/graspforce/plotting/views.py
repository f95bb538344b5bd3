"""Directions of view: what an object hides from them, and one that hides no contact where there is one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

DEFAULT_VIEW = (25.0, -60.0)
"""Elevation and azimuth in degrees."""

_ELEVATIONS = (25.0, 10.0, 40.0, 60.0, 80.0, -15.0, -40.0)
_AZIMUTHS = np.arange(-180.0, 180.0, 15.0)
_EXAMINED = 16
_LEGIBLE = 2.0
"""Weight of an arrow that is seen from its end."""


def axes_of(elevation: float, azimuth: float) -> Array:
    """Return unit vectors (3, 3) to the right, upwards and to the viewer, of angles in degrees."""
    e, a = np.deg2rad([elevation, azimuth])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(toward, right), toward])


def hidden(
    positions: Array, normals: Array, corners: Array | None, view: tuple[float, float]
) -> NDArray[np.bool_]:
    """Tell which contacts (m, 3) lie behind triangles (F, 3, 3), seen from far away."""
    found = np.zeros(len(positions), bool)
    if corners is None:
        return found
    # Coordinates first (3, F): reductions over short rows are slow.
    first, second, third = (
        np.ascontiguousarray(corner.T) for corner in np.moveaxis(corners @ axes_of(*view).T, 1, 0)
    )
    low = np.minimum(np.minimum(first, second), third)
    high = np.maximum(np.maximum(first, second), third)
    margin = 2e-3 * float((high.max(axis=1) - low.min(axis=1)).max())
    # A dot on the rim is seen: it stands out of the surface.
    places = (positions - 2 * margin * normals) @ axes_of(*view).T
    for i, (x, y, depth) in enumerate(places):
        near = (low[0] <= x) & (high[0] >= x) & (low[1] <= y) & (high[1] >= y) & (high[2] > depth + margin)
        a, b, c = (corner[:, near].T for corner in (first, second, third))
        to = np.array([x, y]) - a[:, :2]
        u, v = b - a, c - a
        area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (to[:, 0] * v[:, 1] - to[:, 1] * v[:, 0]) / area
            t = (u[:, 0] * to[:, 1] - u[:, 1] * to[:, 0]) / area
            over = a[:, 2] + s * u[:, 2] + t * v[:, 2] > depth + margin
            found[i] = bool((over & (s >= 0) & (t >= 0) & (s + t <= 1)).any())
    return found


def best_view(
    positions: Array, normals: Array, corners: Array | None = None, arrows: Sequence[Array] = ()
) -> tuple[float, float]:
    """Elevation and azimuth in degrees from which triangles (F, 3, 3) hide the fewest contacts (m, 3).

    Among those, arrows along points (n, 3) are seen from the side, contacts face the viewer and lie apart in
    the picture, and the view is near the usual one.
    """
    views = [(float(e), float(a)) for e in _ELEVATIONS for a in _AZIMUTHS]
    views.insert(0, DEFAULT_VIEW)
    turn = 0.25 if corners is None else 1.0
    scores = np.array([_score(view, positions, normals, turn) for view in views])
    for arrow in arrows:
        scores -= _LEGIBLE * np.array([max(0.0, 0.6 - side_on(arrow, view)) for view in views])
    if corners is None:
        return views[int(np.argmax(scores))]
    first = np.argsort(-scores, kind="stable")[:_EXAMINED]
    scores[first] -= [3 * hidden(positions, normals, corners, views[k]).mean() for k in first]
    return views[int(first[np.argmax(scores[first])])]


def side_on(arrow: Array, view: tuple[float, float]) -> float:
    """Return the share of its size that an arrow shows: a straight one of its length, an arc of its width."""
    across = arrow - arrow.mean(axis=0)
    sizes = np.linalg.svd(across, compute_uv=False)
    last = 0 if sizes[1] < 1e-6 * sizes[0] else 1
    seen = np.linalg.svd(across @ axes_of(*view)[:2].T, compute_uv=False)
    return float(seen[last] / max(float(sizes[last]), 1e-300))


def _score(view: tuple[float, float], positions: Array, normals: Array, turn: float) -> float:
    frame = axes_of(*view)
    toward = -normals @ frame[2]
    facing = np.clip(toward, -0.3, 0.4)
    # A force along the line of sight is a point.
    ends_on = max(float(np.abs(toward).max()) - 0.6, 0.0)
    flat = positions @ frame[:2].T
    apart = np.linalg.norm(flat[:, None] - flat, axis=2)[~np.eye(len(flat), dtype=bool)]
    extent = max(float(np.ptp(positions, axis=0).max()), 1e-300)
    nearest = min(float(apart.min(initial=extent)) / extent, 0.4)
    turned = np.arccos(np.clip(frame[2] @ axes_of(*DEFAULT_VIEW)[2], -1, 1))
    return float(turn * (2 * (facing > -0.02).mean() + facing.min()) + nearest - 2 * ends_on - 0.5 * turned)
