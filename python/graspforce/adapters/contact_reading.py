"""The contacts on one body and their forces, as read from a simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

import numpy as np

from graspforce._core import Grasp
from graspforce._internal.restored import expect, expect_array, expect_instance, expect_tuple
from graspforce._internal.to_dict import Record
from graspforce._internal.vectors import read_only

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


class ReadingOptions(TypedDict, total=False):
    """The options of a grasp that no simulator gives; see `graspforce.Grasp`."""

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
        Positions in the world, inward normals and friction of the contacts. Torques are about the body's
        centre of mass unless `origin` was given.
    forces : numpy.ndarray
        (m, k) the simulator's contact forces on the body, in the grasp's contact frames, in N.
    contacts : tuple of int
        The simulator's indices of the contacts.
    """

    grasp: Grasp
    forces: NDArray[np.float64]
    contacts: tuple[int, ...]

    def _check(self) -> None:
        expect_instance("grasp", self.grasp, Grasp)
        contacts, components = self.grasp.num_contacts, self.grasp.force_dim
        expect_array("forces", self.forces, (contacts, components))
        expect_tuple("contacts", self.contacts, int)
        expect(len(self.contacts) == contacts, "contacts", "one index for each contact")

    def __repr__(self) -> str:
        return f"ContactReading({len(self.contacts)} contacts, sigma_max={self.sigma_max:.6g})"

    @property
    def external_wrench(self) -> NDArray[np.float64]:
        """(d,) wrench that the simulator's forces balance: the opposite of their sum."""
        return read_only(-(self.grasp.grasp_matrix @ self.forces.ravel()))

    @property
    def sigma_max(self) -> float:
        """Largest normal force of the simulator, as a share of its limit."""
        return float((self.forces[:, 0] / self.grasp.max_normal_force).max())

    @property
    def slip_margin(self) -> NDArray[np.float64]:
        """(m,) unused share of each contact's friction: 1 without tangential force, 0 where it slips.

        It is negative where the simulator's force lies outside the friction cone. A contact without friction
        has 0, one without normal force 1.
        """
        grasp, forces = self.grasp, self.forces
        pressing, tangential = forces[:, 0], forces[:, 1 : grasp.positions.shape[1]]
        # Of soft fingers alone a force has a fourth component.
        loads = np.stack([np.linalg.norm(tangential, axis=1), np.abs(forces[:, 3:]).sum(axis=1)])
        coefficients = np.stack([grasp.friction, grasp.torsion])
        with np.errstate(divide="ignore", invalid="ignore"):
            used = np.hypot(*np.where(loads == 0, 0.0, loads / coefficients)) / pressing
        margin = np.where(pressing > 0, 1.0 - used, 1.0)
        margin[~coefficients.any(axis=0)] = 0.0
        return read_only(margin)
