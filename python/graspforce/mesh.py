"""Contacts on a triangle mesh: points in space, projected to the nearest point of its surface.

Needs trimesh (the ``mesh`` extra) to read files and to check what was read.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from ._core import TriangleTree
from ._optional import optional
from .errors import InvalidInputError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["MeshSurface"]

_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
# A hand holds nothing smaller or larger: such a mesh is in other units than it says.
_SIZES = (1e-3, 5.0)


class MeshSurface:
    """The surface of a closed triangle mesh; a contact's three parameters are a point, projected on it.

    A mesh of several closed parts stands for their union: faces inside another part are excluded.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        The object, or anything that has ``vertices`` (V, 3) and ``faces`` (F, 3). Normals point out of it, as
        its corners are ordered; those of contacts point into it.
    unit : {"m", "dm", "cm", "mm", "in", "ft"} or float
        Unit of the vertices, or its length in m.
    normals : {"interpolated", "face"}
        Normals of the corners, interpolated over each face (smooth objects), or those of the faces.
    max_curvature : float, optional
        Exclude faces that bend towards a neighbour by more than this, in rad per m between their centres:
        sharp edges and tips. The inverse is the smallest radius a contact may have.
    allowed : array_like, optional
        (F,) bool: faces that contacts may touch at all.
    friction, max_normal_force : float, optional
        Of a contact on this surface; see `graspforce.surfaces.contacts_on`.
    check_watertight, check_size : bool
        Whether to refuse meshes with holes, or a largest extent outside 1 mm to 5 m.

    Attributes
    ----------
    bounds : numpy.ndarray
        (3, 2) box around the object in m, the parameters' range for one contact.
    allowed : numpy.ndarray
        (F,) bool: the faces left after all exclusions.
    vertices, faces : numpy.ndarray
        (V, 3) in m, and (F, 3).

    Raises
    ------
    InvalidInputError
        The mesh is empty, has holes, is inside out or of inconsistent orientation, is hardly in the unit
        given, or no face is left.
    GraspForceError
        trimesh is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> import trimesh
    >>> from graspforce.surfaces import MeshSurface
    >>> box = MeshSurface(trimesh.creation.box((60, 40, 20)), unit="mm", normals="face")
    >>> points, normals = box.contacts(np.array([[0.1, 0.01, 0.0]]))
    >>> points.round(6).tolist(), normals.tolist()
    ([[0.03, 0.01, 0.0]], [[-1.0, 0.0, 0.0]])
    """

    num_params: ClassVar[int] = 3

    def __init__(
        self,
        mesh: Any,
        *,
        unit: Literal["m", "dm", "cm", "mm", "in", "ft"] | float = "m",
        normals: Literal["interpolated", "face"] = "interpolated",
        max_curvature: float | None = None,
        allowed: ArrayLike | None = None,
        friction: float | None = None,
        max_normal_force: float | None = None,
        check_watertight: bool = True,
        check_size: bool = True,
    ) -> None:
        if normals not in ("interpolated", "face"):
            raise InvalidInputError(f"normals: {normals!r} is neither 'interpolated' nor 'face'")
        self.friction, self.max_normal_force = friction, max_normal_force
        checked = _checked_mesh(mesh, _metres(unit), check_watertight, check_size)
        self.vertices = np.array(checked.vertices, dtype=np.float64)
        self.faces = np.array(checked.faces, dtype=np.int64)
        self.bounds = np.array(checked.bounds, dtype=np.float64).T.copy()
        self._outward = np.array(checked.face_normals, dtype=np.float64)
        # Trimesh drops faces without area from its normals' computation, never from the list: they stay
        # unused.
        self.allowed = np.linalg.norm(self._outward, axis=1) > 0.5
        if allowed is not None:
            given = np.asarray(allowed)
            if given.shape != self.allowed.shape or given.dtype.kind != "b":
                raise InvalidInputError(
                    f"allowed: {given.dtype} of shape {given.shape}, expected bool of {self.allowed.shape}"
                )
            self.allowed &= given
        if checked.is_watertight:
            self.allowed &= ~_hidden(checked)
        if max_curvature is not None:
            self.allowed &= _curvature(checked) <= max_curvature
        if not self.allowed.any():
            raise InvalidInputError(
                f"max_curvature: {max_curvature} and `allowed` leave none of {len(self.faces)} faces"
            )
        self._kept = np.flatnonzero(self.allowed)
        self._tree = TriangleTree(self.vertices, self.faces[self._kept])
        self._corner_normals: Array | None = None
        if normals == "interpolated":
            self._corner_normals = np.array(checked.vertex_normals, dtype=np.float64)

    @classmethod
    def load(cls, path: str | Path, **options: Any) -> MeshSurface:
        """Read a file of any format trimesh knows, parts joined to one mesh; options as for the class."""
        trimesh = _trimesh()
        try:
            mesh = trimesh.load_mesh(path, process=True)
        except (OSError, ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
            raise InvalidInputError(f"path: {path} is not a mesh that can be read: {error}") from error
        if isinstance(mesh, trimesh.Scene):
            mesh = mesh.to_mesh()
        # Corners that differ only in texture or stored normals are one corner of the surface.
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
        try:
            return cls(mesh, **options)
        except InvalidInputError as error:
            raise InvalidInputError(f"path {path}: {error}") from error

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals into the object (B, 3) nearest to the points `params` (B, 3), in m."""
        points, rows, weights = self._tree.closest(params)
        faces = self._kept[rows]
        outward = self._outward[faces]
        if self._corner_normals is not None:
            smooth = (weights[:, :, None] * self._corner_normals[self.faces[faces]]).sum(axis=1)
            lengths = np.linalg.norm(smooth, axis=1, keepdims=True)
            # Normals of a folded corner can cancel, or point through their own face.
            usable = (lengths > 1e-6) & ((smooth * outward).sum(axis=1, keepdims=True) > 0)
            outward = np.where(usable, smooth / np.maximum(lengths, 1e-6), outward)
        return points, -outward + 0.0


def _metres(unit: str | float) -> float:
    if isinstance(unit, str):
        if unit not in _UNITS:
            raise InvalidInputError(f"unit: {unit!r} is none of {', '.join(_UNITS)}")
        return _UNITS[unit]
    if not 0 < unit < np.inf:
        raise InvalidInputError(f"unit: {unit} must be finite and positive")
    return float(unit)


def _trimesh() -> Any:
    return optional("trimesh", "reading and checking meshes", "mesh")


def _checked_mesh(mesh: Any, metres: float, check_watertight: bool, check_size: bool) -> Any:
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")) or len(mesh.faces) == 0:
        raise InvalidInputError(f"mesh: {mesh!r} has no triangles")
    vertices = np.asarray(mesh.vertices, dtype=np.float64) * metres
    if not np.isfinite(vertices).all():
        row = int(np.argwhere(~np.isfinite(vertices))[0, 0])
        raise InvalidInputError(f"mesh: vertex {row} is not finite: {vertices[row].tolist()}")
    # Always a copy: what is cached and checked must not change with the caller's mesh.
    own = _trimesh().Trimesh(vertices, np.asarray(mesh.faces), process=False)
    extent = float(own.extents.max())
    if check_size and not _SIZES[0] <= extent <= _SIZES[1]:
        raise InvalidInputError(
            f"unit: the mesh would be {extent:.4g} m long, outside {_SIZES[0]:g} m to {_SIZES[1]:g} m; "
            "say which unit its vertices are in, or pass check_size=False"
        )
    if check_watertight and not own.is_watertight:
        edges = np.sort(own.edges, axis=1)
        uses = np.unique(edges, axis=0, return_counts=True)[1]
        raise InvalidInputError(
            f"mesh: not watertight: {int((uses != 2).sum())} of {len(uses)} edges do not have two faces; "
            "repair it "
            "(trimesh.repair), take its convex hull, or pass check_watertight=False"
        )
    if not own.is_winding_consistent:
        raise InvalidInputError("mesh: faces are not oriented alike, so normals have no side; "
                                "see trimesh.repair.fix_winding")  # fmt: skip
    if own.is_watertight and own.volume < 0:
        raise InvalidInputError(
            f"mesh: inside out: its normals point inward (volume {own.volume:.3g} m^3); call mesh.invert() "
            "first"
        )
    return own


def _curvature(mesh: Any) -> Array:
    """(F,) largest angle to a neighbour in rad, by the distance in m between the two centres."""
    pairs, angles = np.asarray(mesh.face_adjacency), np.asarray(mesh.face_adjacency_angles)
    centres = np.asarray(mesh.triangles_center)
    apart = np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    bend = angles / np.maximum(apart, 1e-12)
    worst = np.zeros(len(mesh.faces))
    np.maximum.at(worst, pairs.ravel(), np.repeat(bend, 2))
    return worst


def _hidden(mesh: Any) -> NDArray[np.bool_]:
    """(F,) whether a face lies inside another closed part, by winding numbers of points just outside it."""
    groups = importlib.import_module("trimesh.graph").connected_components(
        mesh.face_adjacency, nodes=np.arange(len(mesh.faces)), min_len=1
    )
    hidden = np.zeros(len(mesh.faces), dtype=bool)
    if len(groups) < 2:
        return hidden
    triangles = np.asarray(mesh.triangles)
    # Parts often share a plane where they touch: there a face is hidden by its neighbour on the other side.
    outside = np.asarray(mesh.triangles_center) + 1e-4 * mesh.extents.max() * np.asarray(mesh.face_normals)
    part = np.empty(len(triangles), dtype=np.int64)
    for number, group in enumerate(groups):
        part[group] = number
    for number, group in enumerate(groups):
        corners = triangles[group]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        near = ((outside >= low) & (outside <= high)).all(axis=1) & (part != number)
        for rows in np.array_split(np.flatnonzero(near), max(1, near.sum() * len(group) // 2_000_000)):
            hidden[rows] |= _winding_number(outside[rows], corners) > 0.5
    return hidden


def _winding_number(points: Array, triangles: Array) -> Array:
    """How often closed triangles (F, 3, 3) wind around points (B, 3), by van Oosterom and Strackee."""
    a, b, c = np.moveaxis(triangles[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=-1)
    rest = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    angles: Array = np.arctan2(volume, rest).sum(axis=1) / (2 * np.pi)
    return angles
