"""Contact planning: pattern search, multistart, gradient refinement, branch and bound, placement noise."""

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
