"""Figures of grasps, wrench sets, forces and searches, in one restrained style.

Needs matplotlib (the ``plot`` extra). Functions ``draw_...`` take axes and return what they drew; functions
``..._figure`` make a whole figure. Figures are made without pyplot: nothing here opens a window or needs a
display, and a caller's own plots stay as they are.
"""

from graspforce.errors import MissingExtraError

try:
    import matplotlib as mpl  # noqa: F401 - only to say at once what is missing
except ModuleNotFoundError as error:
    raise MissingExtraError("plot", error) from error

from .figures import grasp_figure, history_figure, polytope_figure, quality_figure, trajectory_figure
from .hand import draw_hand, hand_figure
from .planar import draw_planar_grasp
from .polytopes import draw_wrench_polytopes
from .scene import draw_mesh, frame_view
from .spatial import draw_spatial_grasp
from .statistics import draw_latencies, draw_plan_history
from .trajectories import draw_forces

__all__ = [
    "draw_forces",
    "draw_hand",
    "draw_latencies",
    "draw_mesh",
    "draw_plan_history",
    "draw_planar_grasp",
    "draw_spatial_grasp",
    "draw_wrench_polytopes",
    "frame_view",
    "grasp_figure",
    "hand_figure",
    "history_figure",
    "polytope_figure",
    "quality_figure",
    "trajectory_figure",
]
