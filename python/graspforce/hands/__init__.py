"""Hands: from a model and an object's mesh to grasps that hold, and a simulated trial of them.

Needs the ``hands`` extra: MuJoCo for kinematics, distances and simulation, mink for inverse kinematics,
trimesh and manifold3d for meshes. They are imported when first used.

- A hand: `hand`; `known_hands`: of public packages; `hand_file`: from files; `hand_model`, `hand_data`,
  `model_file`, `model_relations`, `couplings`, `joint_values`, `fingertips`: what its model says.
- Planning: `planner`: `plan_hand`; `grasp_problem`: what is asked for; `grasped_object`, `convex_parts`: the
  object; `search`, `seeds`, `snap`, `distances`, `candidates`, `refinement`: poses; `plan_making`, `preload`,
  `limited_forces`, `torque_polytopes`, `closing`, `finishing`: from poses to plans; `hand_plan`,
  `hand_plan_set`, `plan_file`: the plans.
- `reaching` with `reach_seeds`: a pose for given contacts; `pose`: the result; `poses`, `kinematics`: many.
- `trial`: `shake`; `simulation`, `scene`, `controllers`: how; `trial_result`: what became of the object.
- `surface`: triangles for pictures.
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
