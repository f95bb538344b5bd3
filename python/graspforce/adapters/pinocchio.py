"""Hands as Pinocchio models: what their joint torques allow at the fingertips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp
from graspforce.errors import InvalidInputError, MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

__all__ = ["from_pinocchio"]


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
    corners of that polytope become the contact's extreme forces, so quality and forces respect the
    torques: a maximum of 1 means that some joint is at its limit. Contacts should be on different fingers;
    a joint that moves several is limited for each of them alone.

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
        A frame is unknown, or the torque limits leave a contact no force at all.
    MissingExtraError
        Pinocchio, or SciPy, is not installed.
    """
    try:
        import pinocchio as pin  # noqa: PLC0415 - needed here alone
        from scipy.spatial import HalfspaceIntersection  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise MissingExtraError("pinocchio", error) from error

    q = np.asarray(configuration, dtype=float)
    if q.shape != (model.nq,):
        raise InvalidInputError(f"configuration: shape {q.shape}, expected ({model.nq},)")
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
    cones = Grasp(positions, normals, friction, 1.0, edges)
    corners = np.split(cones.extreme_forces, np.cumsum(cones.num_edges)[:-1])
    extreme_forces = []
    for name, fan, axes, jacobian in zip(frames, corners, cones.frames, jacobians, strict=True):
        if len(fan) == 1:
            raise InvalidInputError(
                f"friction: zero at {name!r}, where torques then limit a line, not a cone"
            )
        torques = (axes @ jacobian).T
        halfspaces = _halfspaces(fan, torques, model.effortLimit, max_normal_force)
        # Half of the largest normal force that the torques allow: off every side.
        reach = np.append(model.effortLimit / np.maximum(np.abs(torques[:, 0]), 1e-300), max_normal_force)
        if reach.min() <= 0:
            raise InvalidInputError(f"model: its effort limits leave no force at {name!r}")
        inside = np.array([reach.min() / 2, 0, 0])
        found = HalfspaceIntersection(halfspaces, inside).intersections
        extreme_forces.append(np.unique(found.round(12), axis=0))
    return Grasp(
        positions, normals, friction, max_normal_force, origin=origin, length_scale=length_scale,
        extreme_forces=extreme_forces,
    )  # fmt: skip


def _halfspaces(
    fan: NDArray[np.float64], torques: NDArray[np.float64], limits: NDArray[np.float64], bound: float
) -> NDArray[np.float64]:
    """Rows ``[a, b]`` of ``a . f + b <= 0``: sides of the cone, its end, and both bounds of each torque."""
    sides = np.cross(np.roll(fan, -1, axis=0), fan)
    sides *= -np.sign(sides[:, :1] * fan[:1, 0])
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    moving = np.abs(torques).max(axis=1) > 1e-12
    both = [np.column_stack([sign * torques[moving], -limits[moving]]) for sign in (1, -1)]
    return np.vstack([np.column_stack([sides, np.zeros(len(sides))]), [[1, 0, 0, -bound]], *both])
