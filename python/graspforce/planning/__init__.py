"""Contact planning: pattern search, multistart, gradient refinement, branch and bound, placement noise."""

from .branch_and_bound import GlobalOptimum, plan_global
from .gradient_sampling import Refinement, refine
from .multistart import PlanSet, plan_multistart
from .pattern_search import Iterate, Plan, plan
from .placement_noise import PlacementNoise, PlacementQuality
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
