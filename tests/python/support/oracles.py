"""Independent answers: Eq. 3 in NumPy, hulls by Qhull, linear programs by HiGHS.

Nothing here calls the library, so agreement is evidence.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

GRASP_ARGUMENTS = ("positions", "normals", "tangents", "friction", "max_normal_force", "edges")


def grasp_arguments(case: dict) -> dict:
    """Pick the arguments of a grasp out of a reference case."""
    return {name: case[name] for name in GRASP_ARGUMENTS if name in case}


def primitive_wrenches(
    positions, normals, *, friction, max_normal_force, edges=None, tangents=None
) -> list[np.ndarray]:
    """Eqs. 3 and 8: one (l, d) array for each contact."""
    positions, normals = np.array(positions, float), np.array(normals, float)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    count, dim = positions.shape
    mu, limit = np.broadcast_to(friction, count), np.broadcast_to(max_normal_force, count)
    wrenches = []
    for i, (r, n) in enumerate(zip(positions, normals, strict=True)):
        if dim == 2:
            t = np.array([-n[1], n[0]])
            forces = limit[i] * np.array([n + mu[i] * t, n - mu[i] * t])
            torques = (r[0] * forces[:, 1] - r[1] * forces[:, 0])[:, None]
        else:
            o = np.asarray(tangents[i], float)
            o = o - n * (n @ o)
            o /= np.linalg.norm(o)
            t = np.cross(n, o)
            angles = 2 * np.pi * np.arange(1, edges + 1) / edges
            forces = limit[i] * (n + mu[i] * (np.cos(angles)[:, None] * o + np.sin(angles)[:, None] * t))
            torques = np.cross(r, forces)
        wrenches.append(np.hstack([forces, torques]))
    return wrenches


def outside_cones(forces, friction, edges=None):
    """By how much forces (..., m, k) in contact frames leave the cones of Eq. 3, in N; (..., m).

    A linearised cone is checked by its planes, each halfway between two edges.
    """
    if forces.shape[-1] == 2:
        planes = np.array([[1.0], [-1.0]])
    else:
        angles = 2 * np.pi * (np.arange(edges) + 0.5) / edges
        planes = np.column_stack([np.cos(angles), np.sin(angles)]) / np.cos(np.pi / edges)
    needed = (forces[..., 1:] @ planes.T).max(axis=-1)
    return np.maximum(needed - np.asarray(friction) * forces[..., 0], -forces[..., 0])


def minkowski_points(wrenches: list[np.ndarray]) -> np.ndarray:
    """Every sum of at most one wrench of each contact, at least one in all."""
    dim = wrenches[0].shape[1]
    choices = [np.vstack([np.zeros(dim), w]) for w in wrenches]
    return np.array([sum(choice) for choice in itertools.product(*choices)])[1:]


def inner_radius(points: np.ndarray) -> float:
    """Distance from the origin to the nearest facet of the hull, positive if the origin is inside."""
    # Joggling or merging would change the answer; Qhull raises where it cannot do without.
    return float(-ConvexHull(points, qhull_options="Qt").equations[:, -1].max())


def least_sum(wrenches: list[np.ndarray], external) -> float | None:
    """Least sum of normalised normal forces that balances the external wrench; None if nothing does."""
    W = np.vstack(wrenches).T
    return _optimum(np.ones(W.shape[1]), W, external)


def least_max(wrenches: list[np.ndarray], external) -> float | None:
    """Least maximum of normalised normal forces that balances the external wrench; None if nothing does."""
    W = np.vstack(wrenches).T
    shares = np.repeat(np.eye(len(wrenches)), [len(w) for w in wrenches], axis=1)
    cost = np.append(np.zeros(W.shape[1]), 1.0)
    return _optimum(
        cost,
        np.hstack([W, np.zeros((len(W), 1))]),
        external,
        A_ub=np.hstack([shares, -np.ones((len(shares), 1))]),
        b_ub=np.zeros(len(shares)),
    )


def _optimum(cost, W, external, **inequalities) -> float | None:
    tight = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    result = linprog(cost, A_eq=W, b_eq=-np.asarray(external, float), options=tight, **inequalities)
    if result.status == 2:
        return None
    assert result.status == 0, result.message
    return float(result.fun)
