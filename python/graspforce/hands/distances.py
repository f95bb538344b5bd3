"""Distances of a hand's tips and links from the object and from each other, in many poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional

from .kinematics import Poses
from .scene import CORE, link_shapes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .kinematics import HandKinematics, Places

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]


_FAR = 1.0  # m: beyond this the direction to the object is that to its middle


@dataclass(frozen=True, slots=True, eq=False)
class Touches:
    """Where the tips of B poses come nearest to the object."""

    gaps: Array
    """(B, m) in m, negative where a tip is inside."""
    points: Array
    """(B, m, 3) nearest points of the object."""
    outward: Array
    """(B, m, 3) unit directions from there to the tip."""
    centers: Array
    """(B, m, 3) points of the axes of the tips that touch."""


@dataclass(frozen=True, slots=True, eq=False)
class Clearances:
    """Pairs of geoms that are closer than a margin; -1 is the object's body."""

    rows: Integers
    distances: Array
    first: Integers
    second: Integers
    first_points: Array
    second_points: Array
    directions: Array
    """(R, 3) from the first to the second, along which their distance grows."""
    own: NDArray[np.bool_]
    """(R,) whether both belong to the hand."""

    def deepest(self, count: int, own: bool) -> Array:
        """(count,) deepest penetration in m of each pose; 0 where nothing meets."""
        depth = np.zeros(count)
        chosen = self.own == own
        np.maximum.at(depth, self.rows[chosen], -self.distances[chosen])
        return depth

    def least(self, count: int, margin: float) -> Array:
        """(count,) least distance in m of each pose, at most `margin`."""
        least = np.full(count, margin)
        np.minimum.at(least, self.rows, self.distances)
        return least


class Distances:
    """Distances in the planning model; MuJoCo measures the pairs whose bounding spheres are close."""

    def __init__(self, kinematics: HandKinematics) -> None:
        self.kinematics = kinematics
        m, hand = kinematics.model, kinematics.hand
        self._measure = optional("mujoco", "hands").mj_geomDistance
        self._bound = m.geom_rbound.copy()
        self.cores = np.array([m.geom(f"core {k}").id for k in kinematics.fingers])
        links = [m.geom(f"link {k}").id for k in link_shapes(hand)]
        tips = [m.geom(f"tip {k}").id for k in range(hand.num_fingers)]
        used = [tips[k] for k in kinematics.fingers]
        # A tip that is not to touch keeps clear like a link.
        self.links = np.array([*links, *(t for t in tips if t not in used)], dtype=np.int64)
        grasped = kinematics.grasped
        self._parts = np.array(
            [m.geom(f"part {k}").id for k in range(len(grasped.parts))] if grasped else [], np.int64
        )
        self._spheres = np.zeros((0, 4)) if grasped is None else grasped.spheres
        self._bodies = m.geom_bodyid.copy()
        self._pairs = self._self_pairs(links, tips)
        self._force = np.zeros(6)

    def _self_pairs(self, links: list[int], tips: list[int]) -> Integers:
        """Pairs of geoms of two fingers, and of tips and palm, but those that touch in the hand's posture."""
        m, kinematics = self.kinematics.model, self.kinematics
        jointed = {int(b) for b in m.jnt_bodyid if m.body(int(b)).name != "wrist"}
        finger = {g: _finger(m, g, jointed) for g in (*links, *tips)}
        every, pairs = [*links, *tips], []
        kinematics.set(kinematics.qpos(_posture(kinematics))[0])
        for i, a in enumerate(every):
            for b in every[i + 1 :]:
                apart = finger[a] != finger[b] and (min(finger[a], finger[b]) >= 0 or a in tips or b in tips)
                if apart and self._measure(m, kinematics.data, a, b, 0.01, None) > 1e-3:
                    pairs.append((a, b))
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def measure(self, poses: Poses, margin: float) -> tuple[Places, Touches, Clearances]:
        """Measure all tips, and all other pairs that are closer than `margin` in m."""
        places = self.kinematics.places(poses)
        x = places.geoms
        pairs = self._near(x, margin)
        core = np.zeros((len(poses), len(self.cores), 7))
        orders, bounds = self._tip_order(x)
        found: list[tuple[int, float, int, int, bool]] = []
        ends: list[Array] = []
        m, d, measure, ft = self.kinematics.model, self.kinematics.data, self._measure, self._force
        for row, pose in enumerate(self.kinematics.qpos(poses)):
            self.kinematics.set(pose)
            if len(self._parts):
                self._nearest(core[row], orders[row], bounds[row])
            for a, b, own in pairs[row]:
                distance = measure(m, d, a, b, margin + 0.005, ft)
                if distance < margin:
                    found.append((row, distance, a, b, own))
                    ends.append(ft.copy())
        touches = self._touches(core, CORE * self.kinematics.radii, x)
        return places, touches, self._clearances(found, ends)

    def _nearest(self, core: Array, orders: list[list[int]], bounds: list[list[float]]) -> None:
        """Write distance and both nearest points (m, 7) of the tips' cores and the object's parts."""
        m, d, measure, ft = self.kinematics.model, self.kinematics.data, self._measure, self._force
        for k, (order, bound) in enumerate(zip(orders, bounds, strict=True)):
            best = np.inf
            for part in order:
                if bound[part] >= best:
                    break
                distance = measure(m, d, self.cores[k], self._parts[part], _FAR, ft)
                if distance < best:
                    best = distance
                    core[k, 0], core[k, 1:] = distance, ft

    def _tip_order(self, x: Array) -> tuple[list[list[list[int]]], list[list[list[float]]]]:
        c = x[:, self.cores]
        away = np.linalg.norm(c[:, :, None] - self._spheres[:, :3], axis=3) - self._spheres[:, 3]
        bounds = away - self._bound[self.cores][:, None]
        return np.argsort(bounds, axis=2).tolist(), bounds.tolist()

    def _near(self, x: Array, margin: float) -> list[list[tuple[int, int, bool]]]:
        """List pairs of each pose whose spheres are closer than `margin`, and whether both are the hand's."""
        c = x[:, self.links]
        away = np.linalg.norm(c[:, :, None] - self._spheres[:, :3], axis=3) - self._spheres[:, 3]
        near = away < self._bound[self.links][:, None] + margin
        pairs: list[list[tuple[int, int, bool]]] = [[] for _ in range(len(x))]
        rows, links, parts = np.nonzero(near)
        for row, a, b in zip(
            rows.tolist(), self.links[links].tolist(), self._parts[parts].tolist(), strict=True
        ):
            pairs[row].append((a, b, False))
        first, second = self._pairs.T
        gap = x[:, first] - x[:, second]
        reach = self._bound[first] + self._bound[second] + margin
        rows, chosen = np.nonzero(np.einsum("bpi,bpi->bp", gap, gap) < reach**2)
        for row, a, b in zip(rows.tolist(), first[chosen].tolist(), second[chosen].tolist(), strict=True):
            pairs[row].append((a, b, True))
        return pairs

    def _touches(self, core: Array, radius: Array, x: Array) -> Touches:
        distance, start, end = core[..., 0], core[..., 1:4], core[..., 4:]
        away = start - end
        length = np.linalg.norm(away, axis=-1, keepdims=True)
        sign = np.where(distance < 0, -1.0, 1.0)[..., None]
        middle = np.zeros(3) if self.kinematics.grasped is None else self.kinematics.grasped.center
        aside = x[:, self.cores] - middle
        aside /= np.maximum(np.linalg.norm(aside, axis=-1, keepdims=True), 1e-12)
        outward = np.where(length > 1e-9, sign * away / np.maximum(length, 1e-12), aside)
        gaps = distance - (self.kinematics.radii - radius)
        centers = end + outward * (distance + radius)[..., None]
        return Touches(gaps, end, outward, centers)

    def _clearances(self, found: list[tuple[int, float, int, int, bool]], ends: list[Array]) -> Clearances:
        if not found:
            none, empty = np.zeros(0, np.int64), np.zeros((0, 3))
            return Clearances(none, np.zeros(0), none, none, empty, empty, empty, np.zeros(0, bool))
        rows, distances, a, b, own = (np.array(column) for column in zip(*found, strict=True))
        points = np.array(ends)
        away = points[:, 3:] - points[:, :3]
        length = np.linalg.norm(away, axis=1, keepdims=True)
        away = away / np.maximum(length, 1e-12) * np.where(distances < 0, -1.0, 1.0)[:, None]
        bodies = self._bodies
        # Where two surfaces just meet, no direction parts them: the pair waits for the next step.
        away[length[:, 0] < 1e-9] = 0
        return Clearances(
            rows, distances, bodies[a].astype(np.int64), np.where(own, bodies[b], -1), points[:, :3],
            points[:, 3:], away, own,
        )  # fmt: skip


def _finger(model: Any, geom: int, jointed: set[int]) -> int:
    """Topmost jointed body above a geom; -1 on the palm."""
    body, top = int(model.geom_bodyid[geom]), -1
    while body > 0:
        top = body if body in jointed else top
        body = int(model.body_parentid[body])
    return top


def _posture(kinematics: HandKinematics) -> Poses:
    hand = kinematics.hand
    return Poses(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), hand.posture[hand.driven][None])
