"""Sharp edges and corners of a triangle mesh, and the faces that keep a distance from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import TriangleTree

from .mesh_parts import components

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]

_COPLANAR = 1e-4  # rad: single precision leaves less between faces of one plane
_SHARP_ANGLE = 0.6  # rad, 34 degrees: a larger angle is an edge, a smaller one may be a coarse tessellation
_FINEST = 32  # cut faces end in pieces of at most a 32nd of the distance
_MAX_PIECES = 400_000  # beyond it no piece is cut further
_MAX_CORNERS = 64  # of a facet; of more corners, the outermost ones give its width


@dataclass(frozen=True, slots=True, eq=False)
class SharpPlaces:
    """Sharp edges and corners, with the distance that contacts keep from them."""

    corners: Array
    """(2 S, 3) ends of segments, two by two; a point is a segment with equal ends."""
    radius: float

    def tree(self) -> TriangleTree:
        """Nearest points of the segments, as triangles with two equal corners."""
        first = np.arange(0, len(self.corners), 2)
        return TriangleTree(self.corners, np.stack([first, first + 1, first + 1], axis=1))

    def distance(self, points: Array) -> Array:
        """(B,) distances of points (B, 3) in m."""
        return _distance(self.tree(), points)

    def away(self, triangles: Array) -> tuple[Array, Integers]:
        """Pieces (K, 3, 3) of triangles (F, 3, 3) that keep the distance, and the triangle of each.

        Triangles that only partly keep it are halved until they are small against it.
        """
        tree, radius = self.tree(), self.radius
        extent = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
        finest = max(radius / _FINEST, extent / 1000)
        open_, owner = triangles, np.arange(len(triangles))
        kept: list[Array] = []
        owners: list[Integers] = []
        while len(open_):
            centres = open_.mean(axis=1)
            distance = _distance(tree, centres)
            reach = np.linalg.norm(open_ - centres[:, None], axis=2).max(axis=1)
            whole = distance - reach >= radius
            kept.append(open_[whole])
            owners.append(owner[whole])
            rest = ~whole & (distance + reach > radius)
            open_, owner, distance = open_[rest], owner[rest], distance[rest]
            if not len(open_):
                break
            sides = np.linalg.norm(np.roll(open_, -1, axis=1) - open_, axis=2)
            longest = sides.argmax(axis=1)
            small = sides.max(axis=1) <= finest
            if len(open_) > _MAX_PIECES:
                small[:] = True
            ends = open_[small]
            if len(ends):
                corners = _distance(tree, ends.reshape(-1, 3)).reshape(-1, 3).min(axis=1)
                clear = np.minimum(corners, distance[small]) >= radius * (1 - 1e-9)
                kept.append(ends[clear])
                owners.append(owner[small][clear])
            large = ~small
            open_, owner = _halves(open_[large], longest[large]), np.tile(owner[large], 2)
        return np.concatenate(kept), np.concatenate(owners)


def sharp_places(
    vertices: Array, faces: Integers, normals: Array, max_curvature: float
) -> SharpPlaces | None:
    """Return the edges and corners that are sharper than `max_curvature` in rad/m, or None.

    Faces in one plane count as one facet. An edge between two facets is sharp if the angle between their
    normals exceeds 34 degrees. It is also sharp if that angle exceeds the curvature times the smaller of the
    facets' widths across the edge. A corner of three facets or more follows the same rule, with the largest
    angle of a face from the mean normal and the longest edge at the corner.
    """
    edges, pairs, crowded = _adjacency(faces, len(vertices))
    turns = _angles(normals[pairs[:, 0]], normals[pairs[:, 1]])
    facets = components(len(faces), pairs[turns <= _COPLANAR])
    sharp = turns > _SHARP_ANGLE
    unsure = np.flatnonzero((turns > _COPLANAR) & ~sharp)
    widths = np.minimum(
        *(_widths(vertices, faces, facets, edges[unsure], facets[pairs[unsure, side]]) for side in (0, 1))
    )
    # Facets of one or two triangles: the distance of circumcentres, on a sphere the turn times its radius.
    few = (np.bincount(facets)[facets[pairs[unsure]]] <= 2).all(axis=1)
    centres = _between_circumcentres(vertices, faces, edges[unsure[few]], pairs[unsure[few]])
    widths[few] = np.maximum(widths[few], centres)
    sharp[unsure] = turns[unsure] > max_curvature * widths
    ends = [vertices[edges[sharp]].reshape(-1, 3), vertices[crowded].reshape(-1, 3)]
    points = vertices[_sharp_corners(vertices, faces, normals, facets, max_curvature)]
    ends.append(np.repeat(points, 2, axis=0))
    corners = np.concatenate(ends)
    return SharpPlaces(corners, 1 / max_curvature if max_curvature else np.inf) if len(corners) else None


def _adjacency(faces: Integers, count: int) -> tuple[Integers, Integers, Integers]:
    """Edges (E, 2) of two faces, those faces (E, 2), and edges of more than two."""
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    keys = np.sort(directed, axis=1) @ np.array([count, 1], dtype=np.int64)
    order = np.argsort(keys, kind="stable")
    found, starts, uses = np.unique(keys[order], return_index=True, return_counts=True)
    ends = np.stack(np.divmod(found, count), axis=1)
    two = starts[uses == 2]
    pairs = np.stack([order[two] // 3, order[two + 1] // 3], axis=1)
    return ends[uses == 2], pairs, ends[uses > 2]


def _angles(first: Array, second: Array) -> Array:
    across = np.linalg.norm(np.cross(first, second), axis=1)
    angles: Array = np.arctan2(across, (first * second).sum(axis=1))
    return angles


def _widths(vertices: Array, faces: Integers, facets: Integers, edges: Integers, sides: Integers) -> Array:
    """(E,) width of the facet `sides` across each edge: its extent, or twice the distance of its centroid."""
    starts, corners = _corners_of_facets(vertices, faces, facets)
    # The middle of a triangle is a third of its height away from an edge, that of a strip half of its width.
    share = np.where(np.bincount(facets)[sides] == 1, 2 / 3, 1.0)
    counts = np.diff(starts)[sides]
    widths: Array = np.zeros(len(edges))
    for rows in np.array_split(np.arange(len(edges)), max(1, int(counts.sum()) // 2_000_000)):
        if not len(rows):
            continue
        number = counts[rows]
        first = np.append(0, np.cumsum(number)[:-1])
        at = np.repeat(starts[sides[rows]] - first, number) + np.arange(number.sum())
        tail, head = vertices[edges[rows, 0]], vertices[edges[rows, 1]]
        along = head - tail
        along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        away = vertices[corners[at]] - np.repeat(tail, number, axis=0)
        along = np.repeat(along, number, axis=0)
        distance = np.linalg.norm(away - (away * along).sum(axis=1, keepdims=True) * along, axis=1)
        widths[rows] = np.maximum.reduceat(distance, first)
    return share * widths


def _between_circumcentres(vertices: Array, faces: Integers, edges: Integers, pairs: Integers) -> Array:
    """(E,) distance of the circumcentres of the two triangles at each edge, unfolded into one plane."""
    distance = np.zeros(len(edges))
    first, second = vertices[edges[:, 0]], vertices[edges[:, 1]]
    for side in (0, 1):
        own = faces[pairs[:, side]]
        third = vertices[own[(own != edges[:, :1]) & (own != edges[:, 1:])]]
        across = np.linalg.norm(np.cross(first - third, second - third), axis=1)
        cotangents = ((first - third) * (second - third)).sum(axis=1) / np.maximum(across, 1e-300)
        distance += np.linalg.norm(second - first, axis=1) / 2 * cotangents
    return distance


def _corners_of_facets(vertices: Array, faces: Integers, facets: Integers) -> tuple[Integers, Integers]:
    """Corners of each facet: those of number k are ``corners[starts[k]:starts[k + 1]]``."""
    keys = np.unique(np.repeat(facets, 3) * len(vertices) + faces.ravel())
    owner, corners = np.divmod(keys, len(vertices))
    count = int(facets.max()) + 1
    sizes = np.bincount(owner, minlength=count)
    if sizes.max() > _MAX_CORNERS:
        turns = np.random.default_rng(0).normal(size=(_MAX_CORNERS, 3))
        keep = sizes[owner] <= _MAX_CORNERS
        starts = np.append(0, np.cumsum(sizes))
        for facet in np.flatnonzero(sizes > _MAX_CORNERS):
            own = np.arange(starts[facet], starts[facet + 1])
            keep[own[(vertices[corners[own]] @ turns.T).argmax(axis=0)]] = True
        owner, corners = owner[keep], corners[keep]
        sizes = np.bincount(owner, minlength=count)
    return np.append(0, np.cumsum(sizes)), corners


def _sharp_corners(
    vertices: Array, faces: Integers, normals: Array, facets: Integers, max_curvature: float
) -> Integers:
    """Numbers of the vertices with a face whose normal is too far from the mean."""
    corners, owner = faces.ravel(), np.repeat(np.arange(len(faces)), 3)
    before, after = np.roll(faces, 1, axis=1).ravel(), np.roll(faces, -1, axis=1).ravel()
    sides = [vertices[other] - vertices[corners] for other in (before, after)]
    weights = _angles(*sides)
    means = np.zeros_like(vertices)
    np.add.at(means, corners, weights[:, None] * normals[owner])
    turns = np.zeros(len(vertices))
    np.maximum.at(turns, corners, _angles(means[corners], normals[owner]))
    lengths = np.zeros(len(vertices))
    np.maximum.at(lengths, corners, np.linalg.norm(sides[1], axis=1))
    meeting = np.bincount(
        np.unique(corners * (int(facets.max()) + 1) + facets[owner]) // (int(facets.max()) + 1),
        minlength=len(vertices),
    )
    limit = np.minimum(_SHARP_ANGLE, max_curvature * lengths)
    return np.flatnonzero((meeting >= 3) & (turns > np.maximum(limit, _COPLANAR)))


def _distance(tree: TriangleTree, points: Array) -> Array:
    distances: Array = np.linalg.norm(tree.closest(points)[0] - points, axis=1)
    return distances


def _halves(triangles: Array, longest: Integers) -> Array:
    """Both halves (2 N, 3, 3) of triangles cut across their longest side."""
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (longest + turn) % 3] for turn in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
