"""What a simulator says about the contacts on one body, and what it does not know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import Grasp

__all__ = ["ContactReading", "ReadingOptions"]


class ReadingOptions(TypedDict, total=False):
    """What no simulator knows about a grasp; see `graspforce.Grasp`."""

    max_normal_force: ArrayLike
    edges: int | None
    origin: ArrayLike
    length_scale: float
    friction_margin: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ContactReading(Record):
    """The contacts on a body as a grasp, and the forces a simulator has at them.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    grasp : Grasp
        Positions in the world, inward normals and friction of the contacts; torques are about the body's
        centre of mass unless another origin was asked for.
    forces : numpy.ndarray
        (m, k) the simulator's contact forces on the body, in the grasp's contact frames, in N.
    contacts : tuple of int
        The simulator's own numbers of the contacts.
    """

    grasp: Grasp
    forces: NDArray[np.float64]
    contacts: tuple[int, ...]

    def __repr__(self) -> str:
        return f"ContactReading({len(self.contacts)} contacts, sigma_max={self.sigma_max:.6g})"

    @property
    def external_wrench(self) -> NDArray[np.float64]:
        """(d,) wrench that the simulator's forces balance: the opposite of what they exert together."""
        wrench = -(self.grasp.grasp_matrix @ self.forces.ravel())
        wrench.flags.writeable = False
        return wrench

    @property
    def sigma_max(self) -> float:
        """Largest normal force of the simulator, as a share of its limit."""
        return float((self.forces[:, 0] / self.grasp.max_normal_force).max())
