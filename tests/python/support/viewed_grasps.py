"""Grasps that the tests of the viewer show."""

from contextlib import contextmanager

import numpy as np

import graspforce as gf
from graspforce.viewer import view

ANGLES = np.deg2rad([0, 120, 240])
OUTWARD = np.stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES], axis=1)
WRENCHES = [[0, 0, -5 - k, 0, 0, 0] for k in range(8)]


def cup(**options):
    return gf.Grasp(
        0.04 * OUTWARD, -OUTWARD, friction=0.6, max_normal_force=20.0, length_scale=0.04, **options
    )


def feet():
    corners = [(0.2, 0.1, 0), (0.2, -0.1, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0)]
    return gf.Grasp(corners, [(0, 0, 1)] * 4, friction=0.5, max_normal_force=20.0)


BEYOND = [[0, 0, -40, 0, 0, 0], [0, 0, 6, 0, 0, 2], [30, 0, -40, 0, 0, 0]]
"""A load that feet balance, one that lifts them off, and one that pushes them beyond their friction."""


@contextmanager
def showing(*arguments, port=0, **options):
    viewer = view(*arguments, port=port, **options)
    try:
        yield viewer
    finally:
        viewer.stop()
