"""Contact planning: the search for the best places of contacts.

- `pattern_search`: `plan`, the search of section 3.4; `multistart`: from many starts; `bundle_ascent`:
  `refine`, with the steps of `linear_pieces`, from `support_pieces` and `contact_moves`, along the edges of
  `walls`; `branch_and_bound`: `plan_global`. The results: `plan_result`,
  `global_optimum`.
- `separable_bounds`: bounds where contacts have parameters of their own; `contact_groups` and
  `contact_wrenches`: these contacts; `search_scales`: sizes that a search is measured against.
- `problem`: what every search solves; `candidates`: contacts of parameters; `scoring`: what is compared;
  `placement_noise`: quality under errors of placement.
- `distinct`: which grasps are the same; `progress`: the progress bar.
"""

from .branch_and_bound import plan_global
from .bundle_ascent import Refinement, refine
from .global_optimum import GlobalOptimum
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
