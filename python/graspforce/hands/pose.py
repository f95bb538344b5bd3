"""A hand's pose that touches given contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from graspforce._internal.restored import expect, expect_array, expect_number
from graspforce._internal.to_dict import Record

from .hand_data import HandData

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class HandPose(Record):
    """The pose of a hand whose tips touch contacts, in the frame of the contacts; threads may share it.

    Attributes
    ----------
    hand : Hand
        The hand.
    palm : numpy.ndarray
        (4, 4) pose of the palm.
    joints : numpy.ndarray
        (n,) positions of all joints in rad.
    fingers : tuple of int
        ``fingers[i]`` is the number of the fingertip at contact i.
    position_error : float
        Largest distance in m between a contact and the surface of its tip.
    normal_error : float
        Largest angle in rad between a contact normal and the way from the tip's axis to the contact.
    clearance : float
        Least distance in m of other parts of the hand from the object and from each other, at most 5 mm;
        negative where they overlap, or where a tip is deeper in the object than 0.5 mm.
    """

    hand: HandData
    palm: Array
    joints: Array
    fingers: tuple[int, ...]
    position_error: float
    normal_error: float
    clearance: float

    def _check(self) -> None:
        expect(isinstance(self.hand, HandData), "hand", "a Hand")
        expect_array("palm", self.palm, (4, 4))
        expect_array("joints", self.joints, (len(self.hand.joints),))
        tips = self.hand.num_fingers
        expect(
            all(type(f) is int and 0 <= f < tips for f in self.fingers), "fingers", "numbers of fingertips"
        )
        expect_number("position_error", self.position_error, least=0)
        expect_number("normal_error", self.normal_error, least=0)
        expect_number("clearance", self.clearance)

    def __repr__(self) -> str:
        return (
            f"HandPose({self.hand.name!r}, fingers {list(self.fingers)}, off by "
            f"{self.position_error * 1e3:.3g} mm and {self.normal_error:.3g} rad, "
            f"clearance {self.clearance * 1e3:.3g} mm)"
        )
