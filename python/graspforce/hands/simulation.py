"""A simulated hand that holds an object: MuJoCo with settings that keep friction honest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.optional_imports import optional

from .poses import quaternion_of, rotation_vectors
from .scene import add_couplings, add_hand, add_object

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .grasped_object import GraspedObject
    from .hand_plan import HandPlan

    Array = NDArray[np.float64]


TIMESTEP = 2e-3  # s
# MuJoCo's default contacts are so soft that 17 to 76% of a planned normal force arrives; with an impratio of
# 1 tangential friction creeps, and every grasp lets go.
_SOLREF = [0.005, 1.0]
_IMPRATIO = 100.0
_DIVERGED = 1e10  # m/s^2 and rad/s^2: MuJoCo gives up from here on


class Simulation:
    """A hand with a fixed palm and position servos, and a free object without gravity."""

    def __init__(
        self, plan: HandPlan, grasped: GraspedObject, mass: float, friction: float, torsion: float
    ) -> None:
        self._mujoco = mujoco = optional("mujoco", "hands")
        self.plan, hand = plan, plan.hand
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        option = spec.option
        option.timestep, option.gravity = TIMESTEP, [0, 0, 0]
        option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, _IMPRATIO
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        palm = plan.palm
        wrist = spec.worldbody.add_body(name="wrist", pos=palm[:3, 3], quat=quaternion_of(palm[:3, :3]))
        add_hand(spec, wrist, hand, collides=True)
        add_couplings(spec, hand)
        for k, j in enumerate(hand.driven):
            servo = spec.add_actuator(
                name=f"servo {k}", target=f"joint {j}", trntype=mujoco.mjtTrn.mjTRN_JOINT
            )
            servo.set_to_position(kp=float(hand.stiffness[j]), kv=0.0)
            limit = float(hand.torque_limits[j])
            servo.forcelimited, servo.forcerange, servo.ctrllimited = 1, [-limit, limit], 0
        body = spec.worldbody.add_body(name="object")
        body.add_freejoint(name="object")
        for geom in add_object(spec, body, grasped, mass):
            geom.friction, geom.condim, geom.priority = [friction, torsion, 1e-4], 4, 1
            geom.solref = _SOLREF
        for k in range(len(hand._model.bodies)):  # noqa: SLF001
            part = spec.body(f"body {k}")
            if not part.explicitinertial:
                part.mass, part.inertia, part.explicitinertial = 1e-3, [1e-6] * 3, True
        self.model = m = spec.compile()
        self.data = mujoco.MjData(m)
        self.body = m.body("object").id
        self._joint_at = np.array([m.joint(f"joint {j}").qposadr[0] for j in range(len(hand.joints))])
        self.dofs = np.array([m.joint(f"joint {j}").dofadr[0] for j in range(len(hand.joints))])
        self.tip_bodies = [m.body(f"body {hand.fingertips[f].body}").id for f in plan.fingers]
        self._tips = {m.geom(f"tip {f}").id: k for k, f in enumerate(plan.fingers)}
        self.settled = np.eye(3), np.zeros(3)
        self.diverged = False

    def place(self, joints: Array) -> None:
        """Put the hand at joint positions (n,) and the object at its planned pose, at rest."""
        self._mujoco.mj_resetData(self.model, self.data)
        self.diverged = False
        self.data.qpos[self._joint_at] = joints
        self.send(joints)
        self._mujoco.mj_forward(self.model, self.data)
        self.settled = self.data.xmat[self.body].reshape(3, 3).copy(), self.data.xipos[self.body].copy()

    @property
    def driven(self) -> Array:
        """(k,) positions of the driven joints in rad."""
        q: Array = self.data.qpos[self._joint_at[self.plan.hand.driven]]
        return q

    def send(self, joints: Array) -> None:
        """Send joint positions (n,) to the servos."""
        self.data.ctrl[:] = joints[self.plan.hand.driven]

    def step(self) -> None:
        """Advance by one time step, unless the simulation has diverged.

        ``mj_step`` would write a file into the working folder then, and start again where nothing had moved.
        """
        if self.diverged:
            return
        self._mujoco.mj_forward(self.model, self.data)
        self.diverged = not np.abs(self.data.qacc).max() < _DIVERGED
        if not self.diverged:
            self._mujoco.mj_implicit(self.model, self.data)

    def moved(self) -> tuple[float, float]:
        """How far the object is from where it was placed, in m and rad; infinite after divergence."""
        if self.diverged:
            return np.inf, np.inf
        R, x = self.settled
        turn = rotation_vectors(self.data.xmat[self.body].reshape(3, 3) @ R.T)
        return float(np.linalg.norm(self.data.xipos[self.body] - x)), float(np.linalg.norm(turn))

    def state(self) -> Array:
        """Everything that `restore` needs."""
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        stored = np.empty(self._mujoco.mj_stateSize(self.model, kind))
        self._mujoco.mj_getState(self.model, self.data, stored, kind)
        return stored

    def restore(self, state: Array) -> None:
        """Return to a state."""
        self.diverged = False
        self._mujoco.mj_setState(self.model, self.data, state, self._mujoco.mjtState.mjSTATE_INTEGRATION)
        self._mujoco.mj_forward(self.model, self.data)

    def push(self, wrench: Array) -> None:
        """Push the object's centre of mass from now on by a wrench (6,) in N and N m, in the world's axes."""
        self.data.xfrc_applied[self.body] = wrench

    def normal_forces(self) -> Array:
        """(m,) normal forces of the fingers in N."""
        found, six = np.zeros(len(self._tips)), np.zeros(6)
        for k in range(self.data.ncon):
            contact = self.data.contact[k]
            tip = next((self._tips[g] for g in contact.geom.tolist() if g in self._tips), None)
            if tip is not None:
                self._mujoco.mj_contactForce(self.model, self.data, k, six)
                found[tip] += six[0]
        return found

    def tip_jacobian(self, contact: int, point: Array) -> Array:
        """(3, n) of a point in the world on the body of a contact's tip, by all joints of the hand."""
        J = np.zeros((3, self.model.nv))
        self._mujoco.mj_jac(self.model, self.data, J, None, point, self.tip_bodies[contact])
        columns: Array = J[:, self.dofs]
        return columns
