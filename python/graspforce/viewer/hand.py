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
    rows : list of (str, str)
        Numbers of the plan, by name.
    notes : list of str
        Lines of text for the page.
    """

    def __init__(self, plan: HandPlan) -> None:
        self._plan = plan
        self.forces = np.einsum("mij,mi->mj", plan.grasp.frames, plan.resting_forces[:, :3])
        self.names = [plan.hand.fingertips[finger].name for finger in plan.fingers]
        self.rows = [
            ("hand", plan.hand.name),
            ("slip onset", f"{plan.onset:.3g} N"),
            ("contacts off by", f"{1e3 * plan.contact_error:.2g} mm"),
            (f"planned epsilon {plan.quality.criterion}", f"{plan.quality.epsilon:.4g} N for 1 N each"),
        ]
        self.notes: list[str] = []
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
        # Forces and polytopes lie inside the fingertips.
        touching = {self._plan.hand.fingertips[finger].body for finger in self._plan.fingers}
        for body, (vertices, faces) in body_surfaces(self._plan.hand).items():
            opacity = 0.35 if body in touching else None
            self._links[body] = scene.add_mesh_simple(
                f"/hand/{body}", vertices, faces, color=HAND, opacity=opacity, cast_shadow=False,
                receive_shadow=False,
            )  # fmt: skip

    def view(self, middle: Array) -> tuple[Array, Array]:
        """Return the point to look at, and where to look from: beside the palm, in sizes of the object."""
        palm = self._plan.palm[:3, 3] - middle
        level = np.array([palm[0], palm[1], 0.0]) / max(float(np.hypot(palm[0], palm[1])), 1e-9)
        aside = np.array([level[1], -level[0], 0.0])
        return middle + 0.4 * palm, 1.9 * aside - 0.9 * level + [0.0, 0.0, 1.0]

    def move(self, stage: float) -> None:
        """Move the hand to a place between two of its stages."""
        before = min(int(stage), len(self._joints) - 2)
        part = stage - before
        joints = (1 - part) * self._joints[before] + part * self._joints[before + 1]
        poses = body_poses(self._plan.hand, self._plan.palm, joints)
        for body, link in self._links.items():
            link.position = tuple(poses[body][:3, 3])
            link.wxyz = SO3.from_matrix(poses[body][:3, :3]).wxyz
