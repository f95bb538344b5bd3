"""Other quality measures of grasps, named as in the survey of Roa and Suarez.

M. A. Roa and R. Suarez, "Grasp quality measures: review and performance", Autonomous Robots 38 (2015) 65-88.
They do not depend on force limits, and the first three not on friction; see `Grasp.quality` for both.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.html import table
from graspforce._internal.restored import expect_number
from graspforce._internal.to_dict import Record

from .errors import InvalidGraspError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._core import Grasp

__all__ = ["Measures", "measures_of"]

_MAX_HULL_POINTS = 128
"""In six dimensions the facets of a hull grow with the cube of its points."""


@dataclass(frozen=True, slots=True, repr=False)
class Measures(Record):
    r"""Algebraic and geometric measures of one grasp.

    The singular values are those of the grasp matrix G in the norm of the grasp's ``length_scale``
    (torques divided by L).

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    smallest_singular_value : float
        :math:`\sigma_{\min}(G)`, the distance from a singular configuration. It is zero if the contacts
        cannot exert some wrench.
    ellipsoid_volume : float
        :math:`\sqrt{\det(G G^T)} = \prod_i \sigma_i`, the volume of the image of the unit ball of contact
        forces, up to the constant of the dimension.
    isotropy : float
        :math:`\sigma_{\min} / \sigma_{\max}`; 1 if contact forces act alike in all directions.
    hull_volume : float or None
        Volume of the convex hull of the primitive wrenches and the origin, in the same norm. None without
        SciPy, for true cones, for more than 128 primitive wrenches, and if Qhull fails.
    """

    smallest_singular_value: float
    ellipsoid_volume: float
    isotropy: float
    hull_volume: float | None

    def _shown(self) -> list[tuple[str, str]]:
        values = ((field.name, getattr(self, field.name)) for field in fields(self))
        return [(name, "None" if value is None else f"{value:.6g}") for name, value in values]

    def __repr__(self) -> str:
        """Write six digits of each measure."""
        return f"Measures({', '.join(f'{name}={value}' for name, value in self._shown())})"

    def _repr_html_(self) -> str:
        rows = ((name.replace("_", " "), value) for name, value in self._shown())
        return table("Measures", ("", ""), rows)

    def _check(self) -> None:
        for name in ("smallest_singular_value", "ellipsoid_volume", "isotropy"):
            expect_number(name, getattr(self, name), least=0, finite=False)
        if self.hull_volume is not None:
            expect_number("hull_volume", self.hull_volume, least=0, finite=False)


def measures_of(grasp: Grasp) -> Measures:
    """Compute all measures of a grasp; `Grasp.measures` calls this."""
    values = grasp._singular_values()  # noqa: SLF001
    d = grasp.wrench_dim
    # Fewer force components than wrench components leave some wrenches out of reach.
    spectrum = np.zeros(d)
    spectrum[: values.size] = values
    with np.errstate(over="ignore", under="ignore"):
        # The largest with the smallest first, so that no partial product overflows.
        volume = float(np.prod(np.sqrt(spectrum) * np.sqrt(spectrum[::-1]))) if spectrum[-1] > 0 else 0.0
    return Measures(
        smallest_singular_value=float(spectrum[-1]),
        ellipsoid_volume=volume,
        isotropy=float(spectrum[-1] / spectrum[0]),
        hull_volume=_hull_volume(grasp),
    )


def _hull_volume(grasp: Grasp) -> float | None:
    try:
        wrenches = grasp.primitive_wrenches
    except InvalidGraspError:
        return None
    if len(wrenches) > _MAX_HULL_POINTS:
        return None
    try:
        from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415
    except ImportError:
        return None
    points = np.vstack([np.zeros(grasp.wrench_dim), _scaled(wrenches, grasp)])
    if np.linalg.matrix_rank(points) < grasp.wrench_dim:
        return 0.0
    # Joggled input ("QJ") gives a volume to rounding where coplanar facets defeat the exact merge.
    for options in (None, "QJ"):
        with contextlib.suppress(QhullError):
            return float(ConvexHull(points, qhull_options=options).volume)
    return None


def _scaled(wrenches: NDArray[np.float64], grasp: Grasp) -> NDArray[np.float64]:
    forces = 2 if grasp.wrench_dim == 3 else 3
    scaled = wrenches.copy()
    scaled[:, forces:] /= grasp.length_scale
    return scaled
