"""What servos are sent while an object is pushed: a fixed squeeze, or forces distributed each tick."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

import numpy as np

from graspforce._core import ForceDistributor
from graspforce.errors import InfeasibleWrenchError, NotConvergedError

from .poses import rotation_vectors
from .preload import joint_torques

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .hand_plan import HandPlan
    from .simulation import Simulation

    Array = NDArray[np.float64]


Control: TypeAlias = Literal["squeeze", "servo", "torque"]
"""A fixed squeeze; distributed forces on top of position servos; or distributed forces as pure torques."""

# Of the object, which is held where it was by a virtual spring and damper.
_STIFFNESS, _DAMPING = 200.0, 2.0  # N/m, N s/m
_TURN_STIFFNESS, _TURN_DAMPING = 0.3, 5e-3  # N m/rad, N m s/rad
_NULL_STIFFNESS, _NULL_DAMPING = (
    0.3,
    0.02,
)  # N m/rad, N m s/rad: motions of fingers that leave the tips at rest
_REST = 1e-5  # N and N m
_MARGIN = 1.3  # friction is divided by it


class Controller(Protocol):
    """Called before every step."""

    infeasible: int

    def __call__(self, simulation: Simulation) -> None:
        """Write what the servos are sent."""
        ...


def controller(control: Control, plan: HandPlan, *, known: bool) -> Controller:
    """Return the controller of a name, which is told of pushes where they are `known`."""
    return (
        Squeeze(plan) if control == "squeeze" else Distribution(plan, pure=control == "torque", known=known)
    )


class Squeeze:
    """Position servos that are sent beyond the contacts, as far as the resting forces need."""

    infeasible = 0

    def __init__(self, plan: HandPlan) -> None:
        self._sent = plan.squeeze()

    def __call__(self, simulation: Simulation) -> None:
        """Send the squeeze."""
        simulation.send(self._sent)


class Distribution:
    """Forces that pull the object back to its place, distributed over the true friction cones every tick.

    Least squares from the resting forces answer in microseconds, also with soft fingers and lower bounds: the
    forces at rest are the reference, so that every finger keeps pressing. The pose of the object is read from
    the simulation.
    """

    def __init__(self, plan: HandPlan, *, pure: bool, known: bool) -> None:
        self._plan, self._pure, self._known = plan, pure, known
        limit = max(10.0, 20 * plan.preload)
        cones = plan.grasp.replace(edges=None, friction_margin=_MARGIN, max_normal_force=limit)
        self._distributor = ForceDistributor(cones, "squares", reference=plan.resting_forces)
        self._frames, self._points = cones.frames, cones.positions
        self._forces = plan.resting_forces
        self.infeasible = 0

    def __call__(self, simulation: Simulation) -> None:
        """Distribute the forces for where the object is, and send what exerts them."""
        plan, data = self._plan, simulation.data
        R0, x0 = simulation.settled
        R, x = data.xmat[simulation.body].reshape(3, 3), data.xipos[simulation.body]
        turned = R @ R0.T
        velocity = data.qvel[-6:]
        pull = -_STIFFNESS * (x - x0) - _DAMPING * velocity[:3]
        twist = -_TURN_STIFFNESS * rotation_vectors(turned) - _TURN_DAMPING * (R @ velocity[3:])
        # The grasp is that of the planned pose, and turns with the object.
        wanted = np.concatenate([turned.T @ pull, turned.T @ twist])
        pushed = data.xfrc_applied[simulation.body] if self._known else plan.external_wrench
        load = (pushed.reshape(2, 3) @ turned).ravel()
        try:
            # The forces at rest balance nothing; a balance of less is checked relative to the wrench itself.
            asked = load - wanted
            rest = np.abs(asked - plan.external_wrench).max() < _REST
            self._forces = plan.resting_forces if rest else self._distributor.solve(asked).forces
        except (InfeasibleWrenchError, NotConvergedError):
            # The last forces hold on; the tick is counted.
            self.infeasible += 1
        world = np.einsum("mij,mi->mj", self._frames, self._forces[:, :3]) @ turned.T
        points = (self._points - plan.grasp.origin) @ turned.T + x
        J = np.stack([simulation.tip_jacobian(k, point) for k, point in enumerate(points)])
        hand = plan.hand
        torques = joint_torques(J, hand.coupling, world)
        servo = hand.stiffness[hand.driven]
        if not self._pure:
            data.ctrl[:] = plan.joints[hand.driven] + torques / servo
            return
        # Torques alone leave motions free that no contact resists.
        driven = (J @ hand.coupling).reshape(-1, len(servo))
        free = np.eye(len(servo)) - np.linalg.pinv(driven, rcond=1e-3) @ driven
        rate = data.qvel[simulation.dofs[hand.driven]]
        back = _NULL_STIFFNESS * (plan.joints[hand.driven] - simulation.driven) - _NULL_DAMPING * rate
        data.ctrl[:] = simulation.driven + (torques + free @ back) / servo
