"""A planned grasp of a hand: its pose, its contacts and the torques that hold the object."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import Grasp, Quality
from graspforce._internal.checks import finite_array, finite_vector, real_number
from graspforce._internal.restored import expect, expect_array, expect_instance, expect_number
from graspforce._internal.to_dict import Record
from graspforce.errors import InfeasibleWrenchError, InvalidFileError, InvalidInputError

from .hand import Hand
from .limited_forces import limited_forces, unit_torques
from .preload import finger_stiffness, joint_torques, least_forces, slip_onset
from .torque_polytopes import torque_limited_grasp

if TYPE_CHECKING:
    import os

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class HandPlan(Record):
    """A hand's pose that grasps an object, in the object's frame; threads may share it.

    Attributes
    ----------
    hand : Hand
        The hand.
    fingers : tuple of int
        Fingertips that touch, by their numbers in the hand; contact i belongs to finger ``fingers[i]``.
    palm : numpy.ndarray
        (4, 4) pose of the palm.
    joints, pregrasp : numpy.ndarray
        (n,) positions of all joints in rad at the contacts, and with the fingers backed off from them.
    grasp : Grasp
        The contacts on the object.
    quality : Quality
        Its quality by the criterion of the search, with every normal force at most 1 N.
    resting_forces : numpy.ndarray
        (m, k) contact forces in N, in contact frames, that press at least the preload and balance the
        external wrench of the search.
    external_wrench : numpy.ndarray
        (6,) load in N and N m that the resting forces balance, about the object's centre.
    jacobians : numpy.ndarray
        (m, 3, n) velocities of the contacts on the fingers by joint velocities, in m/s per rad/s.
    preload : float
        Least normal force in N of each finger at rest.
    contact_error : float
        Largest distance in m between a tip and its contact.
    penetration, self_penetration : float
        Deepest penetration in m of the hand into the object, and of its fingers into each other.
    pad_angle : float
        Largest angle in rad between a pad's direction and the contact normal; 0 for hands without pads.
    pregrasp_clearance : float
        Least distance in m of the pregrasp's tips from the object, less where tips on their way to the grasp
        come nearer than in proportion; negative where something is in the way.
    onset : float
        Least `slip_onset` of the pushes of the search, in their multiples.
    """

    hand: Hand
    fingers: tuple[int, ...]
    palm: Array
    joints: Array
    pregrasp: Array
    grasp: Grasp
    quality: Quality
    resting_forces: Array
    external_wrench: Array
    jacobians: Array
    preload: float
    contact_error: float
    penetration: float
    self_penetration: float
    pad_angle: float
    pregrasp_clearance: float
    onset: float

    def _check(self) -> None:
        expect_instance("hand", self.hand, Hand)
        n, m = len(self.hand.joints), len(self.fingers)
        tips = self.hand.num_fingers
        expect(
            all(type(f) is int and 0 <= f < tips for f in self.fingers), "fingers", "numbers of fingertips"
        )
        expect_array("palm", self.palm, (4, 4))
        expect_array("joints", self.joints, (n,))
        expect_array("pregrasp", self.pregrasp, (n,))
        expect_instance("grasp", self.grasp, Grasp)
        expect(self.grasp.num_contacts == m, "grasp", f"{m} contacts, one for each finger")
        expect_instance("quality", self.quality, Quality)
        expect(self.quality.grasp == self.grasp, "quality", "that of the grasp")
        expect_array("resting_forces", self.resting_forces, (m, self.grasp.force_dim))
        expect_array("external_wrench", self.external_wrench, (6,))
        expect_array("jacobians", self.jacobians, (m, 3, n))
        for name in _MEASURES:
            expect_number(name, getattr(self, name), least=0)
        for name in ("pregrasp_clearance", "onset"):
            expect_number(name, getattr(self, name))

    def slip_onset(self, wrenches: ArrayLike) -> Array:
        """Return the largest multiples (W,) of wrenches (W, 6) in N and N m at which no contact slips.

        The fingers are passive: position servos of the hand's stiffness that hold the resting forces. They
        share the load as springs do. Torques are about the object's centre.

        Raises
        ------
        InvalidInputError
            The wrenches are not finite or have another shape.
        """
        rows = np.atleast_2d(finite_array("wrenches", wrenches))
        if rows.ndim != 2 or rows.shape[1] != 6:
            raise InvalidInputError(f"wrenches: shape {rows.shape}, expected (W, 6)")
        servo = self.hand.stiffness[self.hand.driven]
        K = finger_stiffness(self.jacobians, self.hand.coupling, servo)
        return slip_onset(self.grasp, self.resting_forces, K, rows)

    def forces(self, external_wrench: ArrayLike | None = None) -> Array:
        """Return the least forces (m, k) in N, in contact frames, that balance an external wrench (6,).

        They are within the friction cones, and their torques within the joints' limits. Every finger presses
        at least the preload, or as much of it as the torque limits allow. Without a wrench these are the
        resting forces.

        Raises
        ------
        InfeasibleWrenchError
            No forces balance the wrench; the message names the joint that limits them. ``error.direction``
            is a unit wrench e that proves it: no such forces reach as far along e as they would have to.
        """
        if external_wrench is None:
            return self.resting_forces
        wrench = finite_vector("external_wrench", external_wrench, 6)
        hand = self.hand
        limits = hand.torque_limits[hand.driven]
        with contextlib.suppress(InfeasibleWrenchError):
            least = least_forces(self.grasp, self.preload, wrench)
            if (np.abs(self._driven_torques(least)) <= limits * (1 + 1e-9)).all():
                return least
        names = [hand.joints[j] for j in hand.driven]
        unit = unit_torques(self.grasp, self.jacobians, hand.coupling)
        return limited_forces(self.grasp, unit, limits, self.preload, wrench, names)[0]

    def torques(self, external_wrench: ArrayLike | None = None) -> Array:
        """Return the torques (n,) in N m by which the joints exert `forces` against an external wrench (6,).

        A driven joint also carries the joints that follow it, whose own entries are 0. The hand's own weight
        is left out, and so are the moments of soft contacts about their normals.

        Raises
        ------
        InfeasibleWrenchError
            As for `forces`.

        Examples
        --------
        >>> import graspforce as gf
        >>> hand = gf.hands.preset("allegro-right")  # doctest: +SKIP
        >>> gf.plan_hand(hand, mesh).best.torques([0, 0, -1, 0, 0, 0])  # doctest: +SKIP
        """
        torques = np.zeros(len(self.hand.joints))
        torques[self.hand.driven] = self._driven_torques(self.forces(external_wrench))
        return torques

    def _driven_torques(self, forces: Array) -> Array:
        """(k,) torques in N m of the driven joints that exert forces (m, k) in contact frames."""
        world = np.einsum("mij,mi->mj", self.grasp.frames, forces[:, :3])
        return joint_torques(self.jacobians, self.hand.coupling, world)

    def squeeze(self, external_wrench: ArrayLike | None = None, stiffness: ArrayLike | None = None) -> Array:
        """Return joint positions (n,) in rad that position servos are sent to exert `torques`.

        A servo of stiffness k in N m/rad is sent ``joints + torques / k``; by default the hand's.

        Raises
        ------
        InfeasibleWrenchError
            As for `torques`.
        """
        given = self.hand.stiffness if stiffness is None else stiffness
        servo = finite_vector("stiffness", given, len(self.hand.joints), positive=True)
        sent = self.joints + self.torques(external_wrench) / servo
        z = sent[self.hand.driven]
        q: Array = self.hand.coupling @ z + self.hand.coupling_offset
        return q

    def torque_limited(self, max_normal_force: float = 1000.0) -> Grasp:
        """Return the grasp whose contact forces the joints' torque limits bound, in place of 1 N each.

        Its quality is a wrench in N that the hand resists in every direction. Contacts are hard fingers then.

        Raises
        ------
        InvalidInputError
            The torque limits leave a contact no force.
        """
        bound = real_number("max_normal_force", max_normal_force, positive=True)
        names = [self.hand.fingertips[f].name for f in self.fingers]
        hand = self.hand
        return torque_limited_grasp(
            self.grasp, self.jacobians @ hand.coupling, hand.torque_limits[hand.driven], bound, names
        )

    def save(
        self, path: str | os.PathLike[str], *, mesh: str | os.PathLike[str] | None = None, unit: str = "m"
    ) -> None:
        """Write the plan as JSON; `load` reads it.

        Safe to call from several threads for different files.

        Parameters
        ----------
        path : path-like
            File to write.
        mesh : path-like, optional
            File of the object's mesh, which ``graspforce shake`` reads.
        unit : str, optional
            Unit of that mesh's vertices.

        Raises
        ------
        InvalidFileError
            The file cannot be written.
        InvalidInputError
            The hand is neither a preset nor read from a file, so that no file can name it.
        """
        from .plan_file import save_plan  # noqa: PLC0415 - a file needs more packages than a plan

        save_plan(self, path, mesh, unit)

    @staticmethod
    def load(path: str | os.PathLike[str], hand: Hand | None = None) -> HandPlan:
        """Read a plan that `save` wrote.

        Safe to call from several threads. `hand` is needed where the file names none, and must have the
        joints and fingertips of the plan.

        Raises
        ------
        InvalidFileError
            The file cannot be read, or is no plan of the hand.
        """
        return loaded_plan(path, hand)[0]

    def __repr__(self) -> str:
        return (
            f"HandPlan({self.hand.name!r}, {len(self.fingers)} fingers, {self.quality.criterion} "
            f"epsilon={self.quality.epsilon:.4g}, slip onset {self.onset:.3g})"
        )


_MEASURES = ("preload", "contact_error", "penetration", "self_penetration", "pad_angle")


def loaded_plan(
    path: str | os.PathLike[str], hand: Hand | None = None
) -> tuple[HandPlan, tuple[Path, str] | None]:
    """Read a plan, and file and unit of its object's mesh; see `HandPlan.load`."""
    from .plan_file import load_plan  # noqa: PLC0415 - a file needs more packages than a plan

    fields, mesh = load_plan(path, hand)
    plan = HandPlan(**fields)
    try:
        plan._check()  # noqa: SLF001
    except InvalidInputError as error:
        raise InvalidFileError(Path(path), str(error).removeprefix("state: ")) from None
    return plan, mesh
