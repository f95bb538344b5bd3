"""The connected parts of a triangle mesh, and why a part is not solid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]

_FLAT = 1e-12  # of the cube of the largest extent: a smaller volume is rounding
_SAME_ANGLE = 1e-7  # rad: faces around an edge that differ by less lie in one plane


@dataclass(frozen=True, slots=True)
class Part:
    """Faces that are joined by their edges."""

    number: int
    of: int
    faces: Integers
    """Numbers of its faces in the mesh."""
    vertices: Array
    """(V, 3) corners of its own, shared with no other part."""
    triangles: Integers
    """(F, 3) numbers of those corners."""
    open_edges: int
    edges: int
    twisted: bool
    """Whether two of its faces are oriented differently."""
    volume: float
    """In m^3, negative where its normals point inward; meaningless for an open part."""

    @property
    def extent(self) -> float:
        """Largest side of the bounding box in m."""
        return float(np.ptp(self.vertices, axis=0).max())

    @property
    def flat(self) -> bool:
        """True if the part is closed but has no volume: a sheet with two sides."""
        return abs(self.volume) <= _FLAT * self.extent**3

    @property
    def fault(self) -> str | None:
        """Why the part is not solid; None if it is."""
        if self.open_edges:
            return f"not watertight: {self.open_edges} of {self.edges} edges do not have two faces"
        if self.twisted:
            return "faces are oriented differently; call trimesh.repair.fix_winding first"
        if self.flat:
            return f"flat: it encloses no volume ({self.volume:.3g} m^3)"
        return None

    def __str__(self) -> str:
        if self.of == 1:
            return "mesh"
        low, high = int(self.faces.min()), int(self.faces.max())
        kind = f"faces {low} to {high}" if high - low + 1 == len(self.faces) else f"{len(self.faces)} faces"
        middle = ", ".join(f"{x:.4g}" for x in (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2)
        return f"mesh: part {self.number} of {self.of} ({kind}, about [{middle}] m)"


def parts_of(vertices: Array, faces: Integers) -> list[Part]:
    """Split triangles (F, 3) into the parts that their edges join.

    An edge of more than two faces belongs to several parts that touch there, or to copies of one part. Faces
    around such an edge are joined in pairs that enclose a wedge of the inside.
    """
    # Faces with a repeated corner have no area and join nothing.
    real = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    kept = np.flatnonzero(real)
    corners = faces[kept]
    directed = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    owner = np.repeat(np.arange(len(kept)), 3)
    forward = directed[:, 0] < directed[:, 1]
    keys = np.sort(directed, axis=1) @ np.array([len(vertices), 1], dtype=np.int64)
    order = np.argsort(keys, kind="stable")
    _, starts, uses = np.unique(keys[order], return_index=True, return_counts=True)
    ups = np.add.reduceat(forward[order].astype(np.int64), starts) if len(starts) else np.zeros(0, np.int64)
    paired = (uses == 2) & (ups == 1)
    several = (uses > 2) & (2 * ups == uses)
    simple = starts[paired]
    joins = [np.stack([owner[order[simple]], owner[order[simple + 1]]], axis=1)]
    for start, count in zip(starts[several], uses[several], strict=True):
        around = order[start : start + count]
        joins.append(owner[_around(vertices, corners, directed, forward, owner, around)])
    # Faces that cannot be paired form one part, so that one error names them.
    for start, count in zip(starts[~paired & ~several], uses[~paired & ~several], strict=True):
        around = owner[order[start : start + count]]
        joins.append(np.stack([around[:-1], around[1:]], axis=1))
    labels = components(len(kept), np.concatenate(joins))
    edge_labels = labels[owner[order[starts]]] if len(starts) else np.zeros(0, np.int64)
    count = int(labels.max()) + 1 if len(labels) else 0
    open_edges = np.bincount(edge_labels[uses % 2 == 1], minlength=count)
    twisted = np.bincount(edge_labels[(uses % 2 == 0) & (2 * ups != uses)], minlength=count)
    edges = np.bincount(edge_labels, minlength=count)
    by_part = np.argsort(labels, kind="stable")
    groups = np.split(by_part, np.cumsum(np.bincount(labels, minlength=count))[:-1]) if count else []
    parts = []
    for number, group in enumerate(groups):
        used, inverse = np.unique(corners[group], return_inverse=True)
        own, triangles = vertices[used], inverse.reshape(-1, 3).astype(np.int64)
        parts.append(
            Part(
                number, count, kept[group], own, triangles, int(open_edges[number]), int(edges[number]),
                bool(twisted[number]), _volume(own[triangles]),
            )
        )  # fmt: skip
    return parts


def _volume(triangles: Array) -> float:
    """Volume in m^3 that closed triangles (F, 3, 3) enclose, negative where they face inward."""
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def _around(
    vertices: Array, corners: Integers, directed: Integers, forward: NDArray[np.bool_], owner: Integers,
    around: Integers,
) -> Integers:  # fmt: skip
    """Return pairs of rows of `around`, the faces at one edge. Each pair encloses a wedge of the inside."""
    first, second = np.sort(directed[around[0]])
    axis = vertices[second] - vertices[first]
    axis = axis / np.linalg.norm(axis)
    own = corners[owner[around]]
    third = own[(own != first) & (own != second)]
    if len(third) != len(around):
        raise InvalidInputError(f"mesh: faces at the edge of vertices {first} and {second} repeat a corner")
    away = vertices[third] - vertices[first]
    away = away - np.outer(away @ axis, axis)
    side = np.cross(axis, away[0])
    angles = np.arctan2(
        away @ side / max(np.linalg.norm(side), 1e-300), away @ away[0] / np.linalg.norm(away[0])
    )
    # Angles start at the widest gap, so that faces of one plane stay together where angles pass pi.
    rank = np.argsort(angles, kind="stable")
    gaps = np.diff(np.append(angles[rank], angles[rank[0]] + 2 * np.pi))
    rank = np.roll(rank, -(int(np.argmax(gaps)) + 1))
    steps = np.append(0, np.cumsum(np.mod(np.diff(angles[rank]), 2 * np.pi) > _SAME_ANGLE))
    plane = np.empty(len(rank), dtype=np.int64)
    plane[rank] = steps
    # Angles grow about the axis: a face that runs along it ends the inside. In one plane, ends come first.
    closes = forward[around]
    rank = np.lexsort((owner[around], ~closes, plane))
    depth = np.cumsum(np.where(closes[rank], -1, 1))
    rank = np.roll(rank, -(int(np.argmin(depth)) + 1))
    opening, closing = rank[~closes[rank]], rank[closes[rank]]
    return np.stack([around[opening], around[closing]], axis=1)


def components(count: int, joins: Integers) -> Integers:
    """(count,) number of each item's group, where `joins` (K, 2) connect items; numbered by first item."""
    sparse, graph = optional("scipy.sparse", "mesh"), optional("scipy.sparse.csgraph", "mesh")
    ones = np.ones(len(joins), dtype=bool)
    matrix = sparse.coo_matrix((ones, (joins[:, 0], joins[:, 1])), shape=(count, count))
    labels = graph.connected_components(matrix, directed=False)[1].astype(np.int64)
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]
