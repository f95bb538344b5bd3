"""Contacts on a triangle mesh: points in space, projected to the nearest point of its surface.

Needs trimesh (the ``mesh`` extra) to read files and to check what was read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from graspforce._checks import chosen, finite_array, real_number
from graspforce._core import TriangleTree
from graspforce._optional import optional
from graspforce.errors import InvalidInputError

from .mesh_checks import checked_mesh, curvature, hidden_faces, metres

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["MeshSurface"]


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
    center : numpy.ndarray
        (3,) centre of mass of the solid at uniform density, in m; of a mesh with holes the middle of its box.

    Raises
    ------
    InvalidInputError
        The mesh is empty, has holes, is inside out or of inconsistent orientation, is hardly in the unit
        given, or no face is left.
    MissingExtraError
        trimesh is not installed.

    Notes
    -----
    Nothing of it changes once it is made: threads may share it. It can be copied and pickled.

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
        chosen("normals", normals, ("interpolated", "face"))
        if max_curvature is not None:
            max_curvature = real_number("max_curvature", max_curvature, least=0, finite=False)
        self.friction, self.max_normal_force = friction, max_normal_force
        checked = checked_mesh(mesh, metres(unit), check_watertight, check_size)
        self.vertices = np.array(checked.vertices, dtype=np.float64)
        self.faces = np.array(checked.faces, dtype=np.int64)
        self.bounds = np.array(checked.bounds, dtype=np.float64).T.copy()
        middle = checked.center_mass if checked.is_watertight else self.bounds.mean(axis=1)
        self.center = np.array(middle, dtype=np.float64)
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
            self.allowed &= ~hidden_faces(checked)
        if max_curvature is not None:
            self.allowed &= curvature(checked) <= max_curvature
        if not self.allowed.any():
            raise InvalidInputError(
                f"max_curvature: {max_curvature} and `allowed` leave none of {len(self.faces)} faces"
            )
        self._kept = np.flatnonzero(self.allowed)
        self._tree = TriangleTree(self.vertices, self.faces[self._kept])
        self._corner_normals: Array | None = None
        if normals == "interpolated":
            self._corner_normals = np.array(checked.vertex_normals, dtype=np.float64)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_tree"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._tree = TriangleTree(self.vertices, self.faces[self._kept])

    def __repr__(self) -> str:
        size = " x ".join(f"{extent:.3g}" for extent in np.ptp(self.bounds, axis=1))
        return f"MeshSurface({len(self.faces)} faces, {int(self.allowed.sum())} allowed, {size} m)"

    @classmethod
    def load(cls, path: str | Path, **options: Any) -> MeshSurface:
        """Read a file of any format trimesh knows, parts joined to one mesh; options as for the class."""
        trimesh = optional("trimesh", "mesh")
        try:
            mesh = trimesh.load_mesh(path, process=True)
            if isinstance(mesh, trimesh.Scene):
                mesh = mesh.to_mesh()
            # Corners that differ only in texture or stored normals are one corner of the surface.
            mesh.merge_vertices(merge_tex=True, merge_norm=True)
        except Exception as error:  # whatever a parser of someone else's makes of a broken file
            raise InvalidInputError(f"path: {path} is not a mesh that can be read: {error}") from error
        try:
            return cls(mesh, **options)
        except InvalidInputError as error:
            raise InvalidInputError(f"path {path}: {error}") from error

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals into the object (B, 3) nearest to the points `params` (B, 3), in m."""
        points, rows, weights = self._tree.closest(params)
        return points, self._inward(self._kept[rows], weights)

    def on_faces(self, faces: ArrayLike, weights: ArrayLike) -> tuple[Array, Array]:
        """Points and unit normals into the object (B, 3) on given faces.

        Parameters
        ----------
        faces : array_like
            (B,) numbers of faces, each one of those allowed.
        weights : array_like
            (B, 3) barycentric coordinates: not negative, each row's sum 1 to a millionth.

        Raises
        ------
        InvalidInputError
            There is no such face, contacts may not touch it, or weights are no place on it.
        """
        rows, shares = np.asarray(faces), finite_array("weights", weights)
        if rows.ndim != 1 or rows.dtype.kind not in "iu" or shares.shape != (len(rows), 3):
            raise InvalidInputError(
                f"faces and weights: {rows.dtype} of shape {rows.shape} and {shares.shape}, "
                "expected whole numbers (B,) and (B, 3)"
            )
        for row, (face, share) in enumerate(zip(rows, shares, strict=True)):
            if not 0 <= face < len(self.faces):
                raise InvalidInputError(f"faces, row {row}: {face} is none of {len(self.faces)} faces")
            if not self.allowed[face]:
                raise InvalidInputError(f"faces, row {row}: {face} is excluded from contact")
            if share.min() < 0 or abs(share.sum() - 1) > 1e-6:
                raise InvalidInputError(
                    f"weights, row {row}: {share.tolist()} are not barycentric: none negative, with sum 1"
                )
        points = np.einsum("bi,bij->bj", shares, self.vertices[self.faces[rows]])
        return points, self._inward(rows, shares)

    def _inward(self, faces: NDArray[np.int64], weights: Array) -> Array:
        outward = self._outward[faces]
        if self._corner_normals is not None:
            smooth = (weights[:, :, None] * self._corner_normals[self.faces[faces]]).sum(axis=1)
            lengths = np.linalg.norm(smooth, axis=1, keepdims=True)
            # Normals of a folded corner can cancel, or point through their own face.
            usable = (lengths > 1e-6) & ((smooth * outward).sum(axis=1, keepdims=True) > 0)
            outward = np.where(usable, smooth / np.maximum(lengths, 1e-6), outward)
        return -outward + 0.0
