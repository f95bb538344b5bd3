"""What a grasp is asked for: the object, the contacts' friction, the load, and how hard to press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import chosen, finite_array, finite_vector, real_number
from graspforce.errors import InvalidInputError
from graspforce.typing import CRITERIA

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graspforce.typing import Criterion

    from .grasped_object import GraspedObject

    Array = NDArray[np.float64]


PUSHES = np.hstack([np.vstack([np.eye(3), -np.eye(3)])[[0, 3, 1, 4, 2, 5]], np.zeros((6, 3))])
"""(6, 6) unit pushes along +x, -x, +y, -y, +z and -z."""


def push_rows(pushes: ArrayLike | None) -> Array:
    """Return pushes as (W, 6), `PUSHES` where none are given."""
    rows = PUSHES if pushes is None else np.atleast_2d(finite_array("pushes", pushes))
    if rows.ndim != 2 or rows.shape[1] != 6 or not len(rows):
        raise InvalidInputError(f"pushes: shape {rows.shape}, expected (W, 6) with W >= 1")
    return rows


@dataclass(frozen=True, slots=True, eq=False)
class GraspProblem:
    """The object and what its grasp must do."""

    grasped: GraspedObject
    friction: float
    torsion: float
    criterion: Criterion
    external_wrench: Array
    preload: float
    """Least normal force in N of each finger at rest."""
    friction_margin: float

    @staticmethod
    def of(
        grasped: GraspedObject, *, friction: Any, torsion: Any, criterion: Any,
        external_wrench: ArrayLike | None, preload: Any, friction_margin: Any,
    ) -> GraspProblem:  # fmt: skip
        """Check the arguments."""
        chosen("criterion", criterion, CRITERIA)
        wrench = (
            np.zeros(6) if external_wrench is None else finite_vector("external_wrench", external_wrench, 6)
        )
        return GraspProblem(
            grasped,
            real_number("friction", friction, positive=True),
            real_number("torsion", torsion, least=0),
            criterion,
            wrench,
            real_number("preload", preload, least=0),
            real_number("friction_margin", friction_margin, least=1),
        )

    @property
    def contacts(self) -> dict[str, Any]:
        """What all contacts have in common, as arguments of `graspforce.Grasp`."""
        return {
            "friction": self.friction,
            "torsion": self.torsion or None,
            "origin": self.grasped.center,
            "length_scale": self.grasped.extent / 2,
        }
