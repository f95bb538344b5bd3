"""Poses as matrices (4, 4) and unit quaternions (w, x, y, z), one or many."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def cross(a: Array, b: Array) -> Array:
    """Return cross products (..., 3); `numpy.cross` takes three times as long for some dozen vectors."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def matrix_of(position: Array, rotation: Array) -> Array:
    """Return the pose (4, 4) of a position (3,) and a rotation (3, 3)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def inverse(pose: Array) -> Array:
    """Return the inverse of a pose (4, 4)."""
    return matrix_of(-pose[:3, :3].T @ pose[:3, 3], pose[:3, :3].T)


def rotations(quaternions: Array) -> Array:
    """Return rotations (..., 3, 3) of unit quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(rotation: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation (3, 3), with a real part that is not negative."""
    # The matrix of Bar-Itzhack; its leading eigenvector is the quaternion, also near half turns.
    m = rotation
    k = np.array([
        [m[0, 0] + m[1, 1] + m[2, 2], 0, 0, 0],
        [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], 0, 0],
        [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0],
        [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1]],
    ])  # fmt: skip
    leading: Array = np.linalg.eigh(k)[1][:, -1]
    return leading if leading[0] >= 0 else -leading


def rotation_of(vectors: Array) -> Array:
    """Return rotations (..., 3, 3) by rotation vectors (..., 3) in rad (Rodrigues' formula)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([np.stack(r, -1) for r in ([zero, -z, y], [z, zero, -x], [-y, x, zero])], axis=-2)
    # sinc(a / pi) is sin(a) / a.
    half = np.sinc(angle / (2 * np.pi))
    turned: Array = np.eye(3) + np.sinc(angle / np.pi) * cross + half**2 / 2 * (cross @ cross)
    return turned


def rotation_vectors(rotation: Array) -> Array:
    """Return the rotation vector (3,) in rad of a rotation (3, 3)."""
    q = quaternion_of(rotation)
    length = float(np.linalg.norm(q[1:]))
    return np.zeros(3) if length < 1e-15 else q[1:] / length * 2 * np.arctan2(length, q[0])


def turned_to(axis: Array) -> Array:
    """Return the quaternion (4,) that turns the z axis to a unit axis (3,)."""
    half = np.array([1 + axis[2], -axis[1], axis[0], 0.0])
    length = float(np.linalg.norm(half))
    return np.array([0.0, 1.0, 0.0, 0.0]) if length < 1e-9 else half / length
