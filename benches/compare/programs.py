"""The programs of least forces as matrices, stated once for every solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

if TYPE_CHECKING:
    from collections.abc import Iterator

    import graspforce as gf


class LinearProgram:
    """``min t`` with forces ``W x = -w``, ``x >= 0`` and, for each contact, ``sum x <= t``; x ends with t."""

    def __init__(self, grasp: gf.Grasp) -> None:
        wrenches = grasp.primitive_wrenches
        count, self.dim = wrenches.shape
        self.contacts = grasp.num_contacts
        shares = np.repeat(np.eye(self.contacts), grasp.num_edges, axis=1)
        self.size = count + 1
        self.cost = np.append(np.zeros(count), 1.0)
        self.balance = np.column_stack([wrenches.T, np.zeros(self.dim)])
        self.limits = np.column_stack([shares, -np.ones(self.contacts)])


class ConeProgram:
    """``min t`` over forces f with ``G f = -w``, ``f_n <= f_U t`` and ``|f_t| <= mu f_n``; x = (f, t)."""

    def __init__(self, grasp: gf.Grasp) -> None:
        self.contacts, self.dim = grasp.num_contacts, grasp.wrench_dim
        forces = 3 * self.contacts
        self.size = forces + 1
        self.cost = np.append(np.zeros(forces), 1.0)
        self.balance = np.column_stack([grasp.grasp_matrix, np.zeros(self.dim)])
        self.limits = np.zeros((self.contacts, self.size))
        self.limits[np.arange(self.contacts), np.arange(0, forces, 3)] = 1 / grasp.max_normal_force
        self.limits[:, -1] = -1
        # Each three rows give (mu f_n, f_o, f_t), a member of the second-order cone.
        blocks = sparse.block_diag([np.diag([mu, 1, 1]) for mu in grasp.friction]).toarray()
        self.cones = np.column_stack([blocks, np.zeros(forces)])


def cone_planes(grasp: gf.Grasp) -> Iterator[np.ndarray]:
    """Of each contact the outward normals (l, 3), in its frame, of the planes of its linearised cone."""
    for edges, mu in zip(grasp.num_edges, grasp.friction, strict=True):
        angles = 2 * np.pi * (np.arange(edges) + 0.5) / edges
        inner = np.full(edges, -mu * np.cos(np.pi / edges))
        yield np.column_stack([inner, np.cos(angles), np.sin(angles)])


def spans(wrenches: np.ndarray) -> bool:
    return bool(np.linalg.matrix_rank(wrenches) == wrenches.shape[1])


def nonnegative_combination(wrenches: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and right-hand side of ``sum_h (1 + x_h) w_h = 0``, ``x >= 0``.

    Wrenches that span the space are force closure just where this has a solution; they are normalised,
    because closure does not depend on their lengths.
    """
    unit = (wrenches / np.linalg.norm(wrenches, axis=1)[:, None]).T
    return unit, -unit.sum(axis=1)
