"""What is drawn of a grasp: cones, forces, contact numbers and the weakest disturbance, all on one scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import ConvexHull

from graspforce._core import unwarned_grasp
from graspforce._internal.normal_limits import normal_limits

from .panel import CONE, FORCE, OVERLOAD, UNBALANCED, WORST

if TYPE_CHECKING:
    import viser
    from numpy.typing import NDArray

    from graspforce._core import Grasp

    Array = NDArray[np.float64]

LONGEST = 0.3
"""Length of the largest cone of the grasp as given, as a share of the object's size."""

_PAST = 3.0
"""Length at which an arrow is cut, in lengths of the largest cone."""

_LEAST_TURN = 0.05
"""Least share of the torque in a disturbance that is drawn."""

_CONE_EDGES = 16
_CORNERS = np.vstack([np.eye(3), -np.eye(3)])


class Drawing:
    """The parts of a scene that follow the grasp and its forces.

    Parameters
    ----------
    scene : viser.SceneApi
        Where to draw.
    grasp : Grasp
        The grasp as given; its largest limit sets the scale.
    size : float
        Largest extent of the object in m.
    polytopes : bool
        True draws the hull of the extreme forces of each contact with zero, False its friction cone.
    """

    def __init__(self, scene: viser.SceneApi, grasp: Grasp, size: float, *, polytopes: bool) -> None:
        self._scene, self._size, self._polytopes = scene, size, polytopes
        self.metres_per_newton = LONGEST * size / float(normal_limits(grasp).max())
        self._drawn: Grasp | None = None
        self._arrows: dict[str, Any] = {}
        self._labels = [
            scene.add_label(f"/numbers/{i}", str(i), anchor="center-center", font_screen_scale=0.9)
            for i in range(grasp.num_contacts)
        ]

    def grasp(self, grasp: Grasp) -> None:
        """Draw cones and contact numbers, unless they are those that stand already."""
        if grasp is self._drawn:
            return
        shapes = self._hulls(grasp) if self._polytopes else self._cones(grasp)
        for i, (vertices, faces) in enumerate(shapes):
            self._scene.add_mesh_simple(
                f"/cones/{i}", vertices, faces, color=CONE, opacity=0.4, side="double", flat_shading=True,
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            # Beyond the base of the cone.
            outside = vertices.mean(axis=0) - grasp.positions[i]
            length = max(float(np.linalg.norm(outside)), 1e-300)
            reach = float((-(vertices - grasp.positions[i]) @ grasp.normals[i]).max())
            away = outside / length if length > 1e-9 * self._size else -grasp.normals[i]
            self._labels[i].position = tuple(grasp.positions[i] + (reach + 0.05 * self._size) * away)
        self._drawn = grasp

    def forces(self, grasp: Grasp, forces: Array | None, shares: Array | None, rest: Array | None) -> None:
        """Draw contact forces (m, 3) in world axes, and at the origin the force (3,) that stays unbalanced.

        Forces past their limit, whose shares (m,) of it are over 1, are red. Zero forces have no arrow.
        """
        past = np.zeros(grasp.num_contacts, dtype=bool) if shares is None else shares > 1 + 1e-9
        for i, tip in enumerate(grasp.positions):
            force = np.zeros(3) if forces is None else self.metres_per_newton * forces[i]
            self._arrow(f"/forces/{i}", tip, -self._cut(force), OVERLOAD if past[i] else FORCE, at_tip=True)
        rest = np.zeros(3) if rest is None else self.metres_per_newton * rest
        self._arrow("/unbalanced", grasp.origin, self._cut(rest), UNBALANCED)

    def weakest(self, grasp: Grasp, direction: Array) -> None:
        """Draw the worst disturbance, opposite to the weakest direction (6,), at the origin.

        Its force is an arrow, its torque a ring with a tip; they are as long as their shares of its norm.
        """
        force, torque = -direction[:3], -direction[3:] / grasp.length_scale
        norm = max(float(np.hypot(np.linalg.norm(force), np.linalg.norm(torque))), 1e-300)
        self._arrow("/worst", grasp.origin, 0.5 * self._size * force / norm, WORST)
        turn = float(np.linalg.norm(torque)) / norm
        if "/ring" in self._arrows:
            self._arrows.pop("/ring").remove()
        if turn < _LEAST_TURN:
            self._arrow("/ring tip", grasp.origin, np.zeros(3), WORST)
            return
        # Two directions across the axis, so that the ring turns about it by the right hand.
        axis = torque / (norm * turn)
        across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        across /= np.linalg.norm(across)
        angles = np.linspace(0.0, 1.6 * np.pi * turn, 24)
        arms = np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(axis, across))
        points, radius = grasp.origin + 0.25 * self._size * arms, 0.006 * self._size
        self._arrows["/ring"] = self._scene.add_spline_catmull_rom(
            "/ring", points, color=WORST, thickness=2 * radius
        )
        self._arrow("/ring tip", points[-1], 0.06 * self._size * np.cross(axis, arms[-1]), WORST)

    def _cones(self, grasp: Grasp) -> list[tuple[Array, NDArray[np.int64]]]:
        cones = unwarned_grasp(
            grasp.positions, grasp.normals, grasp.friction, grasp.max_normal_force, edges=_CONE_EDGES,
            friction_margin=grasp.friction_margin,
        )  # fmt: skip
        fans = np.split(cones.extreme_forces, np.cumsum(cones.num_edges)[:-1])
        return [
            self._cone(tip, tip - self.metres_per_newton * fan @ frame)
            for fan, frame, tip in zip(fans, cones.frames, cones.positions, strict=True)
        ]

    def _hulls(self, grasp: Grasp) -> list[tuple[Array, NDArray[np.int64]]]:
        extremes = np.split(grasp.extreme_forces[:, :3], np.cumsum(grasp.num_edges)[:-1])
        return [
            self._hull(tip, -self.metres_per_newton * forces @ frame)
            for forces, frame, tip in zip(extremes, grasp.frames, grasp.positions, strict=True)
        ]

    def _cone(self, tip: Array, rim: Array) -> tuple[Array, NDArray[np.int64]]:
        count = len(rim)
        if count < 3:
            return self._hull(tip, rim - tip)
        triangles = np.array([(0, 1 + h, 1 + (h + 1) % count) for h in range(count)])
        return np.vstack([tip, rim]), triangles

    def _hull(self, tip: Array, ends: Array) -> tuple[Array, NDArray[np.int64]]:
        # Around the tip there are corners at a small distance, so that flat sets have a hull as well.
        points = np.vstack([0.003 * self._size * _CORNERS, ends])
        hull = ConvexHull(points)
        corners = np.zeros(len(points), dtype=np.int64)
        corners[hull.vertices] = np.arange(len(hull.vertices))
        return tip + points[hull.vertices], corners[hull.simplices]

    def _cut(self, arrow: Array) -> Array:
        longest = _PAST * LONGEST * self._size
        return arrow * min(1.0, longest / max(float(np.linalg.norm(arrow)), 1e-300))

    def _arrow(
        self, name: str, at: Array, arrow: Array, color: tuple[int, int, int], *, at_tip: bool = False
    ) -> None:
        """Draw an arrow from a point, or with its tip there; one without length is taken away."""
        length = float(np.linalg.norm(arrow))
        if length <= 1e-6 * self._size:
            if name in self._arrows:
                self._arrows.pop(name).remove()
            return
        ends = np.stack([at + arrow, at] if at_tip else [at, at + arrow])[None]
        # The head of a short arrow is no longer than half of it.
        head = min(0.06 * self._size, 0.5 * length)
        thick = 0.16 * head + 0.002 * self._size
        self._arrows[name] = self._scene.add_arrows(
            name, ends, color, shaft_radius=thick, head_radius=0.35 * head + thick, head_length=head
        )
