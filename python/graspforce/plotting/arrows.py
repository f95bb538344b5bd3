"""Arrows in three dimensions, and forces and torques as arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from mpl_toolkits.mplot3d import proj3d

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_HEAD_LENGTH = 0.45
HEAD = f"-|>,head_length={_HEAD_LENGTH},head_width=0.2"
_LARGEST_SWEEP = np.deg2rad(290)
_LEAST = 0.03
"""Smallest share of a wrench's norm that is drawn."""


class Arrow3D(FancyArrowPatch):
    """An arrow along points (n, 3), whose head has one size in all views."""

    def __init__(self, points: Array, **style: Any) -> None:
        options = {"arrowstyle": HEAD, "mutation_scale": 16, "shrinkA": 0, "shrinkB": 0, **style}
        super().__init__(path=Path([(0.0, 0.0), (1.0, 0.0)]), **options)
        self.points, self._head = points, options["mutation_scale"]

    def do_3d_projection(self) -> float:
        """Put the arrow where the axes show its points; return its distance from the viewer."""
        x, y, z = proj3d.proj_transform(*self.points.T, self.axes.M)  # type: ignore[union-attr] # it has axes when drawn
        self._path_original = Path(np.column_stack([x, y]))
        # A head as long as its arrow would be a lone triangle.
        seen = self.axes.transData.transform(self._path_original.vertices)  # type: ignore[union-attr]
        points = 72 / self.figure.dpi * float(np.linalg.norm(np.diff(seen, axis=0), axis=1).sum())
        self.set_mutation_scale(min(self._head, max(points / (2 * _HEAD_LENGTH), 1.0)))
        return float(np.min(z))


def wrench_lines(
    force: Array, torque: Array, length_scale: float, at: Array, reach: float
) -> Iterator[Array]:
    """Yield lines (n, dim) from tail to head: a force from `at`, and a torque as an arc about `at`.

    The force is as long as its share of the norm, at most `reach`; the arc has the angle of the torque's.
    """
    turning = float(np.linalg.norm(torque)) / length_scale
    norm = float(np.hypot(np.linalg.norm(force), turning))
    if norm == 0:
        return
    if np.linalg.norm(force) > _LEAST * norm:
        yield np.stack([at, at + reach / norm * force])
    if turning > _LEAST * norm:
        angles = np.linspace(0, _LARGEST_SWEEP * max(turning / norm, 0.15), 40)
        across, along = _plane(torque) if len(at) == 3 else (np.eye(2)[0], np.sign(torque) * np.eye(2)[1])
        yield at + 0.45 * reach * (np.outer(np.cos(angles), across) + np.outer(np.sin(angles), along))


def _plane(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors across an axis, about which the first turns to the second."""
    direction = axis / np.linalg.norm(axis)
    across = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    across /= np.linalg.norm(across)
    return across, np.cross(direction, across)
