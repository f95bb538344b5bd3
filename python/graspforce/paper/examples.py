"""Inputs and results of both examples as printed: grasps, wrenches, plans and forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from graspforce._internal.taylor_intervals import formula
from graspforce.surfaces import Arrangement, ParametricSurface, PlanarCurve, contacts_on, ellipse, line, tied

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class PublishedPlan:
    """The printed end of one plan, its number of iterations and its time."""

    params: tuple[float, ...]
    iterations: int
    seconds: float


@dataclass(frozen=True, slots=True)
class PlanningProblem:
    """One planning problem of the racket: a curve and a force limit for each contact, and the start.

    Lengths are in m, angles in rad, forces in N.
    """

    name: str
    curves: tuple[PlanarCurve, ...]
    friction: tuple[float, ...]
    max_normal_force: tuple[float, ...]
    initial: tuple[float, ...]
    step: tuple[float, ...]
    tolerance: tuple[float, ...]
    bounds: tuple[tuple[float, float], ...]
    published: Mapping[Literal["max", "sum"], PublishedPlan]

    @property
    def surface(self) -> Arrangement:
        """Parameters (B, m) to positions and normals (B, m, 2)."""
        return contacts_on(*self.curves)


@dataclass(frozen=True, slots=True)
class PublishedForces:
    """One row of Table 1: a grasp, and for each objective (max, sum, CPU ms) of normalised normal forces."""

    problem: str
    params: tuple[float, ...]
    least_sum: tuple[float, float, float]
    least_max: tuple[float, float, float]


def _throat(side: Literal[-1, 1]) -> PlanarCurve:
    """Outer edge of the racket's throat, left (-1) or right (+1)."""
    return PlanarCurve(
        point=formula(lambda s: np.stack([side * (0.68 * s**3 + 0.015), 0.8 * s**2 - 0.315], axis=-1)),
        # The derivative (+-2.04 s^2, 1.6 s) vanishes at s = 0; divided by s it tends to (0, 1.6) there.
        tangent=formula(lambda s: np.stack([side * 2.04 * s, np.full_like(s, 1.6)], axis=-1)),
        object_side="right" if side < 0 else "left",
    )


_PI = math.pi

_THREE_FINGERS = PlanningProblem(
    name="three fingers",
    curves=(ellipse(0.13, 0.16), _throat(-1), _throat(1)),
    friction=(0.1, 0.1, 0.1),
    max_normal_force=(30.0, 60.0, 60.0),
    initial=(0.0, 0.5, 0.5),
    step=(_PI / 4, 0.2, 0.2),
    tolerance=(_PI / 8, 0.1, 0.1),
    bounds=((0.0, _PI), (0.0, 0.5), (0.0, 0.5)),
    published=MappingProxyType(
        {
            "max": PublishedPlan((_PI / 4, 0.45, 0.0), iterations=4, seconds=129.15),
            "sum": PublishedPlan((_PI / 4, 0.5, 0.0), iterations=4, seconds=165.97),
        }
    ),
)

# The paper's contacts 1 and 2 press outward from inside the head. The figure shows it, not the text.
_FOUR_FINGERS = PlanningProblem(
    name="four fingers",
    curves=(
        ellipse(0.12, 0.15, pressed_from="inside"),
        ellipse(0.12, 0.17, pressed_from="inside"),
        _throat(1),
        line((-0.015, 0.0), (0.0, 1.0), object_side="right"),
    ),
    friction=(0.1, 0.1, 0.1, 0.2),
    max_normal_force=(30.0, 30.0, 60.0, 100.0),
    initial=(0.0, 0.0, 0.4, -0.42),
    step=(_PI / 4, _PI / 4, 0.2, 0.02),
    tolerance=(_PI / 8, _PI / 8, 0.1, 0.01),
    bounds=((0.0, _PI), (-_PI, 0.0), (0.0, 0.5), (-0.5, -0.32)),
    published=MappingProxyType(
        {
            "max": PublishedPlan((_PI / 8, -3 * _PI / 8, 0.225, -0.5), iterations=5, seconds=434.58),
            "sum": PublishedPlan((_PI / 16, -_PI / 2, 0.0, -0.5), iterations=5, seconds=479.67),
        }
    ),
)

RACKET: Mapping[str, PlanningProblem] = MappingProxyType(
    {problem.name: problem for problem in (_THREE_FINGERS, _FOUR_FINGERS)}
)
"""The two planning problems of Example 1, by name."""

RACKET_WRENCH = (-8.0, -10.0, 6.0)
"""The external wrench ``[fx, fy, tau]`` of Table 1, in N and N m about the origin."""

TABLE_1: Mapping[str, PublishedForces] = MappingProxyType(
    {
        "d": PublishedForces(
            "three fingers", (_PI / 4, 0.45, 0.0), (1.3868, 3.1099, 26.58), (1.3868, 3.1099, 29.34)
        ),
        "e": PublishedForces(
            "three fingers", (_PI / 4, 0.5, 0.0), (0.9521, 2.0623, 25.15), (0.9521, 2.0623, 28.76)
        ),
        "k": PublishedForces(
            "four fingers",
            (_PI / 8, -3 * _PI / 8, 0.225, -0.5),
            (0.8658, 1.2280, 24.23),
            (0.8119, 1.4159, 28.04),
        ),
        "n": PublishedForces(
            "four fingers", (_PI / 16, -_PI / 2, 0.0, -0.5), (1.1336, 1.6728, 27.54), (0.9904, 1.6945, 28.94)
        ),
    }
)
"""Table 1, by the letters of Fig. 4."""


@dataclass(frozen=True, slots=True)
class TileProblem:
    """The planning problem of Example 2: two pairs of contacts on a monkey saddle, on top and beneath.

    The parameters are ``[phi_1, psi_1, phi_3, psi_3]`` in m, with the paper's numbers of the contacts from 1.
    The paper's contact 2 is opposite to its contact 1, and 4 to 3: ``phi_2 = -phi_1``, ``psi_2 = -psi_1``,
    and so on.
    """

    friction: float
    max_normal_force: float
    edges: int
    initial: tuple[float, ...]
    step: float
    tolerance: float
    bounds: tuple[tuple[float, float], ...]
    published: Mapping[Literal["max", "sum"], PublishedPlan]

    @property
    def surface(self) -> Arrangement:
        """Parameters (B, 4) to positions and normals (B, 4, 3)."""
        return _TILE_SURFACE


def tile_side(side: Literal["upper", "lower"]) -> ParametricSurface:
    """One side of the tile, ``z = 10 (phi^3 - 3 psi^2 phi) +- 0.005`` m, with normals into it.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.paper import tile_side
    >>> points, normals = tile_side("upper").contacts(np.zeros((1, 2)))
    >>> points.tolist(), normals.tolist()
    ([[0.0, 0.0, 0.005]], [[0.0, 0.0, -1.0]])
    """
    thickness = 0.005 if side == "upper" else -0.005

    @formula
    def point(params: NDArray[np.float64]) -> NDArray[np.float64]:
        phi, psi = params.T
        return np.stack([phi, psi, 10 * (phi**3 - 3 * psi**2 * phi) + thickness], axis=-1)

    @formula
    def upward(params: NDArray[np.float64]) -> NDArray[np.float64]:
        phi, psi = params.T
        return np.stack([-30 * (phi**2 - psi**2), 60 * phi * psi, np.ones_like(phi)], axis=-1)

    return ParametricSurface(point, upward, object_side="against" if side == "upper" else "along")


_TILE_SURFACE = tied(
    contacts_on(*(tile_side(side) for side in ("upper", "upper", "lower", "lower"))),
    np.kron(np.eye(2), np.kron([[1.0], [-1.0]], np.eye(2))),
)

TILE = TileProblem(
    friction=0.2,
    max_normal_force=10.0,
    edges=10,
    initial=(0.0, 0.0, 0.0, 0.0),
    step=0.2,
    tolerance=0.001,
    bounds=((-0.2, 0.2),) * 4,
    published=MappingProxyType(
        {
            "max": PublishedPlan((-0.2, 0.0375, 0.1992, -0.2), iterations=10, seconds=112.38 * 60),
            "sum": PublishedPlan((-0.2, 0.0531, -0.2, 0.2), iterations=11, seconds=53.67 * 60),
        }
    ),
)
"""Example 2 as printed."""


@dataclass(frozen=True, slots=True)
class DynamicWrench:
    """An external wrench ``cosine cos(0.2 pi t) + sine sin(0.2 pi t) + constant`` (N, N m) at time t in s.

    Examples
    --------
    >>> from graspforce.paper import TILE_WRENCHES
    >>> TILE_WRENCHES[6].at([0.0, 2.5]).round(9).tolist()
    [[-8.5, 2.4, -0.7, 0.1, -0.2, 3.2], [-8.2, 0.8, 2.0, -0.3, -2.0, 2.5]]
    """

    cosine: tuple[float, ...]
    sine: tuple[float, ...]
    constant: tuple[float, ...]

    period: ClassVar[float] = 10.0

    def at(self, times: ArrayLike) -> NDArray[np.float64]:
        """Wrenches (T, 6) at times (T,) in s."""
        angle = 2 * math.pi / self.period * np.asarray(times, dtype=np.float64)[:, None]
        return np.cos(angle) * self.cosine + np.sin(angle) * self.sine + self.constant


TILE_WRENCHES: Mapping[int, DynamicWrench] = MappingProxyType(
    {
        6: DynamicWrench(
            cosine=(-0.7, 0.2, -2.7, -0.7, 1.0, 0.7),
            sine=(-0.4, -1.4, 0.0, -1.1, -0.8, 0.0),
            constant=(-7.8, 2.2, 2.0, 0.8, -1.2, 2.5),
        ),
        7: DynamicWrench(
            cosine=(-1.0, 0.1, -2.2, -1.0, 0.2, 0.7),
            sine=(-0.1, -1.2, 0.0, 0.3, 1.2, 0.0),
            constant=(-6.6, 0.5, 2.8, -1.3, 0.3, -2.0),
        ),
    }
)
"""The two external wrenches that act on the tile in Example 2, by the figures that show their forces."""

TILE_FORCE_MILLISECONDS: Mapping[tuple[int, Literal["max", "sum"]], float] = MappingProxyType(
    {(6, "max"): 62.10, (7, "sum"): 46.20, (7, "max"): 65.64}
)
"""Printed CPU time in ms of the forces against one wrench, by figure and objective; "max" used 275 points."""
