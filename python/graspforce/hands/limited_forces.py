"""Contact forces within friction and the joints' torque limits, as linear programs over all contacts at once.

Joints that several fingers share couple their contacts, and soft contacts have cones of four dimensions: a
polytope for each contact would hold neither.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce.errors import InfeasibleWrenchError

from .preload import least_forces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from graspforce._core import Grasp

    Array = NDArray[np.float64]


_OPTIONS = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
_LESS = 1e-9  # of the preload: what the next program may lack of the share that the last one found


def limited_forces(
    grasp: Grasp, torques: Array, limits: Array, preload: float, external_wrench: Array, joints: Sequence[str]
) -> tuple[Array, float]:
    """Return the forces (m, k) of the least sum in N that balance a wrench (6,), and a share of the preload.

    The torques are within limits (j,) in N m. `torques` (j, m, 3) are those of unit forces in the contacts'
    frames. Every finger presses at least `preload` in N, or the largest share of it that the limits allow.
    `joints` name the torques in errors.

    Raises
    ------
    InfeasibleWrenchError
        No forces within friction and the torque limits balance the wrench. The error's ``direction`` proves
        it, and its message names the joint.
    """
    program = _Program(grasp, torques, limits, external_wrench)
    share: float | None = 1.0
    found = program.least_sum(preload)
    if found is None:
        share = program.largest_share(preload)
        found = None if share is None else program.least_sum(share * (1 - _LESS) * preload)
    if found is None or share is None:
        raise program.refused(joints)
    return found, share


def unit_torques(grasp: Grasp, jacobians: Array, coupling: Array) -> Array:
    """(j, m, 3) torques in N m of driven joints that exert 1 N along each axis of the contacts' frames."""
    torques: Array = np.einsum("min,mai,nj->jma", jacobians, grasp.frames, coupling, optimize=True)
    return torques


class _Program:
    """Linear programs whose variables are the multiples of all extreme forces."""

    def __init__(self, grasp: Grasp, torques: Array, limits: Array, external_wrench: Array) -> None:
        self._limits, self._grasp = limits, grasp
        extreme = grasp.extreme_forces
        contact = np.repeat(np.arange(grasp.num_contacts), grasp.num_edges)
        self._extreme, self._contact = extreme, contact
        # Rows of torques and those of forces count alike.
        self._norm = np.repeat([1.0, grasp.length_scale], 3)
        self._wrenches = (grasp.primitive_wrenches / self._norm).T
        self._wanted = -external_wrench / self._norm
        self._torques = np.einsum("jni,ni->jn", torques[:, contact], extreme[:, :3])
        self._normal = np.where(np.arange(grasp.num_contacts)[:, None] == contact, extreme[:, 0], 0.0)

    def _solved(self, cost: Array, above: Array, upper: Array, more: Array | None = None) -> Any:
        """Minimise `cost` over multiples, and over one more variable with its bounds, subject to balance."""
        balance = self._wrenches
        bounds: list[Any] = [(0, None)] * self._wrenches.shape[1]
        if more is not None:
            balance = np.hstack([balance, np.zeros((6, 1))])
            bounds.append(tuple(more))
        solve = optional("scipy.optimize", "hands").linprog
        return solve(cost, above, upper, balance, self._wanted, bounds, method="highs", options=_OPTIONS)

    def least_sum(self, preload: float) -> Array | None:
        """(m, k) forces of the least sum of normal components that press at least `preload`."""
        above = np.vstack([self._torques, -self._torques, -self._normal])
        upper = np.concatenate([self._limits, self._limits, np.full(len(self._normal), -preload)])
        end = self._solved(self._extreme[:, 0], above, upper)
        if end.status != 0:
            return None
        forces = np.zeros((len(self._normal), self._extreme.shape[1]))
        np.add.at(forces, self._contact, end.x[:, None] * self._extreme)
        return forces

    def largest_share(self, preload: float) -> float | None:
        """Largest share of the preload, at most 1, by which all fingers can press."""
        free = np.zeros((2 * len(self._limits), 1))
        above = np.vstack([
            np.hstack([np.vstack([self._torques, -self._torques]), free]),
            np.hstack([-self._normal, np.full((len(self._normal), 1), preload)]),
        ])  # fmt: skip
        upper = np.concatenate([self._limits, self._limits, np.zeros(len(self._normal))])
        cost = np.append(np.zeros(self._wrenches.shape[1]), -1.0)
        end = self._solved(cost, above, upper, np.array([0.0, 1.0]))
        return float(end.x[-1]) if end.status == 0 else None

    def refused(self, joints: Sequence[str]) -> InfeasibleWrenchError:
        """Return the error with its witness: by which factor the limits are too small, and along what."""
        rows = np.vstack([self._torques, -self._torques])
        above = np.hstack([rows, -np.tile(self._limits, 2)[:, None]])
        cost = np.append(np.zeros(self._wrenches.shape[1]), 1.0)
        end = self._solved(cost, above, np.zeros(len(rows)), np.array([0.0, np.inf]))
        if end.status != 0:
            # The cones alone do not balance it: the distributor says so, with its own witness.
            least_forces(self._grasp, 0.0, -self._wanted * self._norm)
        factor = float(end.x[-1])
        used = np.abs(self._torques @ end.x[:-1]) / self._limits
        j = int(used.argmax())
        direction = end.eqlin.marginals / self._norm
        error = InfeasibleWrenchError(
            "external_wrench: no forces within friction and torque limits balance it: joint "
            f"{joints[j]} would need {used[j] * self._limits[j]:.4g} N m, more than its limit of "
            f"{self._limits[j]:.4g} N m; limits {factor:.4g} times as large would do"
        )
        error.direction = direction / np.linalg.norm(direction)
        return error
