"""Proofs that decide where answers differ: whoever found them, products of matrices confirm them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .programs import cone_planes, nonnegative_combination, spans

if TYPE_CHECKING:
    import graspforce as gf

    from .problems import Contacts

# Relative to wrenches, or forces, of unit size.
ZERO = 1e-9


def closure_is(contacts: Contacts, closed: bool) -> bool:
    """No: all wrenches lie on one side of a plane through the origin. Yes: a combination of all vanishes."""
    from scipy.optimize import nnls  # noqa: PLC0415

    if closed:
        rows, right = nonnegative_combination(contacts.union)
        residual = rows @ nnls(rows, right)[0] - right
        return spans(contacts.union) and float(np.abs(residual).max()) < ZERO
    unit = contacts.union / np.linalg.norm(contacts.union, axis=1)[:, None]
    along = unit @ contacts.grasp.quality("sum").direction
    return bool(min(along.max(), -along.min()) <= ZERO)


def least_maximum_is_not(distributor: gf.ForceDistributor, external: np.ndarray, answer: float) -> bool:
    """Show by forces in their cones what suffices, by multipliers what is needed."""
    found = distributor.solve(external)
    grasp, forces = found.grasp, found.forces
    size = np.abs(forces).max()
    unbalanced = np.abs(grasp.grasp_matrix @ forces.ravel() + external).max()
    outside = max((planes @ force).max() for planes, force in zip(cone_planes(grasp), forces, strict=True))
    if max(unbalanced, outside) > ZERO * size:
        return False
    suffices = (forces[:, 0] / grasp.max_normal_force).max()
    starts = np.cumsum([0, *grasp.num_edges[:-1]])
    reach = np.maximum.reduceat(grasp.primitive_wrenches @ found.dual, starts)
    needed = -external @ found.dual / np.maximum(reach, 0).sum()
    # What is proven is as wide as what rounding leaves of the proof.
    return bool(answer > suffices * (1 + 10 * ZERO) or answer < needed * (1 - 10 * ZERO))
