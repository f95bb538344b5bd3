"""Least forces of many grasps in one call, with gradients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._core import forces_many_arrays
from graspforce._internal.restored import expect_array
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Unpack

    from numpy.typing import ArrayLike, NDArray

    from graspforce.typing import GraspOptions

    Array = NDArray[np.float64]

__all__ = ["ForceGradients", "GraspForces", "forces_many"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ForceGradients(Record):
    """Gradients of B grasps with m contacts for K wrenches each.

    They are NaN where the batch has no forces. The axes (B, K, m) of a ragged batch are the axes (N,
    K) of its contacts. Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    positions : numpy.ndarray
        (B, K, m, dim) change by m of displacement of each contact.
    normals : numpy.ndarray
        (B, K, m, dim) change by rad that each normal turns, orthogonal to it; the contact frame turns with it
        by the smallest rotation.
    spins : numpy.ndarray
        (B, K, m) change by rad that each contact frame spins about its normal.
    external_wrench : numpy.ndarray
        (B, K, d) change by the external wrench.
    unique : numpy.ndarray
        (B, K) bool, True where it is the derivative, as far as rounding can tell. Elsewhere the value has a
        kink, and this is one of several gradients.
    """

    positions: Array
    normals: Array
    spins: Array
    external_wrench: Array
    unique: NDArray[np.bool_]

    def _check(self) -> None:
        expect_array("unique", self.unique, (None, None), kind=np.bool_)
        ragged = np.ndim(self.positions) == 3
        contacts = (None, self.unique.shape[1]) if ragged else (*self.unique.shape, None)
        expect_array("positions", self.positions, (*contacts, None), finite=False)
        expect_array("normals", self.normals, self.positions.shape, finite=False)
        expect_array("spins", self.spins, self.positions.shape[:-1], finite=False)
        expect_array("external_wrench", self.external_wrench, (*self.unique.shape, None), finite=False)

    def __repr__(self) -> str:
        grasps, wrenches = self.unique.shape
        unique = int(np.count_nonzero(self.unique))
        return f"ForceGradients({grasps} grasps, {wrenches} wrenches of each, {unique} unique)"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GraspForces(Record):
    """Least contact forces of B grasps with m contacts for K wrenches each.

    Numbers are NaN where there are no forces. Nearest forces whose ``gap`` is above ``rtol`` and 1e-9 are
    there, but ``NOT_CONVERGED``. The axes (B, K, m) of a ragged batch are the axes (N, K) of its contacts.
    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    sigma : numpy.ndarray
        (B, K) the least objective.
    forces : numpy.ndarray
        (B, K, m, k) contact forces in the contact frames, in N (torsion in N m).
    residual : numpy.ndarray
        (B, K, d) what the forces leave unbalanced, ``external_wrench + sum_i G_i f_i``.
    distance : numpy.ndarray
        (B, K) norm of the residual, in ``metric`` or in that of ``length_scale``.
    gap : numpy.ndarray
        (B, K) relative gap between the objective and its proven lower bound, as in `ForceSolution`.
    balanced : numpy.ndarray
        (B, K) bool, True where the residual is within `FEASIBILITY_TOLERANCE`.
    status : numpy.ndarray
        (B, K) int8 of `Status`: ``SOLVED`` (0), ``INFEASIBLE`` (1), ``INVALID`` (2, not a grasp, see
        ``errors``, or a wrench that is not finite) or ``NOT_CONVERGED`` (3).
    errors : Mapping of int to str
        What is wrong with the rows that are no grasps.
    gradient : ForceGradients or None
        Of ``sigma``; zero and not unique where nearest forces do not balance.
    distance_gradient : ForceGradients or None
        Of ``distance``, with ``infeasible="nearest"``; zero where the forces balance.
    """

    sigma: Array
    forces: Array
    residual: Array
    distance: Array
    gap: Array
    balanced: NDArray[np.bool_]
    status: NDArray[np.int8]
    errors: Mapping[int, str]
    gradient: ForceGradients | None
    distance_gradient: ForceGradients | None

    def _check(self) -> None:
        shape = self.status.shape
        expect_array("status", self.status, (None, None), kind=np.int8)
        for name in ("sigma", "distance", "gap"):
            expect_array(name, getattr(self, name), shape, finite=False)
        expect_array("balanced", self.balanced, shape, kind=np.bool_)
        contacts = (None, shape[1]) if np.ndim(self.forces) == 3 else (*shape, None)
        expect_array("forces", self.forces, (*contacts, None), finite=False)
        expect_array("residual", self.residual, (*shape, None), finite=False)

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        grasps, wrenches = self.status.shape
        solved = int(np.count_nonzero(self.status == 0))
        return f"GraspForces({grasps} grasps, {wrenches} wrenches of each, {solved} solved)"


def forces_many(
    positions: ArrayLike,
    normals: ArrayLike,
    external_wrenches: ArrayLike,
    *,
    objective: Literal["max", "sum", "squares"] = "max",
    weight: float = 0.0,
    min_normal: ArrayLike | None = None,
    rtol: float = 1e-9,
    reference: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    slack: ArrayLike | None = None,
    limits: bool = False,
    infeasible: Literal["status", "nearest"] = "status",
    metric: ArrayLike | None = None,
    gradient: bool = False,
    offsets: ArrayLike | None = None,
    **options: Unpack[GraspOptions],
) -> GraspForces:
    """Compute the least contact forces of many grasps, each for some external wrenches, on all cores.

    Safe to call from several threads. The interpreter lock is released. A row that is not a grasp, and a
    wrench that cannot be balanced, do not stop the others: they get a status.

    Parameters
    ----------
    positions, normals : array_like
        (B, m, 2) or (B, m, 3), as for `Grasp`.
    external_wrenches : array_like
        (K, d) for all grasps, or (B, K, d); d is 3 (planar) or 6. Along K each solve starts from the one
        before.
    objective, weight, min_normal, rtol, reference, weights, slack, limits : optional
        As for `ForceDistributor`, the same for all grasps.
    infeasible : {"status", "nearest"}
        How a wrench that nothing balances is answered: by ``Status.INFEASIBLE`` (1), or by the forces within
        their limits that come nearest, as `ForceDistributor.nearest` finds them.
    metric : array_like, optional
        (d, d) norm of the distance, with ``infeasible="nearest"``; else that of ``length_scale``.
    gradient : bool
        True to compute gradients by positions, normals and wrenches. Over true cones with ``min_normal`` they
        are as exact as ``sqrt(rtol)``, elsewhere nearly as exact as the forces.
    offsets : array_like, optional
        (B + 1,) for grasps of different numbers of contacts: ``positions`` and ``normals`` are then (N, dim),
        and grasp b has contacts ``offsets[b]`` to ``offsets[b + 1] - 1``, as for `quality_many`. Results of
        contacts are then (N, K, ...).
    **options
        ``friction``, ``max_normal_force``, ``torsion``, ``tangents``, ``origin``, ``length_scale``,
        ``edges``, ``friction_margin``, ``extreme_forces``: as for `quality_many`.

    Returns
    -------
    GraspForces
        Arrays with one entry for each grasp and wrench.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        A shape or type is wrong, or an argument that all rows share.

    Examples
    --------
    Two fingers of friction 0.5 lift a disc of 1 N, and one of 3 N: they need half of this as normal force.

    >>> import graspforce as gf
    >>> positions, normals = [[(-1.0, 0.0), (1.0, 0.0)]], [[(1.0, 0.0), (-1.0, 0.0)]]
    >>> weights = [(0.0, -1.0, 0.0), (0.0, -3.0, 0.0)]
    >>> found = gf.forces_many(positions, normals, weights, friction=0.5, gradient=True)
    >>> found.sigma.round(9).tolist()
    [[1.0, 3.0]]
    >>> float(found.gradient.external_wrench[0, 0, 1].round(9))
    -1.0
    """
    arrays: dict[str, Any] = forces_many_arrays(
        positions,
        normals,
        external_wrenches,
        objective=objective,
        weight=weight,
        min_normal=min_normal,
        rtol=rtol,
        reference=reference,
        weights=weights,
        slack=slack,
        limits=limits,
        infeasible=infeasible,
        metric=metric,
        gradient=gradient,
        offsets=offsets,
        **options,
    )
    for name in ("gradient", "distance_gradient"):
        if arrays[name] is not None:
            arrays[name] = ForceGradients(**arrays[name])
    return GraspForces(**arrays)
