"""Internal forces at rest, the torques that exert them, and the push at which the first contact slips."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import ForceDistributor
from graspforce.errors import InfeasibleWrenchError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce._core import Grasp

    Array = NDArray[np.float64]


_RIGID = 1e-6  # m/N: a finger that joints cannot move along some direction yields that much
_PER_PRELOAD = 100.0
_LARGEST = 1e6  # N: a push that is larger than this is not looked for


def resting_forces(
    grasp: Grasp, preload: float, friction_margin: float, external_wrench: Array
) -> Array | None:
    """(m, k) forces of the least sum that balance the load, each finger pressing at least `preload` in N.

    They lie in cones that `friction_margin` narrows. None if there are no such forces.
    """
    try:
        return least_forces(grasp.replace(friction_margin=friction_margin), preload, external_wrench)
    except InfeasibleWrenchError:
        return None


def least_forces(grasp: Grasp, preload: float, external_wrench: Array) -> Array:
    """(m, k) forces of the least sum that balance a wrench, each finger pressing at least `preload` in N."""
    # The distributor takes lower bounds as shares of the contacts' limits.
    limit = _PER_PRELOAD * preload if preload > 0 else 1.0
    bounded = grasp.replace(max_normal_force=limit)
    least = preload / limit if preload > 0 else None
    forces: Array = ForceDistributor(bounded, "sum", min_normal=least).solve(external_wrench).forces
    return forces


def joint_torques(jacobians: Array, coupling: Array, forces: Array) -> Array:
    """(k,) torques in N m of driven joints that exert forces (m, 3), by Jacobians (m, 3, n)."""
    torques: Array = coupling.T @ np.einsum("mij,mi->j", jacobians, forces)
    return torques


def finger_stiffness(jacobians: Array, coupling: Array, stiffness: Array) -> Array:
    """(m, 3, 3) stiffness K = (J kp^-1 J^T)^-1 in N/m of fingers, for servos (k,) in N m/rad."""
    J = jacobians @ coupling
    inverse: Array = np.linalg.inv(np.einsum("mij,j,mkj->mik", J, 1 / stiffness, J) + _RIGID * np.eye(3))
    return inverse


def slip_onset(grasp: Grasp, forces: Array, stiffness: Array, wrenches: Array) -> Array:
    """(W,) largest multiples of wrenches (W, 6) at which no contact of passive fingers slips or opens.

    Fingers of stiffness K share a wrench w as springs: the object moves by x = (sum G K G^T)^-1 w, and
    contact k exerts df_k = -K G^T x more than at rest.
    """
    frames, points = grasp.frames, grasp.positions - grasp.origin
    lever = np.zeros((len(points), 6, 3))
    lever[:, :3] = np.eye(3)
    x, y, z = points.T
    zero = np.zeros_like(x)
    lever[:, 3:] = np.stack(
        [np.stack(row, -1) for row in ([zero, -z, y], [z, zero, -x], [-y, x, zero])], axis=1
    )
    total = np.einsum("mij,mjk,mlk->il", lever, stiffness, lever)
    # Powers of two leave all digits as they are, and keep squares of large wrenches finite.
    size = 2.0 ** np.frexp(np.abs(wrenches).max(axis=1))[1].astype(float).clip(-1000, 1000)
    wrenches = wrenches / size[:, None]
    # Three contacts on a line leave a rotation without stiffness: nothing of a push goes there.
    moves = np.linalg.lstsq(total, wrenches.T, rcond=1e-9)[0]
    shares = -np.einsum("mij,mlj,lw->wmi", stiffness, lever, moves)
    change = np.einsum("mij,wmj->wmi", frames, shares)
    mu, gamma = grasp.friction / grasp.friction_margin, grasp.torsion
    normal, tangent = forces[:, 0], forces[:, 1:3]
    twist = np.zeros_like(normal)
    if forces.shape[1] == 4:
        twist = np.divide(mu * forces[:, 3], gamma, out=np.zeros_like(normal), where=gamma > 0)
    # |t + s dt|^2 + twist^2 = mu^2 (n + s dn)^2 is quadratic in s; its least positive root is slip.
    dn, dt = change[..., 0], change[..., 1:]
    a = (dt**2).sum(-1) - (mu * dn) ** 2
    b = 2 * ((dt * tangent).sum(-1) - mu**2 * normal * dn)
    c = (tangent**2).sum(-1) + twist**2 - (mu * normal) ** 2
    onset = _least_positive_root(a, b, np.broadcast_to(c, a.shape))
    opening = np.where(dn < 0, normal / np.maximum(-dn, 1e-300), np.inf)
    least: Array = np.minimum(np.minimum(onset, opening).min(axis=1), _LARGEST * size) / size
    return least


def _least_positive_root(a: Array, b: Array, c: Array) -> Array:
    """Least s > 0 with a s^2 + b s + c = 0, where c <= 0 at s = 0; 0 where c > 0, inf where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(np.maximum(b * b - 4 * a * c, 0))
        q = -(b + np.where(b >= 0, root, -root)) / 2
        first, second = q / a, c / q
    real = b * b - 4 * a * c >= 0
    roots = np.stack(
        [
            np.where(real & (r > 0), r, np.inf)
            for r in (np.nan_to_num(first, nan=np.inf), np.nan_to_num(second, nan=np.inf))
        ]
    )
    least: Array = np.where(c > 0, 0.0, roots.min(axis=0))
    return least
