"""Hands as Pinocchio models: what their joint torques allow at the fingertips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspforce._core import Grasp, torque_limited_forces, unwarned_grasp
from graspforce._internal.checks import finite_array, finite_vector, instance, real_number
from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike


def from_pinocchio(
    model: Any,
    configuration: ArrayLike,
    frames: Sequence[str],
    normals: ArrayLike,
    *,
    friction: ArrayLike = 0.5,
    max_normal_force: float = 1000.0,
    edges: int = 8,
    origin: ArrayLike | None = None,
    length_scale: float = 1.0,
) -> Grasp:
    r"""Grasp of a hand whose joint torques, and not fixed forces, limit the contacts.

    A finger in frame i can press with any force f of its friction cone for which
    :math:`|J_i^T f| \leq \tau_{\max}` (the model's effort limits; the hand's own weight is left out). The
    corners of that polytope (`graspforce.torque_limited_forces`) become the contact's extreme forces, so
    quality and forces respect the torques: a maximum of 1 means that some joint is at its limit. Contacts
    should be on different fingers; a joint that moves several is limited for each of them alone.

    Safe to call from several threads: the model is only read.

    Parameters
    ----------
    model : pinocchio.Model
        The hand; only read.
    configuration : array_like
        (nq,) joint positions.
    frames : sequence of str
        Frame of each contact, at the point of contact.
    normals : array_like
        (m, 3) into the object, in the world.
    friction, edges, origin, length_scale : optional
        As for `graspforce.Grasp`.
    max_normal_force : float, optional
        Bound of the normal force in N where the torques set none.

    Returns
    -------
    Grasp
        With the torque polytopes as extreme forces.

    Raises
    ------
    InvalidInputError
        An argument is not finite, a frame is unknown, or the torque limits leave a contact no force at all.
    MissingExtraError
        Pinocchio is not installed.

    Examples
    --------
    Three fingers of one prismatic joint each press inwards with at most 5 N.

    >>> import numpy as np
    >>> import pinocchio as pin
    >>> import graspforce as gf
    >>> hand, frames = pin.Model(), ["first", "second", "third"]
    >>> for name, angle in zip(frames, np.deg2rad([0, 120, 240])):
    ...     outward = np.array([np.cos(angle), np.sin(angle), 0])
    ...     placement = pin.SE3(pin.utils.rotate("z", angle), 0.04 * outward)
    ...     joint = hand.addJoint(0, pin.JointModelPX(), placement, name + " joint")
    ...     _ = hand.addFrame(pin.Frame(name, joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    >>> hand.effortLimit = np.full(3, 5.0)
    >>> normals = [(-np.cos(a), -np.sin(a), 0) for a in np.deg2rad([0, 120, 240])]
    >>> grasp = gf.from_pinocchio(hand, np.zeros(3), frames, normals, friction=0.6)
    >>> round(float(grasp.extreme_forces[:, 0].max()), 9)
    5.0
    """
    pin = optional("pinocchio", "pinocchio")
    instance("model", model, pin.Model)
    if not model.nv:
        raise InvalidInputError(f"model: {model.name!r} has no joints")
    if isinstance(frames, str) or not all(isinstance(name, str) for name in frames):
        raise InvalidInputError(f"frames: {frames!r} is not a sequence of names")
    q = finite_array("configuration", configuration)
    if q.shape != (model.nq,):
        raise InvalidInputError(f"configuration: shape {q.shape}, expected ({model.nq},)")
    max_normal_force = real_number("max_normal_force", max_normal_force, positive=True)
    torques = finite_vector("model.effortLimit", model.effortLimit, model.nv)
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    positions, jacobians = [], []
    for name in frames:
        if not model.existFrame(name):
            raise InvalidInputError(f"frames: {name!r} is not a frame of {model.name}")
        frame = model.getFrameId(name)
        positions.append(data.oMf[frame].translation.copy())
        full = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        jacobians.append(full[:3])
    cones = unwarned_grasp(positions, normals, friction, 1.0, edges)
    extreme_forces = []
    for name, mu, axes, jacobian in zip(frames, cones.friction, cones.frames, jacobians, strict=True):
        try:
            forces = torque_limited_forces(axes @ jacobian, torques, float(mu), max_normal_force, edges)
        except InvalidInputError as error:
            raise InvalidInputError(f"frames: {name!r} with the model's effort limits: {error}") from None
        extreme_forces.append(forces)
    return unwarned_grasp(
        positions, normals, friction, max_normal_force, origin=origin, length_scale=length_scale,
        extreme_forces=extreme_forces,
    )  # fmt: skip
