"""A hand on the page: from pregrasp over grasp to squeeze."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from viser.transforms import SO3

from graspforce.errors import GraspForceError
from graspforce.hands.surface import body_poses, body_surfaces

from .panel import HAND

if TYPE_CHECKING:
    import viser
    from numpy.typing import NDArray

    from graspforce._core import Grasp
    from graspforce.hands import HandPlan

    Array = NDArray[np.float64]

_LARGEST = 10.0
"""Bound of drawn normal forces, in largest normal forces at rest, where joints leave them free."""


class HandOnPage:
    """The hand of a plan, and what the page says of it.

    Attributes
    ----------
    grasp : Grasp
        The contacts, with the forces that the torque limits of the joints allow.
    forces : numpy.ndarray
        (m, 3) forces in N at rest, in world axes.
    names : list of str
        Fingertips, by contact.
    stages : list of str
        Poses of the slider, at 0, 1 and 2.
    notes : list of str
        Lines of text for the page.
    """

    def __init__(self, plan: HandPlan) -> None:
        self._plan = plan
        self.forces = np.einsum("mij,mi->mj", plan.grasp.frames, plan.resting_forces[:, :3])
        self.names = [plan.hand.fingertips[finger].name for finger in plan.fingers]
        planned = f"epsilon {plan.quality.criterion} {plan.quality.epsilon:.4g} N"
        self.notes = [
            f"{plan.hand.name}: slip onset {plan.onset:.3g} N, off by {1e3 * plan.contact_error:.2g} mm.",
            f"Planned with normal forces up to 1 N: {planned}.",
            "The forces are those at rest.",
        ]
        self._links: dict[int, Any] = {}
        self.stages, self._joints = ["pregrasp", "grasp"], [plan.pregrasp, plan.joints]
        try:
            self._joints.append(plan.squeeze())
            self.stages.append("squeeze")
        except GraspForceError as error:
            self.notes.append(f"No squeeze: {error}")
        self.grasp: Grasp = plan.grasp
        try:
            self.grasp = plan.torque_limited(_LARGEST * float(plan.resting_forces[:, 0].max()))
        except GraspForceError as error:
            self.notes.append(f"Cones of at most 1 N: {error}")

    def add(self, scene: viser.SceneApi) -> None:
        """Add the links of the hand to a scene; `move` puts them in their places."""
        for body, (vertices, faces) in body_surfaces(self._plan.hand).items():
            self._links[body] = scene.add_mesh_simple(
                f"/hand/{body}", vertices, faces, color=HAND, opacity=0.6, cast_shadow=False,
                receive_shadow=False,
            )  # fmt: skip

    def view_from(self, middle: Array) -> Array:
        """Return where to look from, in sizes of the object: past the palm, which hides nothing then."""
        palm = self._plan.palm[:3, 3] - middle
        palm[2] = 0.0
        palm /= max(float(np.linalg.norm(palm)), 1e-9)
        aside = np.array([palm[1], -palm[0], 0.0])
        towards: Array = 1.9 * aside - 0.9 * palm + [0.0, 0.0, 1.0]
        return towards

    def move(self, stage: float) -> None:
        """Move the hand to a place between two of its stages."""
        before = min(int(stage), len(self._joints) - 2)
        part = stage - before
        joints = (1 - part) * self._joints[before] + part * self._joints[before + 1]
        poses = body_poses(self._plan.hand, self._plan.palm, joints)
        for body, link in self._links.items():
            link.position = tuple(poses[body][:3, 3])
            link.wxyz = SO3.from_matrix(poses[body][:3, :3]).wxyz
