"""Convex parts of a solid: MuJoCo collides convex shapes, and the hull of a mug has twice its volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Triangles = tuple[Array, NDArray[np.int64]]


_CUTS = (0.2, 0.35, 0.5, 0.65, 0.8)
_FINE = 3000  # triangles: of more, those are left out that matter less than these shares of the extent
_COARSER = 2e-4, 5e-4, 1e-3
_SLIVER = 1e-4  # of the solid's volume: a smaller piece is dropped


def hull_of(vertices: Array) -> Triangles:
    """Vertices and outward triangles of the convex hull of points (V, 3)."""
    manifold = optional("manifold3d", "hands")
    return _triangles(_simplified(manifold.Manifold.hull_points(np.ascontiguousarray(vertices))).hull())


def convex_parts(vertices: Array, faces: NDArray[np.int64], excess: float, most: int) -> list[Triangles]:
    """Convex parts whose union covers a closed solid and exceeds its volume by at most the share `excess`.

    The part with the largest excess is cut where the sum of the hulls' volumes is the least, until the whole
    excess is small enough or there are `most` parts. Planes are normal to the principal axes.
    """
    manifold = optional("manifold3d", "hands")
    solid = manifold.Manifold(
        manifold.Mesh64(np.ascontiguousarray(vertices), np.ascontiguousarray(faces, dtype=np.uint64))
    )
    if solid.status() != manifold.Error.NoError:
        raise InvalidInputError(f"mesh: its parts cannot be cut into convex ones: {solid.status().name}")
    solid = _simplified(solid)
    volume = solid.volume()
    axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=False)[2]
    pieces = _pieces(solid, volume)
    while len(pieces) < most and sum(waste for waste, _ in pieces) > excess * volume:
        pieces.sort(key=lambda piece: -piece[0])
        best = _best_cut(pieces[0][1], axes, volume)
        if best is None:
            break
        pieces[:1] = best
    return [_triangles(piece.hull()) for _, piece in pieces]


def _simplified(solid: Any) -> Any:
    """Leave out corners of a fine mesh that hardly matter, until it is small or coarse enough."""
    box = np.array(solid.bounding_box()).reshape(2, 3)
    extent = float((box[1] - box[0]).max())
    for share in _COARSER:
        if solid.num_tri() <= _FINE:
            break
        solid = solid.simplify(share * extent)
    return solid


def _pieces(solid: Any, volume: float) -> list[tuple[float, Any]]:
    """Return connected pieces, each with the volume by which its hull exceeds it."""
    found = [piece for piece in solid.decompose() if piece.volume() > _SLIVER * volume]
    return [(piece.hull().volume() - piece.volume(), piece) for piece in found]


def _best_cut(piece: Any, axes: Array, volume: float) -> list[tuple[float, Any]] | None:
    points = np.asarray(piece.to_mesh64().vert_properties)[:, :3]
    best, least = None, (np.inf, np.inf, np.inf)
    now = piece.hull().volume() - piece.volume()
    for axis in axes:
        along = points @ axis
        low, high = float(along.min()), float(along.max())
        for share in _CUTS:
            halves = piece.split_by_plane(axis.tolist(), low + share * (high - low))
            found = [part for half in halves for part in _pieces(half, volume)]
            # Of a ring no single cut lowers the waste; one across its longest side is a beginning.
            rank = round(sum(w for w, _ in found) / max(now, 1e-300), 1), low - high, abs(share - 0.5)
            if found and rank < least:
                best, least = found, rank
    return best


def _triangles(solid: Any) -> Triangles:
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties[:, :3], dtype=np.float64)
    return vertices, np.array(mesh.tri_verts, dtype=np.int64)
