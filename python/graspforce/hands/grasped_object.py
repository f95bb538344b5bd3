"""The object as planning and simulation see it: convex parts, and the surface of their union."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import TriangleTree
from graspforce.errors import InvalidInputError
from graspforce.surfaces.mesh_checks import checked_mesh
from graspforce.surfaces.mesh_normals import center_of_mass, unit_normals
from graspforce.surfaces.mesh_reading import triangles_of

from .convex_parts import convex_parts, hull_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce.surfaces.mesh_parts import Part

    from .convex_parts import Triangles

    Array = NDArray[np.float64]


_EXCESS = 0.03
_MOST_PARTS = 32


class GraspedObject:
    """A closed mesh, its convex parts in m, and the boundary of their union.

    Nothing of it changes once it is made.
    """

    def __init__(self, parts: list[Triangles], center: Array, volume: float) -> None:
        self.parts = parts
        self.center = center
        self.volume = volume
        joined = _joined(parts)
        self.vertices, self.faces = joined if len(parts) == 1 else _boundary(joined)
        self.normals = unit_normals(self.vertices[self.faces])
        self.tree = TriangleTree(self.vertices, self.faces)
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        self.extent = float((high - low).max())
        self.spheres = np.array([_sphere(points) for points, _ in parts])
        self._planes = [_planes(points[faces]) for points, faces in parts]

    @property
    def excess(self) -> float:
        """Share of the solid's volume by which the union of the convex parts exceeds it."""
        triangles = self.vertices[self.faces]
        a, b, c = np.moveaxis(triangles - self.center, 1, 0)
        return float((a * np.cross(b, c)).sum() / 6 / self.volume - 1)

    @property
    def width(self) -> float:
        """Least distance in m between two parallel planes around the object, over the normals of its hull."""
        points, faces = hull_of(self.vertices)
        normals = unit_normals(points[faces])
        spans = points @ normals[np.linalg.norm(normals, axis=1) > 0.5].T
        return float(np.ptp(spans, axis=0).min())

    def distance(self, points: Array) -> tuple[Array, Array, Array]:
        """Signed distances (N,) of points (N, 3), nearest points (N, 3) and outward directions (N, 3)."""
        near, face, _ = self.tree.closest(points)
        inside = self.inside(points)
        away = points - near
        length = np.linalg.norm(away, axis=1)
        signed = np.where(inside, -length, length)
        clear = length > 1e-9
        outward = np.where(clear[:, None], away / np.where(clear, signed, 1.0)[:, None], self.normals[face])
        return signed, near, outward

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """(N,) whether points (N, 3) are inside of a part."""
        found = np.zeros(len(points), dtype=bool)
        for (center, radius), (normals, offsets) in zip(
            ((s[:3], s[3]) for s in self.spheres), self._planes, strict=True
        ):
            near = np.flatnonzero(((points - center) ** 2).sum(axis=1) < radius**2)
            if len(near):
                found[near] |= ((points[near] @ normals.T) < offsets).all(axis=1)
        return found

    def face_normals(self, points: Array) -> Array:
        """(N, 3) outward normals of the faces nearest to points (N, 3)."""
        faces: Array = self.normals[self.tree.closest(points)[1]]
        return faces


def grasped_object(mesh: Any) -> GraspedObject:
    """Check a closed mesh in m, and cut it into convex parts.

    `mesh` has ``vertices`` (V, 3) and ``faces`` (F, 3), is a pair of both, or the path of a file. Closed
    parts of it that are convex already stay as they are.
    """
    if isinstance(mesh, GraspedObject):
        return mesh
    if isinstance(mesh, tuple) and len(mesh) == 2:
        mesh = SimpleNamespace(vertices=np.asarray(mesh[0]), faces=np.asarray(mesh[1]))
    with triangles_of(mesh) as read:
        try:
            checked = checked_mesh(read, 1.0, check_watertight=True, check_size=True)
        except InvalidInputError as error:
            # The checks name arguments of other functions.
            argument, _, message = str(error).partition(": ")
            if argument == "unit":
                message = f"{message.rpartition(';')[0]}; scale it to m"
            hull = "take its convex hull"
            message = message.replace(f", {hull}, or pass check_watertight=False", f" or {hull}")
            raise InvalidInputError(f"{'mesh' if argument == 'unit' else argument}: {message}") from None
    boundary = checked.boundary
    triangles = boundary.vertices[boundary.faces]
    center = center_of_mass(triangles)
    a, b, c = np.moveaxis(triangles - center, 1, 0)
    volume = float((a * np.cross(b, c)).sum() / 6)
    if any(part.volume < 0 for part in checked.parts):
        parts = convex_parts(boundary.vertices, boundary.faces, _EXCESS, _MOST_PARTS)
    else:
        parts = [piece for part in checked.parts for piece in _convex(part, len(checked.parts))]
    if not parts:
        raise InvalidInputError("mesh: no part of it has a volume")
    return GraspedObject(parts, center, volume)


def _convex(part: Part, count: int) -> list[Triangles]:
    points, faces = hull_of(part.vertices)
    a, b, c = np.moveaxis(points[faces] - points[0], 1, 0)
    hull = float((a * np.cross(b, c)).sum() / 6)
    if hull <= (1 + _EXCESS) * part.volume:
        return [(points, faces)]
    return convex_parts(part.vertices, part.triangles, _EXCESS, max(2, _MOST_PARTS // count))


def _joined(parts: list[Triangles]) -> Triangles:
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = [faces + start for (_, faces), start in zip(parts, starts, strict=False)]
    return np.vstack([points for points, _ in parts]), np.vstack(faces)


def _boundary(joined: Triangles) -> Triangles:
    mesh = SimpleNamespace(vertices=joined[0], faces=joined[1])
    boundary = checked_mesh(mesh, 1.0, check_watertight=True, check_size=False).boundary
    return boundary.vertices, boundary.faces


def _planes(triangles: Array) -> tuple[Array, Array]:
    normals = unit_normals(triangles)
    solid = np.linalg.norm(normals, axis=1) > 0.5
    normals, offsets = normals[solid], (normals * triangles[:, 0]).sum(axis=1)[solid]
    # Triangles of one face have one plane.
    _, first = np.unique(np.column_stack([normals, offsets]).round(9), axis=0, return_index=True)
    return normals[first], offsets[first]


def _sphere(points: Array) -> Array:
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.append(middle, np.linalg.norm(points - middle, axis=1).max())
