"""Grasps whose contact forces are limited by joint torques."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graspforce._core import torque_limited_forces, unwarned_grasp
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from graspforce._core import Grasp

    Array = NDArray[np.float64]

_EDGES = 8


def torque_limited_grasp(
    grasp: Grasp, jacobians: Array, limits: Array, max_normal_force: float, names: Sequence[str]
) -> Grasp:
    """Return a grasp whose extreme forces are those that torques within limits (k,) exert.

    `jacobians` (m, 3, k) are those of the driven joints, `names` those of the fingers, for errors.
    """
    forces = []
    for axes, J, mu, name in zip(grasp.frames, jacobians, grasp.friction, names, strict=True):
        try:
            forces.append(torque_limited_forces(axes @ J, limits, float(mu), max_normal_force, _EDGES))
        except InvalidInputError as error:
            raise InvalidInputError(f"torque_limits: finger {name!r}: {error}") from None
    return unwarned_grasp(
        grasp.positions, grasp.normals, grasp.friction, max_normal_force, origin=grasp.origin,
        length_scale=grasp.length_scale, extreme_forces=forces,
    )  # fmt: skip
