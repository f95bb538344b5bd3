"""Hands: from a model and an object's mesh to grasps that hold, and a simulated trial of them.

Needs the ``hands`` extra: MuJoCo for kinematics, distances and simulation, mink for inverse kinematics,
trimesh and manifold3d for meshes. They are imported when first used.
"""

from .fingertips import Fingertip
from .hand import Hand
from .hand_plan import HandPlan
from .hand_plan_set import HandPlanSet
from .known_hands import preset, presets
from .planner import plan_hand
from .pose import HandPose
from .reaching import reach
from .trial import largest_pushes, shake
from .trial_result import Trial

__all__ = [
    "Fingertip",
    "Hand",
    "HandPlan",
    "HandPlanSet",
    "HandPose",
    "Trial",
    "largest_pushes",
    "plan_hand",
    "preset",
    "presets",
    "reach",
    "shake",
]
