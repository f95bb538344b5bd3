"""Tips onto the surface: Levenberg-Marquardt on palm and joints, for many poses at once.

Minimised is the sum of squares of the tips' gaps, of what links and fingers lack to their clearance, of pads
that look away from the surface, and weakly of the distance from a posture. Joints at their limits are kept
there as long as they would leave them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .poses import cross

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .distances import Clearances, Distances, Touches
    from .kinematics import Places, Poses

    Array = NDArray[np.float64]


_PER_METRE = 1e3  # residuals are in mm
_PAD = 10.0  # a pad that lacks 0.1 of its cosine counts like 1 mm
_PAD_RESERVE = 0.04
# Of palm translation, palm rotation and joints. Much less lets poses jump between faces of the object.
_DAMPING = 5e4, 75.0, 25.0
_LONGEST = 0.02, 0.3, 0.3  # m, rad and rad of one step


@dataclass(frozen=True, slots=True)
class SnapOptions:
    """How tips are put onto the surface."""

    steps: int = 25
    posture: float = 0.02
    """Weight of the distance from the hand's posture, in mm/rad."""
    margin: float = 1e-3
    """Clearance in m of links and fingers."""
    pad: float | None = None
    """Least cosine between a pad's direction and the way into the object."""
    tolerance: float = 1e-4
    """Gap in m at which a pose is done."""
    overlap: float = 5e-5
    """Penetration in m at which a pose is done."""
    gap: float = 0.0
    """Distance in m of the tips from the surface."""
    palm_fixed: bool = False
    """Whether only the joints move."""


def snap(distances: Distances, poses: Poses, options: SnapOptions, *, targets: Array | None = None) -> Poses:
    """Return poses whose tips touch, as far as the steps reach.

    With `targets` (m, 3) or (B, m, 3) the points of the tips' axes go there, not to the nearest surface.
    """
    poses = poses.copy()
    if targets is not None:
        targets = np.broadcast_to(targets, (len(poses), *targets.shape[-2:]))
    kinematics = distances.kinematics
    limits = kinematics.hand.driven_limits
    left = np.arange(len(poses))
    for _ in range(options.steps):
        if not len(left):
            break
        now = poses[left]
        places, touches, near = distances.measure(now, options.margin)
        if targets is None:
            error = np.abs(touches.gaps - options.gap).max(axis=1)
        else:
            centers = nearest_axis_points(distances, places, targets[left])
            error = np.linalg.norm(centers - targets[left], axis=2).max(axis=1)
        facing = facing_of(distances, places, touches)
        done = (error < options.tolerance) & (near.deepest(len(left), own=False) < options.overlap)
        done &= near.deepest(len(left), own=True) < options.overlap
        if options.pad is not None and targets is None:
            done &= (facing > options.pad).all(axis=1)
        matrix, gradient = _normal_equations(
            distances, now, places, touches, near, options, targets is not None
        )
        if targets is not None:
            _add_targets(distances, places, centers, targets[left], matrix, gradient)
        if options.palm_fixed:
            matrix[:, :6], matrix[:, :, :6], gradient[:, :6] = 0, 0, 0
            matrix[:, range(6), range(6)] = 1
        steps = _limited(_step(matrix, gradient, now, limits))
        go = ~done
        poses.put(left[go], now[go].moved(steps[go], limits))
        left = left[go]
    return poses


def facing_of(distances: Distances, places: Places, touches: Touches) -> Array:
    """(B, m) cosines between pads and the way into the object; 1 for tips without pads."""
    pads = np.einsum("bmij,mj->bmi", places.tip_rotations, distances.kinematics.pads)
    cosines: Array = -(pads * touches.outward).sum(axis=2)
    without = np.array([tip.pad is None for tip in distances.kinematics.tips])
    return np.where(without, 1.0, cosines)


def _normal_equations(
    distances: Distances,
    poses: Poses,
    places: Places,
    touches: Touches,
    near: Clearances,
    options: SnapOptions,
    targeted: bool,
) -> tuple[Array, Array]:
    kinematics = distances.kinematics
    count, tips, size = len(poses), len(kinematics.tips), kinematics.size
    damping = np.repeat([*_DAMPING], [3, 3, size - 6])
    posture = np.repeat([0.0, options.posture], [6, size - 6]) ** 2
    matrix = np.tile(np.diag(damping + posture), (count, 1, 1))
    hand = kinematics.hand
    gradient = np.zeros((count, size))
    gradient[:, 6:] = posture[6:] * (poses.driven - hand.posture[hand.driven])
    rows = np.repeat(np.arange(count), tips)
    bodies = np.tile(kinematics.tip_bodies, count)
    if kinematics.grasped is not None and not targeted:
        outward = touches.outward.reshape(-1, 3)
        J = _PER_METRE * kinematics.along(places, rows, bodies, touches.centers.reshape(-1, 3), outward)
        _add(matrix, gradient, rows, J, _PER_METRE * (touches.gaps.ravel() - options.gap))
        if options.pad is not None:
            pads = np.einsum("bmij,mj->bmi", places.tip_rotations, kinematics.pads).reshape(-1, 3)
            lack = options.pad + _PAD_RESERVE - facing_of(distances, places, touches).ravel()
            some = lack > 0
            axes = cross(pads, -outward)
            J = _PAD * kinematics.turning(places, rows[some], bodies[some], axes[some])
            _add(matrix, gradient, rows[some], J, -_PAD * lack[some])
    if len(near.rows):
        J = -kinematics.along(places, near.rows, near.first, near.first_points, near.directions)
        own = near.own
        J[own] += kinematics.along(
            places, near.rows[own], near.second[own], near.second_points[own], near.directions[own]
        )
        _add(matrix, gradient, near.rows, _PER_METRE * J, _PER_METRE * (near.distances - options.margin))
    return matrix, gradient


def _add_targets(
    distances: Distances, places: Places, centers: Array, targets: Array, matrix: Array, gradient: Array
) -> None:
    kinematics = distances.kinematics
    count, tips = centers.shape[:2]
    rows = np.repeat(np.arange(count), tips)
    bodies = np.tile(kinematics.tip_bodies, count)
    for axis in np.eye(3):
        directions = np.tile(axis, (len(rows), 1))
        J = _PER_METRE * kinematics.along(places, rows, bodies, centers.reshape(-1, 3), directions)
        _add(matrix, gradient, rows, J, _PER_METRE * ((centers - targets) @ axis).ravel())


def nearest_axis_points(distances: Distances, places: Places, targets: Array) -> Array:
    """(B, m, 3) points of the tips' axes nearest to targets."""
    kinematics = distances.kinematics
    axes = np.einsum("bmij,mj->bmi", places.tip_rotations, np.array([tip.axis for tip in kinematics.tips]))
    half = np.array([tip.half_length for tip in kinematics.tips])
    middle = places.geoms[:, distances.cores]
    along = np.clip(((targets - middle) * axes).sum(axis=2), -half, half)
    points: Array = middle + along[..., None] * axes
    return points


def _add(matrix: Array, gradient: Array, rows: NDArray[np.int64], J: Array, residuals: Array) -> None:
    """Add J^T J and J^T r of rows, which are grouped by pose."""
    if not len(rows):
        return
    poses, starts = np.unique(rows, return_index=True)
    order = np.argsort(rows, kind="stable")
    J, residuals = J[order], residuals[order]
    starts = np.searchsorted(rows[order], poses)
    matrix[poses] += np.add.reduceat(J[:, :, None] * J[:, None, :], starts)
    gradient[poses] += np.add.reduceat(J * residuals[:, None], starts)


def _step(matrix: Array, gradient: Array, poses: Poses, limits: Array) -> Array:
    """Newton steps (B, 6 + k) in which joints at their limits do not leave them."""
    fixed = np.zeros(gradient.shape, dtype=bool)
    at_low, at_high = poses.driven <= limits[:, 0] + 1e-9, poses.driven >= limits[:, 1] - 1e-9
    step: NDArray[np.floating[Any]] = np.zeros_like(gradient)
    for _ in range(4):
        held = matrix.copy()
        held[fixed[:, :, None] | fixed[:, None, :]] = 0
        diagonal = np.arange(gradient.shape[1])
        held[:, diagonal, diagonal] = np.where(fixed, 1.0, matrix[:, diagonal, diagonal])
        step = -np.linalg.solve(held, np.where(fixed, 0.0, gradient)[..., None])[..., 0]
        leaving = ((step[:, 6:] < 0) & at_low) | ((step[:, 6:] > 0) & at_high)
        if not (leaving & ~fixed[:, 6:]).any():
            break
        fixed[:, 6:] |= leaving
    return np.asarray(step, dtype=np.float64)


def _limited(steps: Array) -> Array:
    move, turn, bend = _LONGEST
    factor = np.maximum.reduce([
        np.linalg.norm(steps[:, :3], axis=1) / move, np.linalg.norm(steps[:, 3:6], axis=1) / turn,
        np.abs(steps[:, 6:]).max(axis=1) / bend, np.ones(len(steps)),
    ])  # fmt: skip
    limited: Array = steps / factor[:, None]
    return limited
