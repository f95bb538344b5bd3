"""Numbers that the field optimises in place of grasp quality, for many grasps at a time, with gradients.

They are cheaper or smoother than `graspforce.quality_many`, and none of them is a quality: none says which
disturbance a grasp resists.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import surrogate_arrays
from graspforce._internal.restored import expect_array
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Unpack

    from numpy.typing import ArrayLike, NDArray

    from graspforce.typing import GraspOptions

    Array = NDArray[np.float64]

__all__ = ["SurrogateBatch", "differentiable_force_closure", "min_weight", "span_residual"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SurrogateBatch(Record):
    """A surrogate of B grasps with m contacts, and its gradient.

    Numbers are NaN where the status is not 0. The axes (B, m) of a ragged batch are the one axis (N,) of its
    contacts. Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    values : numpy.ndarray
        (B,) the number.
    positions : numpy.ndarray
        (B, m, dim) change by m of displacement of each contact.
    normals : numpy.ndarray
        (B, m, dim) change by rad that each normal turns, orthogonal to it; the contact frame turns with it by
        the smallest rotation.
    spins : numpy.ndarray
        (B, m) change by rad that each contact frame spins about its normal.
    unique : numpy.ndarray
        (B,) bool, True where it is the derivative, as far as rounding can tell.
    status : numpy.ndarray
        (B,) int8 of `Status`: ``SOLVED`` (0), ``INFEASIBLE`` (1, no weights exist), ``INVALID`` (2, not a
        grasp) or ``NOT_CONVERGED`` (3).
    errors : Mapping of int to str
        Why rows have no number.
    """

    values: Array
    positions: Array
    normals: Array
    spins: Array
    unique: NDArray[np.bool_]
    status: NDArray[np.int8]
    errors: Mapping[int, str]

    def _check(self) -> None:
        shape = self.values.shape
        expect_array("values", self.values, (None,), finite=False)
        contacts = (None,) if np.ndim(self.positions) == 2 else (*shape, None)
        expect_array("positions", self.positions, (*contacts, None), finite=False)
        expect_array("normals", self.normals, self.positions.shape, finite=False)
        expect_array("spins", self.spins, self.positions.shape[:-1], finite=False)
        expect_array("unique", self.unique, shape, kind=np.bool_)
        expect_array("status", self.status, shape, kind=np.int8)

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        solved = int(np.count_nonzero(self.status == 0))
        return f"SurrogateBatch({len(self)} grasps, {solved} solved)"


def min_weight(
    positions: ArrayLike,
    normals: ArrayLike,
    *,
    offsets: ArrayLike | None = None,
    **options: Unpack[GraspOptions],
) -> SurrogateBatch:
    """Compute the largest least weight of primitive wrenches that sum to zero, on all cores (FRoGGeR).

    It is ``max min_j alpha_j`` subject to ``sum_j alpha_j w_j = 0`` and ``sum_j alpha_j = 1``: positive where
    the grasp is force closure, zero on the boundary, negative elsewhere, and at most 1 over the number of
    primitive wrenches. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : array_like
        (B, m, 2) or (B, m, 3), as for `graspforce.Grasp`.
    offsets : array_like, optional
        (B + 1,) for grasps of different numbers of contacts, as for `graspforce.quality_many`.
    **options
        As for `graspforce.quality_many`; true cones (``edges=None`` in space) have no primitive wrenches.

    Returns
    -------
    SurrogateBatch
        Its status is ``INFEASIBLE`` (1) where no weights of sum 1 sum the wrenches to zero, as for a single
        contact.

    Raises
    ------
    InvalidGraspError
        A shape or type is wrong, or an argument that all rows share.

    Examples
    --------
    Two fingers opposite each other have four primitive wrenches, which sum to zero with equal weights.

    >>> from graspforce import surrogates
    >>> found = surrogates.min_weight([[(-1, 0), (1, 0)]], [[(1, 0), (-1, 0)]], friction=0.5)
    >>> found.values.round(9).tolist()
    [0.25]
    """
    return SurrogateBatch(**surrogate_arrays("min_weight", positions, normals, offsets=offsets, **options))


def differentiable_force_closure(
    positions: ArrayLike,
    normals: ArrayLike,
    *,
    offsets: ArrayLike | None = None,
    **options: Unpack[GraspOptions],
) -> SurrogateBatch:
    """Compute the norm of the wrench of unit normal forces, on all cores (Liu et al. 2021).

    It is ``|sum_i G_i n_i|`` in the norm of ``length_scale``. Zero is neither necessary nor enough for force
    closure. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : array_like
        (B, m, 2) or (B, m, 3), as for `graspforce.Grasp`.
    offsets : array_like, optional
        (B + 1,) for grasps of different numbers of contacts, as for `graspforce.quality_many`.
    **options
        As for `graspforce.quality_many`. Friction and limits do not matter.

    Returns
    -------
    SurrogateBatch
        Where the value is zero, so is the gradient, and it is not unique.

    Raises
    ------
    InvalidGraspError
        A shape or type is wrong, or an argument that all rows share.

    Examples
    --------
    >>> from graspforce import surrogates
    >>> positions, normals = [[(-1, 0), (1, 0)]], [[(1, 0), (0, -1)]]
    >>> surrogates.differentiable_force_closure(positions, normals).values.round(6).tolist()
    [1.732051]
    """
    return SurrogateBatch(
        **surrogate_arrays("differentiable_force_closure", positions, normals, offsets=offsets, **options)
    )


def span_residual(
    positions: ArrayLike,
    normals: ArrayLike,
    *,
    limit: float = 20.0,
    offsets: ArrayLike | None = None,
    **options: Unpack[GraspOptions],
) -> SurrogateBatch:
    """Compute the least wrench of forces whose edges all take part, on all cores (GraspQP).

    It is ``min |sum_j x_j w_j|`` over ``1 <= x_j <= limit`` and all primitive wrenches, in the norm of
    ``length_scale``. Zero means that the wrenches balance with all edges at work: force closure, if they span
    all wrenches. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : array_like
        (B, m, 2) or (B, m, 3), as for `graspforce.Grasp`.
    limit : float
        Largest coefficient of an edge, at least 1.
    offsets : array_like, optional
        (B + 1,) for grasps of different numbers of contacts, as for `graspforce.quality_many`.
    **options
        As for `graspforce.quality_many`; true cones (``edges=None`` in space) have no primitive wrenches.

    Returns
    -------
    SurrogateBatch
        Where the value is zero, so is the gradient, and it is not unique.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        A shape or type is wrong, or an argument that all rows share.

    Examples
    --------
    >>> from graspforce import surrogates
    >>> found = surrogates.span_residual([[(-1, 0), (1, 0)]], [[(1, 0), (-1, 0)]], friction=0.5)
    >>> found.values.tolist()
    [0.0]
    """
    return SurrogateBatch(
        **surrogate_arrays("span_residual", positions, normals, limit=limit, offsets=offsets, **options)
    )
