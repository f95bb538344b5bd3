"""Many poses of a hand at once: MuJoCo moves the bodies, NumPy makes the Jacobians of all poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional

from .poses import cross, rotations
from .scene import planning_spec

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from .grasped_object import GraspedObject
    from .hand_data import HandData

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """B poses: palm positions (B, 3) in m, palm quaternions (B, 4) and driven joints (B, k) in rad."""

    positions: Array
    quaternions: Array
    driven: Array

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, rows: Any) -> Poses:
        return Poses(self.positions[rows], self.quaternions[rows], self.driven[rows])

    def copy(self) -> Poses:
        """Return poses with arrays of their own."""
        return Poses(self.positions.copy(), self.quaternions.copy(), self.driven.copy())

    def put(self, rows: Any, other: Poses) -> None:
        """Replace some rows."""
        self.positions[rows], self.quaternions[rows], self.driven[rows] = (
            other.positions, other.quaternions, other.driven,
        )  # fmt: skip

    @staticmethod
    def joined(parts: Sequence[Poses]) -> Poses:
        """Join several sets of poses."""
        return Poses(
            np.vstack([p.positions for p in parts]),
            np.vstack([p.quaternions for p in parts]),
            np.vstack([p.driven for p in parts]),
        )

    def moved(self, steps: Array, limits: Array) -> Poses:
        """Return poses after steps (B, 6 + k): palm translation in m, rotation vector in rad, joints."""
        half = steps[:, 3:6] / 2
        length = np.linalg.norm(half, axis=1, keepdims=True)
        turn = np.hstack([np.cos(length), np.sinc(length / np.pi) * half])
        driven = np.clip(self.driven + steps[:, 6:], limits[:, 0], limits[:, 1])
        return Poses(self.positions + steps[:, :3], _product(turn, self.quaternions), driven)


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where the parts of the hand are in B poses, in the object's frame."""

    palm: Array
    """(B, 3) palm positions."""
    geoms: Array
    """(B, G, 3) centres of all geoms of the planning model."""
    tip_rotations: Array
    """(B, m, 3, 3) rotations of the bodies of the tips."""
    anchors: Array
    """(B, n, 3) a point on the axis of each joint."""
    axes: Array
    """(B, n, 3) directions of the axes."""


class HandKinematics:
    """The planning model of a hand, with or without an object, for some of its fingers.

    For one thread at a time.
    """

    def __init__(self, hand: HandData, grasped: GraspedObject | None, fingers: Sequence[int]) -> None:
        mujoco = optional("mujoco", "hands")
        self.hand, self.grasped, self.fingers = hand, grasped, tuple(fingers)
        self.model = m = planning_spec(hand, grasped).compile()
        self.data = mujoco.MjData(m)
        self._move = mujoco.mj_kinematics
        n = len(hand.joints)
        self.size = 6 + len(hand.driven)
        self.tips = [hand.fingertips[k] for k in fingers]
        self.radii = np.array([tip.radius for tip in self.tips])
        self.pads = np.array([np.zeros(3) if tip.pad is None else tip.pad for tip in self.tips])
        self.tip_bodies = np.array([m.body(f"body {tip.body}").id for tip in self.tips])
        self.hinge = np.array([joint.hinge for joint in hand._model.joints])  # noqa: SLF001
        self.addresses = np.array([m.joint(f"joint {j}").qposadr[0] for j in range(n)])
        self._number = np.array([m.joint(f"joint {j}").id for j in range(n)])
        self.moves = np.zeros((m.nbody, n), dtype=bool)
        for j in range(n):
            for body in range(m.nbody):
                at = body
                while at > 0 and at != m.jnt_bodyid[self._number[j]]:
                    at = int(m.body_parentid[at])
                self.moves[body, j] = at > 0

    def set(self, pose: Array) -> None:
        """Move the model to a row of `qpos`."""
        self.data.qpos[:] = pose
        self._move(self.model, self.data)

    def qpos(self, poses: Poses) -> Array:
        """(B, nq) positions of MuJoCo."""
        rows = np.zeros((len(poses), self.model.nq))
        rows[:, :3], rows[:, 3:7] = poses.positions, poses.quaternions
        rows[:, self.addresses] = poses.driven @ self.hand.coupling.T + self.hand.coupling_offset
        return rows

    def places(self, poses: Poses) -> Places:
        """Where everything is in each pose."""
        m, d, count = self.model, self.data, len(poses)
        geoms, rotation = np.empty((count, m.ngeom, 3)), np.empty((count, len(self.tips), 9))
        anchors, axes = np.empty((count, m.njnt, 3)), np.empty((count, m.njnt, 3))
        for row, pose in enumerate(self.qpos(poses)):
            self.set(pose)
            geoms[row], anchors[row], axes[row] = d.geom_xpos, d.xanchor, d.xaxis
            rotation[row] = d.xmat[self.tip_bodies]
        number = self._number
        return Places(
            poses.positions, geoms, rotation.reshape(count, -1, 3, 3), anchors[:, number], axes[:, number]
        )

    def along(
        self, places: Places, rows: Integers, bodies: Integers, points: Array, directions: Array
    ) -> Array:
        """(R, 6 + k) how fast points of bodies move along directions (R, 3), by palm twist and driven joints.

        The palm's translation is in m, its rotation in rad about the palm's position, in the object's axes.
        """
        lever = cross(points - places.palm[rows], directions)
        turn = cross(points[:, None] - places.anchors[rows], directions[:, None])
        axes = places.axes[rows]
        joints = np.where(self.hinge, (axes * turn).sum(-1), (axes * directions[:, None]).sum(-1))
        return np.hstack([directions, lever, (joints * self.moves[bodies]) @ self.hand.coupling])

    def turning(self, places: Places, rows: Integers, bodies: Integers, directions: Array) -> Array:
        """(R, 6 + k) how fast bodies turn about directions (R, 3)."""
        joints = np.where(self.hinge, (places.axes[rows] * directions[:, None]).sum(-1), 0.0)
        return np.hstack(
            [np.zeros_like(directions), directions, (joints * self.moves[bodies]) @ self.hand.coupling]
        )

    def shapes(self, driven: Array) -> Array:
        """(S, m, 3) centres of the tips in the palm's frame, for driven joints (S, k)."""
        count = len(driven)
        poses = Poses(np.zeros((count, 3)), np.tile([1.0, 0, 0, 0], (count, 1)), driven)
        cores = [self.model.geom(f"core {k}").id for k in self.fingers]
        return self.places(poses).geoms[:, cores]

    def palm(self, poses: Poses, row: int) -> Array:
        """(4, 4) pose of the palm."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotations(poses.quaternions[row]), poses.positions[row]
        return pose


def _product(a: Array, b: Array) -> Array:
    """Products (B, 4) of quaternions."""
    w, x, y, z = a.T
    p, q, r, s = b.T
    product = np.stack([
        w * p - x * q - y * r - z * s, w * q + x * p + y * s - z * r,
        w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p,
    ], axis=1)  # fmt: skip
    unit: Array = product / np.linalg.norm(product, axis=1, keepdims=True)
    return unit
