"""Where contacts should go: pattern search, many starts, refinement, branch and bound, robustness."""

from .global_search import GlobalOptimum, plan_global
from .many_starts import PlanSet, plan_many
from .pattern_search import Iterate, Plan, plan
from .placement import Placement, PlacementQuality
from .problem import Criterion, Feasible, GraspOptions, Stopped, Surface
from .refinement import Refinement, refine
from .scoring import SearchCounts

__all__ = [
    "Criterion",
    "Feasible",
    "GlobalOptimum",
    "GraspOptions",
    "Iterate",
    "Placement",
    "PlacementQuality",
    "Plan",
    "PlanSet",
    "Refinement",
    "SearchCounts",
    "Stopped",
    "Surface",
    "plan",
    "plan_global",
    "plan_many",
    "refine",
]
