"""Certified grasp quality, contact planning and force distribution for multifingered grasps.

>>> import graspforce as gf
>>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
>>> round(grasp.quality("max").epsilon, 6)
0.57735

Importing the package needs NumPy alone: figures, oracles and viewers are imported where they are used.
"""

from . import surfaces
from ._core import (
    ForceBatch,
    ForceDistributor,
    ForceSolution,
    ForceSteps,
    Gradient,
    Grasp,
    MinkowskiSum,
    Quality,
    QualityBatch,
    __version__,
    quality_many,
    torque_limited_forces,
)
from .errors import (
    BusyError,
    GraspForceError,
    InfeasibleWrenchError,
    InvalidGraspError,
    InvalidInputError,
    NotConvergedError,
    TooLargeError,
)
from .planning import Iterate, Plan, plan

__all__ = [
    "BusyError",
    "ForceBatch",
    "ForceDistributor",
    "ForceSolution",
    "ForceSteps",
    "Gradient",
    "Grasp",
    "GraspForceError",
    "InfeasibleWrenchError",
    "InvalidGraspError",
    "InvalidInputError",
    "Iterate",
    "MinkowskiSum",
    "NotConvergedError",
    "Plan",
    "Quality",
    "QualityBatch",
    "TooLargeError",
    "__version__",
    "plan",
    "quality_many",
    "surfaces",
    "torque_limited_forces",
]
