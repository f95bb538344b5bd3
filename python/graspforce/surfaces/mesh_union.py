"""The boundary of the union of several solid parts, by manifold3d.

Rounding may leave a crack between parts that touch. Each part is therefore grown by a fraction of the mesh's
extent before the union. Afterwards all corners are put back on the planes of the given faces.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce.errors import GraspWarning, InvalidInputError

from .mesh_normals import unit_normals

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from .mesh_parts import Part

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]

_CRACK = 2e-7  # of the extent: single precision moves corners by less


@dataclass(frozen=True, slots=True)
class Boundary:
    """Triangles of a surface, each of them a piece of a given face."""

    vertices: Array
    faces: Integers
    source: Integers
    """(F,) which given face each is a piece of."""
    solid: bool
    """Whether it encloses a volume throughout."""


def boundary_of(vertices: Array, faces: Integers, parts: Sequence[Part]) -> Boundary:
    """Return the boundary of the union of all parts.

    A part whose normals point inward is a cavity of the smallest part around it. A part that is not solid is
    not united with others; a warning gives the reason.
    """
    as_given = Boundary(vertices, faces, np.arange(len(faces)), all(part.fault is None for part in parts))
    if len(parts) == 1:
        return as_given
    solids = [part for part in parts if part.fault is None]
    loose = [part for part in parts if part.fault is not None]
    for part in loose:
        message = (
            f"{part}: not solid ({part.fault}); it is not joined with the others, and may lie inside one"
        )
        warnings.warn(message, GraspWarning, stacklevel=4)
    bodies = [part for part in solids if part.volume > 0]
    around = {part.number: _container(part, bodies) for part in solids if part.volume < 0}
    if len(bodies) < 2 and not around:
        return as_given
    crack = _CRACK * float(np.ptp(vertices, axis=0).max())
    if not around and not _boxes_meet(bodies, crack):
        return as_given
    joined, pieces, source = _union(bodies, [part for part in solids if part.volume < 0], around, crack)
    if len(source) == sum(len(part.faces) for part in solids) == len(np.unique(source)):
        return as_given
    joined = _on_their_planes(joined, pieces, source, vertices, faces)
    for part in loose:
        pieces = np.vstack([pieces, part.triangles + len(joined)])
        source = np.concatenate([source, part.faces])
        joined = np.vstack([joined, part.vertices])
    return Boundary(joined, pieces, source, not loose)


def _container(cavity: Part, bodies: Sequence[Part]) -> int:
    """Return the number of the smallest body around a part whose normals point inward."""
    place = cavity.vertices[cavity.triangles[0]].mean(axis=0)
    for body in sorted(bodies, key=lambda body: body.volume):
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        if (
            body.volume > -cavity.volume
            and ((place >= low) & (place <= high)).all()
            and _winding_number(place, body.vertices[body.triangles]) > 0.5
        ):
            return body.number
    raise InvalidInputError(
        f"{cavity}: inside out: its normals point inward (volume {cavity.volume:.3g} m^3), and no other part "
        "is around it; invert it first"
    )


def _winding_number(point: Array, triangles: Array) -> float:
    """How often closed triangles (F, 3, 3) wind around a point (3,), by van Oosterom and Strackee."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    spanned = (a * np.cross(b, c)).sum(axis=-1)
    rest = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return float(np.arctan2(spanned, rest).sum() / (2 * np.pi))


def _boxes_meet(bodies: Sequence[Part], crack: float) -> bool:
    low = np.array([body.vertices.min(axis=0) for body in bodies]) - crack
    high = np.array([body.vertices.max(axis=0) for body in bodies]) + crack
    order = np.argsort(low[:, 0])
    low, high = low[order], high[order]
    for row in range(len(bodies) - 1):
        end = int(np.searchsorted(low[:, 0], high[row, 0], side="right"))
        others = slice(row + 1, end)
        if ((low[others, 1:] <= high[row, 1:]) & (low[row, 1:] <= high[others, 1:])).all(axis=1).any():
            return True
    return False


def _union(
    bodies: Sequence[Part], cavities: Sequence[Part], around: dict[int, int], crack: float
) -> tuple[Array, Integers, Integers]:
    """Vertices, triangles and the given face of each triangle of the union."""
    manifold = optional("manifold3d", "mesh")
    add, subtract = manifold.OpType.Add, manifold.OpType.Subtract
    solids = []
    for body in bodies:
        solid = _solid(manifold, body, _grown(body, crack), body.triangles)
        holes = [
            _solid(manifold, cavity, cavity.vertices, cavity.triangles[:, ::-1])
            for cavity in cavities
            if around[cavity.number] == body.number
        ]
        solids.append(manifold.Manifold.batch_boolean([solid, *holes], subtract) if holes else solid)
    # One call for all parts: uniting them one after another would take quadratic time.
    union = manifold.Manifold.batch_boolean(solids, add)
    if union.status() != manifold.Error.NoError:
        raise InvalidInputError(f"mesh: its {len(bodies)} parts cannot be joined: {union.status().name}")
    found = union.to_mesh64()
    points = np.array(found.vert_properties[:, :3], dtype=np.float64)
    return points, np.array(found.tri_verts, dtype=np.int64), np.array(found.face_id, dtype=np.int64)


def _solid(manifold: Any, part: Part, vertices: Array, triangles: Integers) -> Any:
    mesh = manifold.Mesh64(
        np.ascontiguousarray(vertices),
        np.ascontiguousarray(triangles, dtype=np.uint64),
        face_id=np.ascontiguousarray(part.faces, dtype=np.uint64),
    )
    solid = manifold.Manifold(mesh)
    if solid.status() != manifold.Error.NoError:
        raise InvalidInputError(f"{part}: not solid: {solid.status().name}")
    return solid


def _grown(part: Part, by: float) -> Array:
    """Corners of a part whose faces have moved outward, where three of their planes meet."""
    normals = unit_normals(part.vertices[part.triangles])
    return part.vertices + _moves(
        part.triangles, normals, np.full(len(normals), by), len(part.vertices), 3 * by
    )


def _on_their_planes(
    points: Array, pieces: Integers, source: Integers, vertices: Array, faces: Integers
) -> Array:
    """Put corners of pieces back on the planes of the faces that they are pieces of."""
    triangles = vertices[faces[source]]
    normals = unit_normals(triangles)
    extent = float(np.ptp(vertices, axis=0).max())
    for _ in range(2):
        most = np.zeros(len(points))
        gaps = np.einsum("fk,fck->fc", normals, triangles[:, :1] - points[pieces])
        np.maximum.at(most, pieces.ravel(), np.abs(gaps).ravel())
        points = points + _moves(pieces, normals, gaps, len(points), np.maximum(20 * most, 1e-300))
        if most.max() < 1e-13 * extent:
            break
    return points


def _moves(triangles: Integers, normals: Array, gaps: Array, count: int, most: float | Array) -> Array:
    """(count, 3) least moves of corners that close gaps (F,) or (F, 3) along the normals of their faces."""
    matrix, right = np.zeros((count, 3, 3)), np.zeros((count, 3))
    gaps = np.broadcast_to(gaps[:, None] if gaps.ndim == 1 else gaps, triangles.shape)
    for corner in range(3):
        np.add.at(matrix, triangles[:, corner], normals[:, :, None] * normals[:, None, :])
        np.add.at(right, triangles[:, corner], normals * gaps[:, corner, None])
    sizes, axes = np.linalg.eigh(matrix)
    # Along directions in which the faces of a corner hardly differ it does not move.
    inverse = np.where(sizes > 1e-3 * sizes[:, 2:], 1 / np.maximum(sizes, 1e-300), 0.0)
    moves: Array = np.einsum("vij,vj,vkj,vk->vi", axes, inverse, axes, right)
    lengths = np.linalg.norm(moves, axis=1)
    moves *= np.minimum(1.0, most / np.maximum(lengths, 1e-300))[:, None]
    return moves
