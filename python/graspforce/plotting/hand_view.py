"""How closed surfaces are drawn without a depth buffer, and from where their contacts are seen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_rgb

from .views import axes_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


_ELEVATIONS, _AZIMUTHS = (15.0, 45.0), np.arange(-180.0, 180.0, 30.0)
_NEAR = 0.006  # m beside a line of sight: a triangle whose middle is nearer hides what lies behind
_BEFORE = 0.02  # m: a fingertip does not hide its own contact
_EVERY = 4  # of the triangles decides about a view


def small_triangles(corners: Array, longest: float) -> Array:
    """(F, 3, 3) the same surface in triangles whose edges are at most `longest` m.

    They are drawn by the distance of their middles; a long one would lie on top of what is before it.
    """
    done = []
    while len(corners):
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        long = edges.max(axis=1) > longest
        done.append(corners[~long])
        rows = corners[long]
        first = edges[long].argmax(axis=1)
        each = np.arange(len(rows))
        a, b, c = (rows[each, (first + k) % 3] for k in range(3))
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    return np.concatenate(done)


def lit(corners: Array, color: str, view: Array) -> tuple[Array, Array]:
    """Return the triangles that face the eye and their colours (F, 4), lit from above the eye's left."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(lengths, 1e-300)[:, None]
    front = (normals @ view[2] > 0) & (lengths > 0)
    light = np.array([-0.45, 0.6, 0.66]) @ view
    shade = 0.5 + 0.5 * np.clip(normals[front] @ light, 0, 1)
    colours = shade[:, None] * np.array(to_rgb(color))
    return corners[front], np.column_stack([colours, np.ones(len(shade))])


def seen(points: Array, middles: Array, view: Array) -> NDArray[np.bool_]:
    """(m,) whether nothing with triangles about `middles` (F, 3) lies between points (m, 3) and the eye."""
    p, x = points @ view.T, middles[::_EVERY] @ view.T
    hidden = [(np.hypot(*(x[:, :2] - q[:2]).T)[x[:, 2] > q[2] + _BEFORE] < _NEAR).any() for q in p]
    return ~np.array(hidden, dtype=bool)


def clearest_view(points: Array, middles: Array) -> tuple[float, float]:
    """Elevation and azimuth in degrees from which most points are seen, and widest apart."""

    def worth(angles: tuple[float, float]) -> float:
        view = axes_of(*angles)
        apart = np.ptp(points @ view[:2].T, axis=0).sum() / max(float(np.ptp(points, axis=0).sum()), 1e-12)
        return float(seen(points, middles, view).sum() + apart / 2)

    return max(((e, float(a)) for e in _ELEVATIONS for a in _AZIMUTHS), key=worth)
