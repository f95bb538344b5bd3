"""What became of an object that was pushed in simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

import numpy as np

from graspforce._internal.restored import expect, expect_array, expect_instance, expect_number
from graspforce._internal.to_dict import Record

from .controllers import Control

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Trial(Record):
    """What became of an object that was pushed; threads may share it.

    Attributes
    ----------
    held : numpy.ndarray
        (W,) bool: True where the object moved less than 5 cm and turned less than 15 degrees.
    displacement, rotation : numpy.ndarray
        (W,) how far the object was from where it had been placed when the push ended, in m and rad. For a
        lost object: when it was lost.
    settled_displacement, settled_rotation : float
        The same after closing, before any push.
    normal_forces : numpy.ndarray
        (m,) normal forces in N after closing.
    normal_error : float
        Largest difference in N between those and the planned ones.
    infeasible : int
        Ticks at which no forces within friction were found; 0 for a fixed squeeze.
    control : {"squeeze", "servo", "torque"}
        Control during the trial.
    """

    held: NDArray[np.bool_]
    displacement: Array
    rotation: Array
    settled_displacement: float
    settled_rotation: float
    normal_forces: Array
    normal_error: float
    infeasible: int
    control: Control

    def _check(self) -> None:
        rows = np.size(self.held)
        expect_array("held", self.held, (rows,), kind=np.bool_)
        expect_array("displacement", self.displacement, (rows,), finite=False)
        expect_array("rotation", self.rotation, (rows,), finite=False)
        expect_number("settled_displacement", self.settled_displacement, finite=False)
        expect_number("settled_rotation", self.settled_rotation, finite=False)
        expect_array("normal_forces", self.normal_forces, (None,))
        expect_number("normal_error", self.normal_error, least=0)
        expect_instance("infeasible", self.infeasible, int)
        expect(self.control in get_args(Control), "control", "a kind of control")

    @property
    def success(self) -> bool:
        """Whether every push was held."""
        return bool(self.held.all())

    def __repr__(self) -> str:
        return (
            f"Trial(held {int(self.held.sum())} of {len(self.held)}, moved at most "
            f"{self.displacement.max() * 1e3:.2g} mm, control {self.control!r})"
        )
