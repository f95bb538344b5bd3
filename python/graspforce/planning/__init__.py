"""Contact planning: the search for the best places of contacts.

- `pattern_search`: `plan`, the search of section 3.4; `multistart`: from many starts; `gradient_sampling`:
  `refine`; `branch_and_bound`: `plan_global`. Their results: `plan_result`, `global_optimum`.
- `problem`: what every search solves; `candidates`: contacts of parameters; `scoring`: what is compared;
  `placement_noise`: quality under errors of placement.
- `distinct`: which grasps are the same; `progress`: the progress bar.
"""

from .branch_and_bound import plan_global
from .global_optimum import GlobalOptimum
from .gradient_sampling import Refinement, refine
from .multistart import PlanSet, plan_multistart
from .pattern_search import plan
from .placement_noise import PlacementNoise, PlacementQuality
from .plan_result import Iterate, Plan
from .scoring import SearchCounts

__all__ = [
    "GlobalOptimum",
    "Iterate",
    "PlacementNoise",
    "PlacementQuality",
    "Plan",
    "PlanSet",
    "Refinement",
    "SearchCounts",
    "plan",
    "plan_global",
    "plan_multistart",
    "refine",
]
