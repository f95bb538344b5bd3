"""From contacts to a pose of the hand: finger assignment, inverse kinematics and a snap onto them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_array, real_number, whole_number
from graspforce._internal.optional_imports import optional
from graspforce._internal.vectors import unit
from graspforce.errors import InvalidInputError, NoGraspError

from .distances import Distances
from .grasped_object import grasped_object
from .kinematics import HandKinematics, Poses
from .pose import HandPose
from .reach_seeds import reach_seeds
from .snap import SnapOptions, nearest_axis_points, snap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from .hand_data import HandData

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]


_STEPS, _TIME_STEP = 40, 0.1  # of inverse kinematics
_SEEN = 5e-3  # m: clearances beyond it are not measured
_OVERLAP = 5e-4  # m


def reach(
    hand: HandData, positions: ArrayLike, normals: ArrayLike, mesh: Any = None, *,
    fingers: Sequence[int] | None = None, tolerance: float = 1e-3, angle: float = 0.2, tries: int = 12,
    seed: int = 0,
) -> HandPose:  # fmt: skip
    """Find a pose of the hand whose fingertips touch given contacts.

    Preshaped hands are fitted to the contacts for every assignment of fingers. The best are moved by inverse
    kinematics (mink), then by least squares that also keep links and fingers clear of the object and of each
    other.

    Safe to call from several threads.

    Parameters
    ----------
    hand : Hand
        The hand.
    positions, normals : array_like
        (m, 3) contacts in m, and normals into the object, in one frame.
    mesh : trimesh.Trimesh, tuple or path, optional
        The object in that frame, from which the hand keeps clear.
    fingers : sequence of int, optional
        Fingertip of each contact; by default every assignment is tried.
    tolerance, angle : float
        Largest errors that are accepted, in m and rad.
    tries : int
        Fits that are followed.
    seed : int
        The same seed gives the same pose.

    Returns
    -------
    HandPose
        With its errors and its clearance.

    Raises
    ------
    NoGraspError
        No pose is within the tolerances and free of collisions. The message says by how much the nearest one
        misses; ``error.nearest`` is that pose.
    InvalidInputError
        There are more contacts than fingers, or an array is not finite.
    MissingExtraError
        A package of the extra ``hands`` is not installed.

    Examples
    --------
    >>> import graspforce as gf
    >>> hand = gf.hands.preset("allegro-right")
    >>> positions = [(0.02, 0, 0), (-0.02, 0.01, 0), (-0.02, -0.02, 0)]
    >>> pose = hand.reach(positions, [(-1, 0, 0), (1, 0, 0), (1, 0, 0)])
    >>> pose.position_error < 1e-3
    True
    """
    p, n = finite_array("positions", positions), finite_array("normals", normals)
    if p.ndim != 2 or p.shape[1] != 3 or p.shape != n.shape:
        raise InvalidInputError(
            f"positions and normals: shapes {p.shape} and {n.shape}, expected both (m, 3)"
        )
    if not 1 <= len(p) <= hand.num_fingers:
        raise InvalidInputError(
            f"positions: {len(p)} contacts, and the hand has {hand.num_fingers} fingertips"
        )
    zero = np.flatnonzero(~(np.linalg.norm(n, axis=1) > 0))
    if len(zero):
        raise InvalidInputError(f"normals, contact {zero[0]}: it has no direction")
    n = unit(n)
    tolerance = real_number("tolerance", tolerance, positive=True)
    angle = real_number("angle", angle, positive=True)
    tries = whole_number("tries", tries, least=1, most=1000)
    grasped = None if mesh is None else grasped_object(mesh)
    found: list[HandPose] = []
    for chosen, rows, poses in reach_seeds(hand, p, n, fingers, tries, whole_number("seed", seed, least=0)):
        kinematics = HandKinematics(hand, grasped, chosen)
        distances = Distances(kinematics)
        targets = p[rows] - n[rows] * kinematics.radii[:, None]
        near = _inverse_kinematics(kinematics, poses, targets)
        options = SnapOptions(steps=40, posture=0.002, margin=1e-3, tolerance=tolerance / 100)
        snapped = snap(distances, near, options, targets=targets)
        found += _measured(distances, snapped, rows, p, n)
        if any(_accepted(pose, tolerance, angle) for pose in found):
            break
    found.sort(key=lambda pose: (not _accepted(pose, tolerance, angle), _misses(pose, tolerance, angle)))
    best = found[0]
    if not _accepted(best, tolerance, angle):
        error = NoGraspError(
            f"no pose touches the contacts: the nearest misses by {best.position_error * 1e3:.3g} mm and "
            f"{best.normal_error:.3g} rad, with a clearance of {best.clearance * 1e3:.3g} mm; accepted are "
            f"{tolerance * 1e3:.3g} mm, {angle:.3g} rad and overlaps of {_OVERLAP * 1e3:.3g} mm"
        )
        error.nearest = best
        raise error
    return best


def _accepted(pose: HandPose, tolerance: float, angle: float) -> bool:
    return pose.position_error <= tolerance and pose.normal_error <= angle and pose.clearance >= -_OVERLAP


def _misses(pose: HandPose, tolerance: float, angle: float) -> float:
    """How often the tolerances hold what a pose misses by, added up."""
    return pose.position_error / tolerance + pose.normal_error / angle + max(-pose.clearance, 0) / tolerance


def _inverse_kinematics(kinematics: HandKinematics, poses: Poses, targets: Array) -> Poses:
    """Poses whose tips are near targets (m, 3), by differential inverse kinematics with mink."""
    mink = optional("mink", "hands")
    model, hand = kinematics.model, kinematics.hand
    tasks: list[Any] = []
    for k, target in zip(kinematics.fingers, targets, strict=True):
        task = mink.FrameTask(f"core {k}", "geom", position_cost=1.0, orientation_cost=0.0)
        task.set_target(mink.SE3.from_translation(target))
        tasks.append(task)
    follow = [mink.EqualityConstraintTask(model, cost=10.0)] if model.neq else []
    limits = [mink.ConfigurationLimit(model)]
    rows = kinematics.qpos(poses)
    for row in rows:
        configuration = mink.Configuration(model, q=row)
        posture = mink.PostureTask(model, cost=1e-3)
        posture.set_target(row)
        for _ in range(_STEPS):
            try:
                velocity = mink.solve_ik(
                    configuration, [*tasks, *follow, posture], _TIME_STEP, "daqp", limits=limits, damping=1e-4
                )
            except mink.MinkError:
                break
            configuration.integrate_inplace(velocity, _TIME_STEP)
        row[:] = configuration.q
    quaternions = rows[:, 3:7] / np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
    driven = np.clip(rows[:, kinematics.addresses[hand.driven]], *hand.driven_limits.T)
    return Poses(rows[:, :3].copy(), quaternions, driven)


def _measured(distances: Distances, poses: Poses, rows: Integers, p: Array, n: Array) -> list[HandPose]:
    kinematics, hand = distances.kinematics, distances.kinematics.hand
    places, touches, near = distances.measure(poses, _SEEN)
    least = near.least(len(poses), _SEEN)
    if kinematics.grasped is not None:
        deep = touches.gaps.min(axis=1)
        least = np.where(deep < -_OVERLAP, np.minimum(least, deep), least)
    targets = np.broadcast_to(p[rows] - n[rows] * kinematics.radii[:, None], (len(poses), len(rows), 3))
    centers = nearest_axis_points(distances, places, targets)
    arms = p[rows] - centers
    length = np.linalg.norm(arms, axis=2)
    position = np.abs(length - kinematics.radii).max(axis=1)
    cosines = np.clip((arms * n[rows]).sum(axis=2) / np.maximum(length, 1e-12), -1, 1)
    normal = np.arccos(cosines).max(axis=1)
    fingers = [0] * len(rows)
    for finger, contact in zip(kinematics.fingers, rows, strict=True):
        fingers[int(contact)] = finger
    return [
        HandPose(
            hand, kinematics.palm(poses, row), hand.joint_positions(poses.driven[row]), tuple(fingers),
            float(position[row]), float(normal[row]), float(least[row]),
        )
        for row in range(len(poses))
    ]  # fmt: skip
