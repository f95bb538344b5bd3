"""Bounds of grasps whose contacts lie anywhere on meshes with face normals.

On one face the frame of a contact is constant, so that its wrenches are affine in its position. The support
of a contact along any direction is therefore largest at a corner of the face: no slack is left in between.
Trees of faces discard most products by additions. Products that are left are bounded by mixtures of
directions, and then their faces are divided.

Bounds of three contacts and more stay wide. They are proven level by level, each nearer to the best grasp
known, so that a time limit leaves the last of them.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import ProductBound
from graspforce.errors import TooLargeError
from graspforce.surfaces import MeshSurface

from .contact_wrenches import default_seeds
from .separable_bounds import ask_samples, polish

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from graspforce.typing import Surface

    from .contact_wrenches import ContactWrenches
    from .global_optimum import Ended
    from .incumbent import Incumbent
    from .progress import Report

    Array = NDArray[np.float64]
    Indices = NDArray[np.int64]

__all__ = ["FaceProducts", "meshes_of"]

_MAX_PRODUCTS = 8_000_000
_MAX_CELLS = 250_000  # of all contacts: each takes 4 kB
_MAX_COMBINATIONS = 1e11  # of faces, without a time limit
_PER_SECOND = 1e7  # combinations that additions discard, in order of magnitude
_SAMPLE = 4096  # random grasps, for a first good one
_FIRST_DIRECTIONS = 400
_SLICE = 8192  # products that are asked for between two looks at the clock
_PART_OF_PLANS = 0.15  # of the time: for plans from many starts
_TURN = 1.0  # s between two looks at grasps that the core has met
_LEAST_STEP = 0.02  # of what is enough: levels nearer to it are left out


def meshes_of(surface: Surface) -> tuple[MeshSurface, ...]:
    """Return the mesh of each contact; empty if a contact is not on a mesh."""
    places = getattr(surface, "places", ())
    return places if all(isinstance(place, MeshSurface) for place in places) else ()


class FaceProducts:
    """Products of faces that may hold a better grasp than the best one known.

    Attributes
    ----------
    proven : float
        An upper bound of everything.
    boxes : int
        Products that were bounded along their own worst directions.
    """

    def __init__(
        self,
        wrenches: ContactWrenches,
        meshes: tuple[MeshSurface, ...],
        max_opening: float,
        plans: Callable[[Array, float], Array],
        *,
        ceiling: float,
        adopt: bool,
        limited: bool,
    ) -> None:
        self._wrenches, self._adopt, self._plans = wrenches, adopt, plans
        self._faces = [mesh.flat_faces() for mesh in meshes]
        self._whole = tuple(np.concatenate([mesh.bounds for mesh in meshes]).T)
        count = len(meshes)
        same = all(mesh is meshes[0] for mesh in meshes)
        _refuse_too_many([len(normals) for _, normals in self._faces], same=same, limited=limited)
        forces = [wrenches.force_sets(np.array([at])) for at in range(count)]
        self._bound = ProductBound(3, wrenches.criterion, forces, wrenches.center)
        alike = same and wrenches.tangents(np.arange(count)) is None
        self._bound.restrict(max_opening, alike and adopt)
        self._face_of: list[Indices] = []
        self._level = 0.0
        self._max_opening = max_opening
        self._ceiling = self.proven = ceiling
        self.boxes = 0

    @property
    def top(self) -> float:
        """No grasp exceeds it."""
        return min(self._bound.top, self._ceiling)

    def run(self, incumbent: Incumbent, max_boxes: int, deadline: float, report: Report | None) -> Ended:
        """Discard products until nothing is left, no time is, or memory would not hold more."""

        def left() -> float:
            if report is not None:
                report(self.boxes, max_boxes, self.proven)
            over = self.proven <= incumbent.open or self.boxes >= max_boxes
            return 0.0 if over else max(0.0, deadline - time.monotonic())

        def enough() -> float:
            return max(incumbent.enough, incumbent.open, self._level)

        try:
            self._search(incumbent, enough, left)
        except KeyboardInterrupt:
            if incumbent.best is None:
                raise
            return "interrupted"
        if self.top <= incumbent.enough:
            return "tolerance"
        if self.top <= incumbent.open:
            return "open"
        return "time" if time.monotonic() >= deadline else "boxes"

    def _search(self, incumbent: Incumbent, enough: Callable[[], float], left: Callable[[], float]) -> None:
        attempt = incumbent.attempt
        random = np.random.default_rng(0)
        sample = self._sample(random)
        attempt(sample)
        if len(self._faces) > 2 and left():
            # Where bounds stay wide, all depends on the grasp that is known.
            attempt(self._plans(sample, _PART_OF_PLANS * left()))
        polish(self._whole, random, attempt, lambda: incumbent.best, left)
        for contact in range(len(self._faces)):
            self._plant(contact)
        first = sample[: _FIRST_DIRECTIONS if left() else 1]
        self._bound.learn(self._wrenches.critical_directions(first))
        above = math.inf if len(self._faces) > 2 else 0.0
        while True:
            # No level needs to lie above what is proven.
            above = min(above, self._ceiling - enough()) / 2
            above = above if above > _LEAST_STEP * enough() else 0.0
            self._level = enough() + above if above > 0 else 0.0
            self._close(incumbent, random, enough, left)
            self._ceiling = self.proven = self.top
            if self._level == 0 or len(self._bound) or self._bound.pieces or not left():
                return
            self._level = 0.0
            self._bound.restart()

    def _close(
        self,
        incumbent: Incumbent,
        random: np.random.Generator,
        enough: Callable[[], float],
        left: Callable[[], float],
    ) -> None:
        """Discard products whose bounds are enough, until none is left, no time is, or none can be cut."""
        attempt = incumbent.attempt

        def middles(rows: list[int]) -> None:
            attempt(self._middles(rows))

        self._bound.descend(enough(), _MAX_PRODUCTS // 16, left())
        while True:
            ask_samples(self._bound, random, enough, left, middles, _MAX_PRODUCTS // 16)
            before = len(self._bound)
            self._bound.descend(enough(), _MAX_PRODUCTS, left())
            self.proven = min(self.proven, self.top)
            if not left() or len(self._bound) <= before or len(self._bound) >= _MAX_PRODUCTS:
                break
        self._ask_all(enough, middles, left)
        while (len(self._bound) or self._bound.pieces) and left():
            state = len(self._bound), self._bound.pieces, self.top
            known = incumbent.epsilon if incumbent.best is not None else 0.0
            began = time.monotonic()
            least = max(incumbent.open, self._level)
            _, places = self._bound.divide(known, 1 + incumbent.gap, least, self._adopt, min(_TURN, left()))
            if len(places):
                attempt(places)
            self.proven = min(self.proven, self.top)
            ended_early = time.monotonic() - began < 0.5 * _TURN
            if ended_early and state == (len(self._bound), self._bound.pieces, self.top):
                # What is left cannot be divided.
                return

    def _ask_all(
        self, enough: Callable[[], float], look: Callable[[list[int]], None], left: Callable[[], float]
    ) -> None:
        """Bound all products along their own worst directions."""
        asked, level = 0, enough()
        while asked < len(self._bound) and left():
            before, rows = len(self._bound), list(range(asked, min(asked + _SLICE, len(self._bound))))
            self._bound.ask(rows, level, True, left())
            self.boxes += len(rows)
            asked = len(self._bound) - (before - asked - len(rows))
            if shown := rows[: min(64, len(self._bound) - rows[0])]:
                look(shown)
            self.proven = min(self.proven, self.top)

    def _middles(self, rows: list[int]) -> Array:
        """Return the centroids of products of faces (B, p)."""
        _, cells = self._bound.products(rows)
        points = [
            triangles[np.maximum(face_of[cells[:, contact].astype(int)], 0)].mean(axis=1)
            for contact, ((triangles, _), face_of) in enumerate(zip(self._faces, self._face_of, strict=True))
        ]
        return np.concatenate(points, axis=1)

    def _sample(self, random: np.random.Generator) -> Array:
        """Return parameters of random grasps, half of them with a second contact opposite to the first."""
        chosen = [random.integers(0, len(normals), _SAMPLE) for _, normals in self._faces]
        centers = [triangles.mean(axis=1) for triangles, _ in self._faces]
        if len(chosen) > 1:
            (_, first), (_, second) = self._faces[:2]
            for row in range(0, _SAMPLE, 2):
                face = chosen[0][row]
                apart = centers[1] - centers[0][face]
                length = np.linalg.norm(apart, axis=1) + 1e-12
                facing = np.minimum(apart @ first[face], -(apart * second).sum(axis=1)) / length
                facing[length > self._max_opening] -= 4
                chosen[1][row] = np.argmax(facing)
        points = []
        for faces, (triangles, _) in zip(chosen, self._faces, strict=True):
            shares = random.dirichlet([1.0, 1.0, 1.0], _SAMPLE)
            points.append(np.einsum("bi,bij->bj", shares, triangles[faces]))
        if len(points) > 1:
            # Where the normal of the first contact meets the plane of the second face.
            pressed, across = self._faces[0][1][chosen[0]], self._faces[1][1][chosen[1]]
            rise = (pressed * across).sum(axis=1)
            ahead = ((points[1] - points[0]) * across).sum(axis=1) / np.where(rise < -0.1, rise, -1.0)
            met = (rise < -0.1) & (np.arange(_SAMPLE) % 2 == 0)
            points[1] = np.where(met[:, None], points[0] + ahead[:, None] * pressed, points[1])
            points[1] = np.clip(points[1], *self._whole_of(1))
        return np.concatenate(points, axis=1)

    def _whole_of(self, contact: int) -> tuple[Array, Array]:
        low, high = (side[3 * contact : 3 * contact + 3] for side in self._whole)
        return low, high

    def _plant(self, contact: int) -> None:
        """Give the core the tree of a contact's faces."""
        triangles, normals = self._faces[contact]
        size = np.ptp(triangles, axis=(0, 1)).max()
        children, face_of = _tree(np.concatenate([triangles.mean(axis=1) / size, normals], axis=1))
        leaf = children < 0
        corners = 3 * face_of[leaf][:, None] + np.arange(3)
        places, inward = triangles.reshape(-1, 3), np.repeat(normals, 3, axis=0)[:, None]
        given = self._wrenches.tangents(np.array([contact]))
        seed = default_seeds(inward) if given is None else given
        maps = self._wrenches.checked_columns(places[:, None], inward, seed, places)
        starts = np.r_[0, np.cumsum(3 * leaf)]
        self._bound.plant(
            contact, children, starts, corners.reshape(-1), np.zeros(len(children)), maps, places
        )
        self._face_of.append(face_of)


def _tree(points: Array) -> tuple[Indices, Indices]:
    """Halve sets of points (F, k) down to single ones: first children (N,) or -1, and points (N,) or -1."""
    members = [np.arange(len(points))]
    children, point = [-1], [-1]
    for node in range(2 * len(points) - 1):
        inside = members[node]
        if len(inside) == 1:
            point[node] = int(inside[0])
            continue
        axis = int(np.argmax(np.ptp(points[inside], axis=0)))
        order = inside[np.argsort(points[inside, axis], kind="stable")]
        children[node] = len(members)
        members += [order[: len(order) // 2], order[len(order) // 2 :]]
        children += [-1, -1]
        point += [-1, -1]
    return np.array(children), np.array(point)


def _refuse_too_many(faces: list[int], *, same: bool, limited: bool) -> None:
    cells = 2 * sum(faces)
    if cells > _MAX_CELLS:
        raise TooLargeError(
            f"surface: {sum(faces)} faces of all contacts take {4e-6 * cells:.1f} GB, at most "
            f"{_MAX_CELLS // 2} are possible; use a coarser mesh, or `allowed` to leave out faces"
        )
    count = math.prod(faces) / (math.factorial(len(faces)) if same else 1)
    if count > _MAX_COMBINATIONS and not limited:
        raise TooLargeError(
            f"surface: {count:.1e} combinations of faces take some {count / _PER_SECOND / 3600:.1f} hours; "
            "use a coarser mesh, `allowed` to leave out faces, or `time_limit` for a wider gap"
        )
