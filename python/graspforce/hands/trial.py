"""The trial of a grasp in simulation: a held object is pushed along the six axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from graspforce._internal.checks import chosen, real_number, whole_number
from graspforce._internal.checks import instance as instance_of

from .controllers import Control, controller
from .grasp_problem import push_rows
from .grasped_object import grasped_object
from .hand_plan import HandPlan
from .simulation import TIMESTEP, Simulation
from .trial_result import Trial

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from .controllers import Controller

    Array = NDArray[np.float64]


_HELD = 0.05, np.deg2rad(15.0)  # m, rad: beyond this an object is lost
_CLOSE, _RAMP, _SETTLE = 0.6, 0.3, 0.7  # s
_ACCELERATION = 10.0  # m/s^2
_CHECKED = 25  # steps


def shake(
    plan: HandPlan,
    mesh: Any,
    mass: float = 0.1,
    *,
    control: Control = "squeeze",
    known_pushes: bool = False,
    closing: bool = False,
    acceleration: float = _ACCELERATION,
    pushes: ArrayLike | None = None,
    seconds: float = 2.0,
    friction: float | None = None,
    torsion: float | None = None,
) -> Trial:
    """Hold an object in simulation and push it along each axis; deterministic.

    Gravity is off; the load that the plan was made for is applied. The fingers squeeze the object for a
    second. Then it is pushed by `mass` times `acceleration`, every time from the same state.

    Friction cones are elliptic, ``impratio`` is 100, contacts have a time constant of 5 ms, a step is 2 ms.
    With MuJoCo's own settings a part of the planned forces does not arrive, and every grasp creeps.

    Safe to call from several threads.

    Parameters
    ----------
    plan : HandPlan
        The grasp.
    mesh : trimesh.Trimesh, tuple or path
        The object, as for `graspforce.plan_hand`.
    mass : float
        Of the object in kg.
    control : {"squeeze", "servo", "torque"}
        A fixed squeeze of the position servos. Or forces distributed at 500 Hz: added to the servos, or as
        pure torques with the fingers' free motions damped.
    known_pushes : bool
        True tells the push to a control that distributes forces. An arm knows the load of its own motion like
        that. Otherwise the control only sees that the object moves.
    closing : bool
        True starts from the pregrasp with a free object. The fingers then close on straight paths of the
        joints that arrive together, before they squeeze.
    acceleration : float
        Of the pushes in m/s^2; a push is `mass` times this.
    pushes : array_like, optional
        (W, 6) directions of pushes in place of the six axes: force and torque about the centre of mass, in
        multiples of the push.
    seconds : float
        Duration of each push.
    friction, torsion : float, optional
        Coefficients of the object; by default those that the grasp was planned for.

    Returns
    -------
    Trial
        What was held, and how far the object moved.

    Raises
    ------
    InvalidInputError
        An argument is out of its range.
    InfeasibleWrenchError
        The plan's resting forces need more than the torque limits.

    Examples
    --------
    >>> import graspforce as gf
    >>> import trimesh
    >>> hand, box = gf.hands.preset("allegro-right"), trimesh.creation.box((0.06, 0.06, 0.06))
    >>> plan = gf.plan_hand(hand, box, starts=20, best=1).best
    >>> gf.hands.shake(plan, box, seconds=0.5).success
    True
    """
    simulation, run = _prepared(plan, mesh, mass, control, known_pushes, closing, friction, torsion)
    size = real_number("mass", mass, positive=True) * real_number("acceleration", acceleration, positive=True)
    rows = push_rows(pushes)
    seconds = real_number("seconds", seconds, positive=True)
    settled = simulation.moved()
    arrived = simulation.normal_forces()
    state = simulation.state()
    ends = []
    for row in rows * size:
        simulation.restore(state)
        ends.append(_pushed(simulation, run, row, seconds) if _is_held(settled) else settled)
    displacement, rotation = np.array(ends).T
    held = np.array([_is_held(end) for end in ends])
    error = float(np.abs(arrived - plan.resting_forces[:, 0]).max())
    return Trial(held, displacement, rotation, *settled, arrived, error, run.infeasible, control)


def largest_pushes(
    plan: HandPlan,
    mesh: Any,
    mass: float = 0.1,
    *,
    control: Control = "squeeze",
    known_pushes: bool = False,
    pushes: ArrayLike | None = None,
    most: float = 24.0,
    halvings: int = 6,
    seconds: float = 1.0,
    friction: float | None = None,
    torsion: float | None = None,
) -> Array:
    """Return the largest push (W,) in N that is held along each direction, by bisection up to `most` N.

    Safe to call from several threads. Arguments are those of `shake`. The result is exact to
    ``most / 2**halvings``. It is 0 where nothing is held, or where the object is lost before any push.

    Examples
    --------
    >>> import graspforce as gf
    >>> gf.hands.largest_pushes(plan, mesh)  # doctest: +SKIP
    """
    simulation, run = _prepared(plan, mesh, mass, control, known_pushes, False, friction, torsion)
    rows = push_rows(pushes)
    most = real_number("most", most, positive=True)
    halvings = whole_number("halvings", halvings, least=1, most=50)
    seconds = real_number("seconds", seconds, positive=True)
    state = simulation.state()
    found = np.zeros(len(rows))
    if not _is_held(simulation.moved()):
        return found
    for k, row in enumerate(rows):
        low, high = 0.0, most
        for _ in range(halvings):
            middle = (low + high) / 2
            simulation.restore(state)
            held = _is_held(_pushed(simulation, run, middle * row, seconds))
            low, high = (middle, high) if held else (low, middle)
        found[k] = low
    return found


def _prepared(
    plan: HandPlan,
    mesh: Any,
    mass: Any,
    control: Any,
    known: bool,
    closing: bool,
    friction: Any,
    torsion: Any,
) -> tuple[Simulation, Controller]:
    """Check what all trials take; the simulation holds the object, after closing and settling."""
    instance_of("plan", plan, HandPlan)
    chosen("control", control, get_args(Control))
    mass = real_number("mass", mass, positive=True)
    mu = (
        float(plan.grasp.friction[0])
        if friction is None
        else real_number("friction", friction, positive=True)
    )
    gamma = float(plan.grasp.torsion[0]) if torsion is None else real_number("torsion", torsion, least=0)
    simulation = Simulation(plan, grasped_object(mesh), mass, mu, gamma)
    _close(simulation, plan, closing)
    run = controller(control, plan, known=known)
    for _ in range(round(_SETTLE / TIMESTEP)):
        run(simulation)
        simulation.step()
    return simulation, run


def _close(simulation: Simulation, plan: HandPlan, closing: bool) -> None:
    """Bring the fingers to the object if they start away from it, then squeeze while the load grows."""
    squeezed = plan.squeeze()
    simulation.place(plan.pregrasp if closing else plan.joints)
    if closing:
        # The motion ends slowly: the tips touch within a few steps of each other, and hardly bounce.
        steps = round(_CLOSE / TIMESTEP)
        for k in range(steps):
            share = np.sin(np.pi / 2 * (k + 1) / steps)
            simulation.send(plan.pregrasp + share * (plan.joints - plan.pregrasp))
            simulation.step()
    steps = round(_RAMP / TIMESTEP)
    for k in range(steps):
        share = (k + 1) / steps
        simulation.send(plan.joints + share * (squeezed - plan.joints))
        simulation.push(share * plan.external_wrench)
        simulation.step()


def _pushed(simulation: Simulation, run: Controller, wrench: Array, seconds: float) -> tuple[float, float]:
    load = simulation.plan.external_wrench
    simulation.push(load + wrench)
    for k in range(round(seconds / TIMESTEP)):
        run(simulation)
        simulation.step()
        if k % _CHECKED == 0 and not _is_held(simulation.moved()):
            break
    simulation.push(load)
    return simulation.moved()


def _is_held(end: tuple[float, float]) -> bool:
    return end[0] < _HELD[0] and end[1] < _HELD[1]
