"""The grasp that a viewer shows: how it is varied, its quality, and forces over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import ForceDistributor, Grasp, TriangleTree, unwarned_grasp
from graspforce._internal.checks import (
    chosen,
    finite_array,
    finite_vector,
    instance,
    real_number,
    triangles,
    whole_number,
)
from graspforce._internal.vectors import read_only
from graspforce.errors import InfeasibleWrenchError, InvalidInputError
from graspforce.surfaces.mesh_checks import outer_surface

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import ForceSolution, Quality
    from graspforce.typing import Criterion


class ViewState:
    """A spatial grasp under the viewer's sliders.

    It is changed by one thread at a time.

    Parameters
    ----------
    grasp : Grasp
        The grasp as given.
    mesh : tuple of array_like, optional
        Vertices (v, 3) in m and triangles (t, 3) of the object; moved contacts stay on it.
    wrenches : array_like, optional
        (T, 6) external wrenches to play.
    times : array_like, optional
        (T,) ascending times of the wrenches in s.

    Raises
    ------
    InvalidInputError
        The grasp is planar, the wrenches are not (T, 6), or the times are not (T,) and ascending.

    Examples
    --------
    >>> import graspforce as gf
    >>> from graspforce.viewer import ViewState
    >>> grasp = gf.Grasp([(-1, 0, 0), (1, 0, 0)], [(1, 0, 0), (-1, 0, 0)], torsion=0.1)
    >>> state = ViewState(grasp)
    >>> before = state.quality("max").epsilon
    >>> state.scale(friction=1.5, limits=2.0)
    >>> bool(state.quality("max").epsilon > before)
    True
    """

    def __init__(
        self,
        grasp: Grasp,
        mesh: tuple[ArrayLike, ArrayLike] | None = None,
        wrenches: ArrayLike | None = None,
        times: ArrayLike | None = None,
    ) -> None:
        instance("grasp", grasp, Grasp)
        if grasp.wrench_dim != 6:
            raise InvalidInputError("grasp: planar; graspforce.plotting draws it")
        self.mesh: tuple[NDArray[np.float64], NDArray[np.int64]] | None = None
        if mesh is not None:
            vertices, faces = outer_surface(*triangles("mesh", mesh))
            corners = vertices[faces]
            # A triangle without area has no normal, and no point that others do not have.
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            self.mesh = vertices, faces[np.linalg.norm(across, axis=1) > 0]
        self._tree: TriangleTree | None = None
        given = np.zeros((0, 6)) if wrenches is None else finite_array("wrenches", wrenches)
        self.wrenches = read_only(given)
        if self.wrenches.ndim != 2 or self.wrenches.shape[1] != 6:
            raise InvalidInputError(f"wrenches: shape {self.wrenches.shape}, expected (T, 6)")
        self.times = None if times is None else finite_vector("times", times, len(self.wrenches))
        if self.times is not None and (np.diff(self.times) <= 0).any():
            row = int((np.diff(self.times) <= 0).argmax()) + 1
            raise InvalidInputError(f"times: {self.times[row]:g} s in row {row} is not after the row before")
        self._given: dict[str, Any] = grasp._arguments()  # noqa: SLF001
        self._friction, self._limits = 1.0, 1.0
        self.grasp = grasp

    @property
    def has_cones(self) -> bool:
        """Whether contacts have friction cones; False if their extreme forces were given."""
        return self._given["extreme_forces"] is None

    def scale(self, friction: float, limits: float) -> None:
        """Multiply all friction coefficients and all limits of the grasp as given.

        Raises
        ------
        InvalidInputError, InvalidGraspError
            A factor is not positive and finite; nothing has changed then.
        """
        friction = real_number("friction", friction, least=0)
        limits = real_number("limits", limits, positive=True)
        self.grasp = self._built(self._given, friction, limits)
        self._friction, self._limits = friction, limits

    def move(self, contact: int, to: ArrayLike) -> NDArray[np.float64]:
        """Move a contact near a point (3,), on the mesh if there is one, and return where it went.

        Raises
        ------
        InvalidInputError, InvalidGraspError
            There is no such contact, or the point is not three finite numbers; nothing has changed then.
        """
        contact = whole_number("contact", contact, least=0, most=self.grasp.num_contacts - 1)
        position = finite_vector("to", to)
        if position.shape != (3,):
            raise InvalidInputError(f"to: shape {position.shape}, expected (3,)")
        positions, normals = self._given["positions"].copy(), self._given["normals"].copy()
        if self.mesh is not None:
            position, normals[contact] = self._on_mesh(self.mesh, position)
        positions[contact] = position
        # Tangents of the old place may be normal to the new one.
        given = self._given | {"positions": positions, "normals": normals, "tangents": None}
        self.grasp = self._built(given, self._friction, self._limits)
        self._given = given
        return position

    def quality(self, criterion: Criterion) -> Quality:
        """Quality of the grasp as it is now, by the criterion "max" or "sum"."""
        chosen("criterion", criterion, ("max", "sum"))
        return self.grasp.quality(criterion)

    def forces(self, row: int) -> ForceSolution | None:
        """Least forces against one of the wrenches; None where there are no wrenches.

        If no forces balance the wrench, these are the nearest forces within the limits. Their ``residual`` is
        the part of the wrench that stays unbalanced.
        """
        if len(self.wrenches) == 0:
            return None
        row = whole_number("row", row, least=0, most=len(self.wrenches) - 1)
        distributor = ForceDistributor(self.grasp)
        try:
            return distributor.solve(self.wrenches[row])
        except InfeasibleWrenchError:
            return distributor.nearest(self.wrenches[row])

    def extent(self) -> float:
        """Return the largest extent of contacts and mesh in m; 1 where they are in one place."""
        points = self.grasp.positions
        if self.mesh is not None:
            points = np.vstack([points, self.mesh[0]])
        return float(np.ptp(points, axis=0).max()) or 1.0

    def row_at(self, value: float) -> int:
        """Return the row of the wrench at a time in s, or the row itself where wrenches have no times."""
        if self.times is None:
            return int(value)
        return int(np.abs(self.times - value).argmin())

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_tree": None}

    def _built(self, given: dict[str, Any], friction: float, limits: float) -> Grasp:
        scaled = dict(given)
        if self.has_cones:
            scaled["friction"] = friction * scaled["friction"]
            scaled["max_normal_force"] = limits * scaled["max_normal_force"]
        return unwarned_grasp(**scaled)

    def _on_mesh(
        self, mesh: tuple[NDArray[np.float64], NDArray[np.int64]], point: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        vertices, faces = mesh
        if self._tree is None:
            self._tree = TriangleTree(vertices, faces)
        (closest,), (face,), _ = self._tree.closest(point[None])
        a, b, c = vertices[faces[face]]
        return closest, -np.cross(b - a, c - a)
