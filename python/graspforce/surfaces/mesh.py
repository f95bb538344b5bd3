"""Contacts on a triangle mesh: points in space, projected to the nearest point of its surface.

Needs trimesh (the ``mesh`` extra) to read files and to check what was read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from graspforce._core import TriangleTree, unwarned_grasp
from graspforce._internal.checks import chosen, finite_array, real_number, strength
from graspforce._internal.vectors import read_only
from graspforce.errors import InvalidInputError

from .mesh_checks import checked_mesh, metres
from .mesh_normals import barycentric, center_of_mass, corner_normals, refuse_outward, unit_normals
from .mesh_reading import triangles_of
from .mesh_sharpness import SharpPlaces, sharp_places

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp

    Array = NDArray[np.float64]

_FAR = 2.0
"""Largest distance of a contact, in extents of the mesh. Beyond it the units or the frame are wrong."""


class MeshSurface:
    """The surface of a closed triangle mesh. The three parameters of a contact are a point in space.

    The contact is the nearest point of the surface. A mesh of several closed parts has the boundary of their
    union as its surface. A part whose normals point inward is a cavity of the part around it.

    Parameters
    ----------
    mesh : path-like or trimesh.Trimesh
        The object: a file, read within the limits of `graspforce.files.load_mesh`, or anything that has
        ``vertices`` (V, 3) and ``faces`` (F, 3). The corners of a face are ordered so that its normal points
        out of the object. Normals of contacts point into the object.
    unit : {"m", "dm", "cm", "mm", "in", "ft"} or float
        Unit of the vertices, or its length in m.
    normals : {"interpolated", "face"}
        Normals of the corners, interpolated over each face (smooth objects), or those of the faces.
    max_curvature : float, optional
        In rad/m. Contacts keep a distance of at least ``1 / max_curvature`` from sharper edges and corners.
        An edge is sharp if it turns by more than 34 degrees, or by more than `max_curvature` times the
        smaller width of the plane faces beside it. Corners are treated alike.
    allowed : array_like, optional
        (F,) bool: True for faces of `mesh` that contacts may touch.
    friction, max_normal_force : float, optional
        Friction coefficient, and limit in N, of a contact on this surface.
    check_watertight, check_size : bool
        True refuses a mesh with holes, or one whose largest extent is outside 1 mm to 5 m.

    Attributes
    ----------
    bounds : numpy.ndarray
        (3, 2) box around the object in m: the bounds of one contact's parameters.
    allowed : numpy.ndarray
        (F,) bool: True for faces that contacts may touch, wholly or in part.
    vertices, faces : numpy.ndarray
        (V, 3) in m, and (F, 3), as given.
    boundary : tuple of numpy.ndarray
        Vertices (V', 3) in m and faces (F', 3) of the boundary of the parts' union. They are `vertices` and
        `faces` if no parts have to be joined.
    length_scale : float
        Half the largest extent in m, by which torques on the object compare with forces.
    center : numpy.ndarray
        (3,) centre of mass in m of the solid at uniform density. For a mesh with holes it is the middle of
        the box.

    Raises
    ------
    InvalidInputError
        The file cannot be read, or has more than 256 separate parts. The mesh is empty, has holes, is inside
        out, or its faces are oriented differently. Its extent does not fit the unit. No face remains that
        contacts may touch. If the mesh has several parts, the message names the part.
    MissingExtraError
        SciPy is not installed, or manifold3d, if several parts have to be joined.

    Warns
    -----
    GraspWarning
        With ``check_watertight=False``, a part among several has holes: it is not joined with the others.

    Notes
    -----
    It is immutable. Threads may share it; it can be copied and pickled.

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
        strength(friction, max_normal_force)
        self.friction, self.max_normal_force = friction, max_normal_force
        with triangles_of(mesh) as given:
            checked = checked_mesh(given, metres(unit), check_watertight, check_size)
        surface = checked.boundary
        self.vertices, self.faces = read_only(checked.vertices), read_only(checked.faces)
        self.boundary = read_only(surface.vertices), read_only(surface.faces)
        self._source = surface.source
        triangles = surface.vertices[surface.faces]
        self.bounds = read_only(np.stack([triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))], axis=1))
        center = center_of_mass(triangles) if surface.solid else self.bounds.mean(axis=1)
        # Rounding is no place: a centre at zero is zero.
        self.center = read_only(np.where(np.abs(center) > 1e-12 * self.length_scale, center, 0.0))
        self._outward = unit_normals(self.vertices[self.faces])
        # Faces without area have no normal: they stay in the list, unused.
        usable = np.linalg.norm(self._outward, axis=1) > 0.5
        if allowed is not None:
            given = np.asarray(allowed)
            if given.shape != usable.shape or given.dtype.kind != "b":
                raise InvalidInputError(
                    f"allowed: {given.dtype} of shape {given.shape}, expected bool of {usable.shape}"
                )
            usable &= given
        # What contacts may touch: pieces of the boundary, and the face of which each is one.
        self._pieces = np.flatnonzero(usable[self._source])
        self._owner = self._source[self._pieces]
        self._cut: Array | None = None
        self._sharp: SharpPlaces | None = None
        if max_curvature is not None and max_curvature < np.inf:
            self._sharp = sharp_places(*self.boundary, self._outward[self._source], max_curvature)
        if self._sharp is not None:
            self._cut, left = self._sharp.away(triangles[self._pieces])
            self._owner = self._owner[left]
        self.allowed = read_only(np.bincount(self._owner, minlength=len(self.faces)) > 0)
        if not self.allowed.any():
            raise InvalidInputError(
                f"max_curvature: none of {len(self.faces)} faces remains: each is excluded by `allowed`, or "
                f"too near to an edge or corner that is sharper than {max_curvature} rad/m"
            )
        self._tree = self._new_tree()
        self._corner_normals: Array | None = None
        if normals == "interpolated":
            self._corner_normals = corner_normals(checked.parts, self._outward)
        self._made = True

    def __setattr__(self, name: str, value: object) -> None:
        if "_made" in vars(self):
            raise AttributeError(f"{name}: a MeshSurface is immutable; make another one")
        super().__setattr__(name, value)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_tree"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for name in ("vertices", "faces", "bounds", "center", "allowed"):
            vars(self)[name] = read_only(state[name])
        vars(self)["boundary"] = read_only(state["boundary"][0]), read_only(state["boundary"][1])
        vars(self)["_tree"] = self._new_tree()

    def _new_tree(self) -> TriangleTree:
        if self._cut is not None:
            return TriangleTree(self._cut.reshape(-1, 3), np.arange(3 * len(self._cut)).reshape(-1, 3))
        vertices, faces = self.boundary
        return TriangleTree(vertices, faces[self._pieces])

    def __repr__(self) -> str:
        size = " x ".join(f"{extent:.3g}" for extent in np.ptp(self.bounds, axis=1))
        return f"MeshSurface({len(self.faces)} faces, {int(self.allowed.sum())} allowed, {size} m)"

    @classmethod
    def load(cls, path: str | Path, **options: Any) -> MeshSurface:
        """Read a file; options as for the class, which takes paths too."""
        return cls(path, **options)

    @property
    def length_scale(self) -> float:
        """Half the largest extent in m."""
        return float(np.ptp(self.bounds, axis=1).max()) / 2

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals into the object (B, 3) nearest to the points `params` (B, 3), in m."""
        points, rows, _ = self._tree.closest(params)
        return points, self._inward(self._owner[rows], points)

    def settled(self, params: Array) -> Array:
        """Points (B, 3) of the contacts of `params` (B, 3), in m: parameters of the same contacts.

        From inside the object the nearest point jumps from face to face; from the surface it hardly does.
        """
        return self._tree.closest(params)[0]

    def flat_faces(self) -> tuple[Array, Array]:
        """Triangles (T, 3, 3) in m that contacts may touch, and their unit normals (T, 3) into the object.

        Raises
        ------
        InvalidInputError
            Normals are interpolated: they change within a face.
        """
        if self._corner_normals is not None:
            raise InvalidInputError(
                'normals: "interpolated", but they must be constant on a face; use "face"'
            )
        triangles = self._cut
        if triangles is None:
            vertices, faces = self.boundary
            triangles = vertices[faces[self._pieces]]
        return triangles, -self._outward[self._owner] + 0.0

    def nearest(self, positions: Array) -> tuple[Array, Array]:
        """Return what `contacts` does, for positions (m, 3) in m that must be near the object.

        Raises
        ------
        InvalidInputError
            A position is further from the mesh than twice its extent.
        """
        points, normals = self.contacts(positions)
        away, extent = np.linalg.norm(points - positions, axis=1), float(np.ptp(self.bounds, axis=1).max())
        if (away > _FAR * extent).any():
            at = int(np.argmax(away > _FAR * extent))
            distance = f"{away[at]:.4g} m away from the mesh, which is {extent:.4g} m long"
            raise InvalidInputError(
                f"positions, contact {at}: {distance}; give positions in m, and check the mesh's `unit`"
            )
        return points, normals

    def grasp(
        self,
        positions: ArrayLike,
        normals: ArrayLike | None = None,
        *,
        check_normals: bool = True,
        **grasp_options: Any,
    ) -> Grasp:
        """Return a grasp of contacts on this object.

        Parameters
        ----------
        positions : array_like
            (m, 3) in m. Without `normals` they are moved to the nearest points that contacts may touch.
        normals : array_like, optional
            (m, 3) into the object, of any length, for positions that stay where they are.
        check_normals : bool
            True refuses given normals that point out of the object.
        **grasp_options
            As for `graspforce.Grasp`; friction and limits are by default those of the surface.

        Raises
        ------
        InvalidInputError
            A normal points out of the object. A position without a normal is further from the object than
            twice its extent. The message names the contact and the value.
        InvalidGraspError
            As for `graspforce.Grasp`.

        Examples
        --------
        >>> import trimesh
        >>> from graspforce.surfaces import MeshSurface
        >>> ball = MeshSurface(trimesh.creation.icosphere(radius=0.05), friction=0.5)
        >>> ball.grasp([(0.1, 0, 0), (-0.1, 0, 0)])
        Grasp(spatial, 2 contacts, 16 extreme forces)
        >>> box = MeshSurface(trimesh.creation.box((0.06, 0.04, 0.02)))
        >>> box.grasp([(0.03, 0, 0), (-0.03, 0, 0)], [(1, 0, 0), (1, 0, 0)])
        Traceback (most recent call last):
        ...
        graspforce.errors.InvalidInputError: normals, contact 0: [1.0, 0.0, 0.0] points out of the mesh: the
        outward normal at the nearest point is [1.0, 0.0, 0.0]; turn it round, or pass check_normals=False
        """
        known = {"friction": self.friction, "max_normal_force": self.max_normal_force}
        options = {name: value for name, value in known.items() if value is not None} | grasp_options
        places = finite_array("positions", positions)
        if places.ndim != 2 or places.shape[1] != 3:
            raise InvalidInputError(f"positions: shape {places.shape}, expected (m, 3)")
        if normals is None:
            return unwarned_grasp(*self.nearest(places), **options)
        if check_normals:
            self.check_normals(places, normals)
        return unwarned_grasp(places, normals, **options)

    def check_normals(self, positions: ArrayLike, normals: ArrayLike) -> None:
        """Refuse normals (m, 3) of contacts at positions (m, 3) that point out of the object.

        A normal is compared with the outward normals of the faces nearest to its contact, `allowed` or not.
        On an edge or a corner, the inward normals of all faces there are accepted, and all directions between
        them.

        Raises
        ------
        InvalidInputError
            A normal points out; the message names the contact and the value.
        """
        refuse_outward(*self.boundary, self._outward[self._source], positions, normals)

    def on_faces(self, faces: ArrayLike, weights: ArrayLike) -> tuple[Array, Array]:
        """Points and unit normals into the object (B, 3) on given faces.

        Parameters
        ----------
        faces : array_like
            (B,) numbers of `faces`, each one of those allowed.
        weights : array_like
            (B, 3) barycentric coordinates: not negative, each row's sum 1 to a millionth.

        Raises
        ------
        InvalidInputError
            A face does not exist, contacts may not touch it at this point, or weights are not barycentric.
        """
        rows, shares = np.asarray(faces), finite_array("weights", weights)
        _check_places(rows, shares, len(self.faces))
        for row, face in enumerate(rows):
            if not self.allowed[face]:
                raise InvalidInputError(f"faces, row {row}: {face} is excluded from contact")
        points: Array = np.einsum("bi,bij->bj", shares, self.vertices[self.faces[rows]])
        self._refuse_inside(rows, points)
        return points, self._inward(rows, points)

    def _refuse_inside(self, faces: NDArray[np.int64], points: Array) -> None:
        """Refuse points (B, 3) of given faces that another part covers, or that are near a sharp place."""
        near = 1e-6 * float(np.ptp(self.bounds, axis=1).max())
        if self.boundary[1] is not self.faces:
            vertices, pieces = self.boundary
            away = np.linalg.norm(TriangleTree(vertices, pieces).closest(points)[0] - points, axis=1)
            if (away > near).any():
                row = int(np.argmax(away > near))
                raise InvalidInputError(
                    f"weights, row {row}: {points[row].tolist()} on face {faces[row]} lies in another part"
                )
        if self._sharp is not None:
            away, radius = self._sharp.distance(points), self._sharp.radius
            if (away < radius - near).any():
                row = int(np.argmax(away < radius - near))
                raise InvalidInputError(
                    f"weights, row {row}: {points[row].tolist()} on face {faces[row]} is {away[row]:.4g} m "
                    f"from a sharp edge or corner, less than the radius {radius:.4g} m"
                )

    def _inward(self, faces: NDArray[np.int64], points: Array) -> Array:
        """Return unit normals into the object at points (B, 3) of given faces."""
        outward = self._outward[faces]
        if self._corner_normals is not None:
            weights = barycentric(self.vertices[self.faces[faces]], points)
            smooth = (weights[:, :, None] * self._corner_normals[faces]).sum(axis=1)
            lengths = np.linalg.norm(smooth, axis=1, keepdims=True)
            # Normals of a folded corner can cancel, or point through their own face.
            usable = (lengths > 1e-6) & ((smooth * outward).sum(axis=1, keepdims=True) > 0)
            outward = np.where(usable, smooth / np.maximum(lengths, 1e-6), outward)
        return -outward + 0.0


def _check_places(faces: NDArray[Any], weights: Array, count: int) -> None:
    """Refuse numbers of faces (B,) that do not exist, and weights (B, 3) that are not barycentric."""
    if faces.ndim != 1 or faces.dtype.kind not in "iu" or weights.shape != (len(faces), 3):
        raise InvalidInputError(
            f"faces and weights: {faces.dtype} of shape {faces.shape} and {weights.shape}, "
            "expected whole numbers (B,) and (B, 3)"
        )
    for row, (face, share) in enumerate(zip(faces, weights, strict=True)):
        if not 0 <= face < count:
            raise InvalidInputError(f"faces, row {row}: {face}, expected 0 to {count - 1}")
        if share.min() < 0 or abs(share.sum() - 1) > 1e-6:
            raise InvalidInputError(
                f"weights, row {row}: {share.tolist()} must not be negative, and must have the sum 1"
            )
