"""Support regions: where the centre of mass of a body may be, so that its contacts can hold it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np

from graspforce._core import polygon_margins
from graspforce._core import support_region as region_of
from graspforce._internal.checks import finite_array
from graspforce._internal.restored import (
    expect,
    expect_array,
    expect_instance,
    expect_number,
    expect_whole,
)
from graspforce._internal.to_dict import Record
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp
    from graspforce.typing import Criterion

    Array = NDArray[np.float64]

__all__ = ["Shape", "SupportRegion", "support_region"]

Shape: TypeAlias = Literal["polygon", "segment", "point", "empty"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SupportRegion(Record):
    """The horizontal positions of the centre of mass at which contact forces can hold a body.

    The region is convex. It contains the inner polygon and lies within the outer one. Threads may share it;
    it can be copied and pickled.

    Attributes
    ----------
    shape : {"polygon", "segment", "point", "empty"}
        What kind of a set the region is. A segment is less wide than a billionth of the contacts' extent.
    inner, outer : numpy.ndarray
        (k, 2) vertices in m, counterclockwise; two of a segment, one of a point, none of an empty region.
    inner_area, outer_area : float
        Their areas in m^2.
    area_gap : float
        ``(outer_area - inner_area) / outer_area``; zero if the shape is not a polygon.
    converged : bool
        True if the gap is within the argument `gap`, as small as rounding allows, or thinner than the
        resolution all along the boundary.
    directions : int
        Number of linear programs that were solved, one for each direction.
    resolution : float
        Length in m: a point outside of the region by less is not told from one inside. It is a billionth of
        the largest distance of a contact from the contacts' mean.
    witness : numpy.ndarray or None
        (6,) unit direction z of an empty region: wrenches w of contact forces within their limits have
        ``w @ z < -external_wrench @ z`` wherever the centre of mass is. None if the region is not empty.
    """

    shape: Shape
    inner: Array
    outer: Array
    inner_area: float
    outer_area: float
    area_gap: float
    converged: bool
    directions: int
    resolution: float
    witness: Array | None

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether the contacts are proven to hold the body with its centre of mass there.

        Parameters
        ----------
        points : array_like
            (N, 2) horizontal positions in m, or (2,) one of them.

        Returns
        -------
        numpy.ndarray
            (N,) bool, or () for one point. False also between both polygons, where nothing is proven.

        Raises
        ------
        InvalidInputError
            `points` has another shape, or a number that is not finite.
        """
        return self.margin(points) >= -self.resolution

    def margin(self, points: ArrayLike) -> Array:
        """Return how far points are inside the inner polygon, in m; negative outside.

        The distance to the boundary of the region is no smaller than that, so a margin is never better than
        proven. Segments and points have no inside: their margins are at most zero. The margin to an empty
        region is minus infinity. Parameters, shape and errors are those of `contains`.
        """
        places = finite_array("points", points)
        if places.ndim not in (1, 2) or places.shape[-1] != 2:
            raise InvalidInputError(f"points: shape {places.shape}, expected (N, 2) or (2,)")
        margins = polygon_margins(self.inner, places.reshape(-1, 2))
        return margins.reshape(places.shape[:-1])

    def _check(self) -> None:
        expect(self.shape in get_args(Shape), "shape", "one of " + ", ".join(get_args(Shape)))
        for name in ("inner", "outer"):
            expect_array(name, getattr(self, name), (None, 2))
        expect((self.shape == "empty") == (not len(self.inner)), "inner", "vertices of a region")
        for name in ("inner_area", "outer_area", "area_gap", "resolution"):
            expect_number(name, getattr(self, name), least=0)
        expect_instance("converged", self.converged, bool)
        expect_whole("directions", self.directions)
        expect((self.shape == "empty") == (self.witness is not None), "witness", "one of an empty region")
        if self.witness is not None:
            expect_array("witness", self.witness, (6,))

    def __repr__(self) -> str:
        if self.shape != "polygon":
            return f"SupportRegion(shape={self.shape!r}, inner={self.inner.tolist()})"
        return (
            f"SupportRegion(shape='polygon', {len(self.inner)} vertices, inner_area={self.inner_area:.6g}, "
            f"area_gap={self.area_gap:.2g}{'' if self.converged else ', converged=False'})"
        )


def support_region(
    grasp: Grasp,
    weight: float,
    criterion: Criterion = "max",
    *,
    acceleration: ArrayLike = (0.0, 0.0, 0.0),
    height: float = 0.0,
    limits: bool = True,
    external_wrench: ArrayLike | None = None,
    gap: float = 1e-6,
    gravity: float = 9.80665,
    max_directions: int = 10_000,
) -> SupportRegion:
    """Find where the centre of mass of a body may be, so that contact forces can hold it.

    The body is a robot on its feet, or an object on fingers; gravity acts along the negative z axis. Contact
    forces keep their friction cones and their limits: the region depends on ``max_normal_force``, which is
    1 N unless the grasp says otherwise. For friction alone, choose ``limits=False``.

    Safe to call from several threads.

    Parameters
    ----------
    grasp : Grasp
        Contacts in space, with normals into the body: upward under a foot. Patches of contact are four
        contacts each, see `graspforce.patch`. Linearised cones, true cones, soft contacts and extreme forces
        may be mixed.
    weight : float
        Weight of the body in N, positive.
    criterion : {"max", "sum"}
        Which normalised normal forces are limited to 1: each of them, or their sum.
    acceleration : array_like
        (3,) acceleration of the centre of mass in m/s^2. The angular momentum about it is constant.
    height : float
        Height z of the centre of mass in m. It matters with a horizontal acceleration only.
    limits : bool
        Whether normal forces are limited. False leaves friction cones alone: normal forces may be as large as
        the region needs, up to 100,000 times the weight together. `criterion` does not matter then.
    external_wrench : array_like, optional
        (6,) wrench on the body beside its weight, in N and N m about the grasp's origin.
    gap : float
        Stop when the area between the polygons is at most this share of the outer one's; at least 0, less
        than 1. With finitely many extreme forces, 0 asks for the exact polygon.
    gravity : float
        Acceleration of free fall in m/s^2, which makes the mass of the weight.
    max_directions : int
        Largest number of directions to ask for, from 4.

    Returns
    -------
    SupportRegion
        Both polygons, with ``contains`` and ``margin``. It is bounded: limited forces balance no weight far
        away.

    Raises
    ------
    InvalidInputError
        An argument is unusable, or the acceleration is free fall, which no place is needed for. Also if
        ``limits=False`` leaves no bounded region, since contacts can press against each other.
    InvalidGraspError
        The contacts are planar.
    NotConvergedError
        It is not decided whether any forces hold the body: it weighs what the contacts can just bear, or
        forces are spread over too many orders of magnitude.

    Notes
    -----
    One linear program over the wrench set tells the furthest place along a direction; each bounds the region
    from inside and from outside. The next direction is asked across the edge with the largest area beyond it.
    Forces count as balanced to within a billionth of the weight.

    Examples
    --------
    A table on four legs stands if its centre of mass is between the legs. If each leg bears only 30 N of
    100 N, the corners are out of reach.

    >>> import graspforce as gf
    >>> legs = [(0.2, 0.1, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0), (0.2, -0.1, 0)]
    >>> strong = gf.Grasp(legs, [(0, 0, 1)] * 4, max_normal_force=100.0)
    >>> region = gf.support_region(strong, weight=100.0)
    >>> region.shape, round(region.inner_area, 9)
    ('polygon', 0.08)
    >>> region.contains([(0.1, 0.05), (0.3, 0)]).tolist()
    [True, False]
    >>> round(float(region.margin((0.1, 0.05))), 9)
    0.05
    >>> weak = strong.replace(max_normal_force=30.0)
    >>> bool(gf.support_region(weak, weight=100.0).contains((0.1, 0.05)))
    False
    >>> bool(gf.support_region(weak, weight=100.0, limits=False).contains((0.1, 0.05)))
    True
    """
    found = region_of(
        grasp, weight, criterion, acceleration, height, limits,
        np.zeros(6) if external_wrench is None else external_wrench, gap, gravity, max_directions,
    )  # fmt: skip
    shape, inner, outer, areas, resolution, (converged, directions), witness = found
    return SupportRegion(shape, inner, outer, *areas, converged, directions, resolution, witness)
