"""Plans from poses: resting forces within friction and torque limits, slip onset and pregrasp."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import unwarned_grasp
from graspforce.errors import GraspForceError, InfeasibleWrenchError

from .closing import pregrasps
from .hand_plan import HandPlan
from .kinematics import Poses
from .limited_forces import limited_forces, unit_torques
from .preload import finger_stiffness, joint_torques, resting_forces, slip_onset

if TYPE_CHECKING:
    from collections import Counter

    from numpy.typing import NDArray

    from .candidates import Candidates
    from .distances import Distances
    from .grasp_problem import GraspProblem
    from .hand import Hand

    Array = NDArray[np.float64]


_EDGES = 8
_LEAST_SHARE = 0.25  # of the preload: torque limits that allow less leave no grasp


class Maker:
    """Makes plans of the poses of one search."""

    def __init__(self, distances: Distances, problem: GraspProblem, pushes: Array, retreat: float) -> None:
        self._distances, self._problem, self._pushes, self._retreat = distances, problem, pushes, retreat
        self._poses: dict[int, Poses] = {}

    def plan(self, found: Candidates, row: int, hand: Hand, counts: Counter[str]) -> HandPlan | None:
        """Return the plan of a pose, without its pregrasp; None, counted, where the pose holds nothing."""
        problem, kinematics = self._problem, self._distances.kinematics
        grasp = unwarned_grasp(
            found.points[row], found.normals[row], max_normal_force=1.0, edges=_EDGES, **problem.contacts
        )
        try:
            quality = grasp.quality(problem.criterion, 1e-4)
        except GraspForceError:
            counts["open"] += 1
            return None
        if quality.closure != "force":
            counts["open"] += 1
            return None
        preload = problem.preload
        forces = resting_forces(grasp, preload, problem.friction_margin, problem.external_wrench)
        if forces is None:
            counts["without preload"] += 1
            return None
        J = self._jacobians(found, row)
        driven = hand.driven
        limits = hand.torque_limits[driven]
        world = np.einsum("mij,mi->mj", grasp.frames, forces[:, :3])
        if (np.abs(joint_torques(J, hand.coupling, world)) > limits).any():
            narrow = grasp.replace(friction_margin=problem.friction_margin)
            unit, names = unit_torques(grasp, J, hand.coupling), [hand.joints[j] for j in driven]
            share = 0.0
            with contextlib.suppress(InfeasibleWrenchError):
                forces, share = limited_forces(narrow, unit, limits, preload, problem.external_wrench, names)
            if share < _LEAST_SHARE:
                counts["beyond torques"] += 1
                return None
            preload *= share
        K = finger_stiffness(J, hand.coupling, hand.stiffness[hand.driven])
        onset = float(slip_onset(grasp, forces, K, self._pushes).min())
        pose = found.poses[[row]]
        joints = hand.joint_positions(pose.driven[0])
        plan = HandPlan(
            hand, kinematics.fingers, kinematics.palm(pose, 0), joints, joints, grasp, quality, forces,
            problem.external_wrench, J, preload, float(found.gap[row]),
            float(found.overlap[row]), float(found.own_overlap[row]),
            float(np.arccos(np.clip(found.facing[row], -1, 1))), 0.0, onset,
        )  # fmt: skip
        self._poses[id(plan)] = pose
        return plan

    def with_pregrasps(self, plans: list[HandPlan]) -> list[HandPlan]:
        """Return plans with fingers backed off."""
        poses = Poses.joined([self._poses[id(plan)] for plan in plans])
        opened, clearance = pregrasps(self._distances, poses, self._retreat)
        return [
            replace(
                plan,
                pregrasp=plan.hand.joint_positions(opened.driven[k]),
                pregrasp_clearance=float(clearance[k]),
            )
            for k, plan in enumerate(plans)
        ]

    def _jacobians(self, found: Candidates, row: int) -> Array:
        """(m, 3, n) of the contacts by all joints."""
        kinematics = self._distances.kinematics
        places = kinematics.places(found.poses[[row]])
        points = found.points[row]
        arms = points[:, None] - places.anchors[0][None]
        axes = places.axes[0][None]
        moves = np.where(kinematics.hinge[:, None], np.cross(axes, arms), np.broadcast_to(axes, arms.shape))
        J: Array = np.swapaxes(moves * kinematics.moves[kinematics.tip_bodies][:, :, None], 1, 2)
        return J
