"""Certified grasp quality, contact planning and force distribution for multifingered grasps.

>>> import graspforce as gf
>>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
>>> round(grasp.quality("max").epsilon, 6)
0.57735

Importing the package needs NumPy alone. Files, figures, viewers, hands and simulators
are imported when first used.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

from . import surfaces, surrogates
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
from .adapters import from_drake, from_mujoco, from_pinocchio
from .datasets import grade
from .errors import (
    BusyError,
    GraspForceError,
    GraspWarning,
    InfeasibleWrenchError,
    InvalidFileError,
    InvalidGraspError,
    InvalidInputError,
    MissingExtraError,
    NoContactError,
    NoGraspError,
    NotConvergedError,
    ResumeError,
    TooLargeError,
)
from .gradients import BundleBatch, GradientBatch
from .grasp_forces import ForceGradients, GraspForces, forces_many
from .planning import (
    GlobalOptimum,
    Iterate,
    PlacementNoise,
    PlacementQuality,
    Plan,
    PlanSet,
    Refinement,
    plan,
    plan_global,
    plan_multistart,
    refine,
)
from .status import Status
from .support import SupportRegion, patch, support_region
from .uncertainty import ClosureProbability, FrictionBracket, least_friction, probability_of_closure

__all__ = [
    "BundleBatch",
    "BusyError",
    "ClosureProbability",
    "ForceBatch",
    "ForceDistributor",
    "ForceGradients",
    "ForceSolution",
    "ForceSteps",
    "FrictionBracket",
    "GlobalOptimum",
    "Gradient",
    "GradientBatch",
    "Grasp",
    "GraspForceError",
    "GraspForces",
    "GraspWarning",
    "InfeasibleWrenchError",
    "InvalidFileError",
    "InvalidGraspError",
    "InvalidInputError",
    "Iterate",
    "MinkowskiSum",
    "MissingExtraError",
    "NoContactError",
    "NoGraspError",
    "NotConvergedError",
    "PlacementNoise",
    "PlacementQuality",
    "Plan",
    "PlanSet",
    "Quality",
    "QualityBatch",
    "Refinement",
    "ResumeError",
    "Status",
    "SupportRegion",
    "TooLargeError",
    "__version__",
    "forces_many",
    "from_drake",
    "from_mujoco",
    "from_pinocchio",
    "grade",
    "hands",
    "least_friction",
    "patch",
    "plan",
    "plan_global",
    "plan_hand",
    "plan_multistart",
    "probability_of_closure",
    "quality_many",
    "refine",
    "support_region",
    "surfaces",
    "surrogates",
    "torque_limited_forces",
]


if _TYPE_CHECKING:
    from . import hands as hands
    from .files import load_grasp as load_grasp
    from .files import save_grasp as save_grasp
    from .hands import plan_hand as plan_hand


_FROM_FILES = ("load_grasp", "save_grasp")
_FROM_HANDS = ("hands", "plan_hand")


# Files need the extra `cli`. These names are not in __all__: a star import must work without it.
def __getattr__(name: str) -> _Any:
    if name in _FROM_FILES:
        from . import files  # noqa: PLC0415

        return getattr(files, name)
    # Two dozen modules that most programs never need.
    if name in _FROM_HANDS:
        module = _import_module("graspforce.hands")
        return module if name == "hands" else module.plan_hand
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_FROM_FILES, *_FROM_HANDS])
