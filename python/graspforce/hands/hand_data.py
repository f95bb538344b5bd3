"""What planning and simulation know of a hand: joints with their limits, couplings and fingertips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_vector
from graspforce._internal.vectors import read_only
from graspforce.errors import InvalidInputError

from .couplings import coupling_matrix, driven_limits
from .fingertips import find_fingertips
from .joint_values import joint_limits, joint_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from .hand_model import HandModel

    Array = NDArray[np.float64]


_FULL_TORQUE = 0.25  # rad: a servo of unknown stiffness reaches its torque limit at this error
_RELAXATION = 0.03  # s: damping of joints without any, as a multiple of the stiffness; undamped hands diverge


class HandData:
    """The base of `graspforce.hands.Hand`, which documents its attributes."""

    __slots__ = (
        "_arguments", "_model", "armature", "coupling", "coupling_offset", "damping", "driven",
        "driven_limits", "fingertips", "joint_limits", "joints", "name", "posture", "source", "stiffness",
        "torque_limits",
    )  # fmt: skip

    def __init__(self, model: HandModel, fingertips: Any, options: Mapping[str, Any]) -> None:
        self._model = model
        self._arguments = {**options, "fingertips": fingertips}
        self.source: dict[str, Any] | None = None
        self.name: str = options.get("name") or self._model.bodies[0].name
        joints = self._model.joints
        self.joints = tuple(joint.name for joint in joints)
        self.joint_limits = read_only(
            joint_limits(self.joints, [joint.range for joint in joints], options.get("joint_limits"))
        )
        C, c = coupling_matrix(self.joints, self._model.relations, options.get("coupling"))
        self.coupling, self.coupling_offset = read_only(C), read_only(c)
        units = (C[:, None, :] == np.eye(C.shape[1])).all(axis=2) & (c == 0)[:, None]
        self.driven = read_only(units.argmax(axis=0))
        self.driven_limits = read_only(driven_limits(self.joints, self.joint_limits, C, c))
        self.torque_limits = read_only(self._torques(options.get("torque_limits")))
        servo = self.torque_limits / _FULL_TORQUE
        model_servo = [s if j.stiffness is None else j.stiffness for j, s in zip(joints, servo, strict=True)]
        self.stiffness = read_only(
            joint_numbers("stiffness", options.get("stiffness"), self.joints, model_servo, positive=True)
        )
        own = [j.damping or _RELAXATION * s for j, s in zip(joints, self.stiffness.tolist(), strict=True)]
        self.damping = read_only(joint_numbers("damping", options.get("damping"), self.joints, own))
        self.armature = read_only(
            joint_numbers("armature", options.get("armature"), self.joints, [j.armature for j in joints])
        )
        self.fingertips = find_fingertips(self._model, fingertips, options.get("pads"))
        self.posture = read_only(self._posture(options.get("posture")))

    @property
    def num_fingers(self) -> int:
        """Number of fingertips."""
        return len(self.fingertips)

    def joint_positions(self, driven: ArrayLike) -> Array:
        """Return all joints q = C z + c (n,) in rad, for the driven joints z (k,) in rad."""
        z = finite_vector("driven", driven, self.coupling.shape[1])
        q: Array = self.coupling @ z + self.coupling_offset
        return q

    def _torques(self, given: Any) -> Array:
        joints = self._model.joints
        known = [np.inf if joint.torque_limit is None else joint.torque_limit for joint in joints]
        limits = joint_numbers("torque_limits", given, self.joints, known, positive=True)
        missing = [self.joints[j] for j in self.driven if not np.isfinite(limits[j])]
        if missing:
            raise InvalidInputError(
                f"torque_limits: the model has none for {', '.join(missing)}; give them in N m, as one "
                "number or by joint"
            )
        follows = np.setdiff1d(np.arange(len(joints)), self.driven)
        limits[follows] = np.inf
        return limits

    def _posture(self, given: Mapping[str, float] | None) -> Array:
        low, high = self.driven_limits.T
        first = np.where(np.abs(low) <= np.abs(high), low + (high - low) / 3, high - (high - low) / 3)
        # A joint that bends to both sides alike spreads the fingers.
        first = np.where(np.abs(low + high) < 0.2 * (high - low), (low + high) / 2, first)
        q = self.coupling @ first + self.coupling_offset
        wanted = joint_numbers("posture", given, self.joints, q.tolist())
        z = np.clip(wanted[self.driven], low, high)
        placed: Array = self.coupling @ z + self.coupling_offset
        return placed

    def to_dict(self) -> dict[str, Any]:
        """Return name, source, joints and fingertips as plain Python, ready for JSON."""
        return {
            "name": self.name,
            "source": None if self.source is None else dict(self.source),
            "joints": list(self.joints),
            "fingertips": [tip.name for tip in self.fingertips],
        }

    def __repr__(self) -> str:
        tips = ", ".join(tip.name for tip in self.fingertips)
        return f"Hand({self.name!r}, {len(self.joints)} joints, {len(self.driven)} driven, fingertips {tips})"
