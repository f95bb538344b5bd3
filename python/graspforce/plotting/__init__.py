"""Figures of grasps, wrench sets, forces and searches.

Needs matplotlib (the ``plot`` extra). Functions ``draw_...`` take axes and return the artists that they drew.
Functions ``..._figure`` make a whole figure. They do not use pyplot: no window opens, no display is needed,
and the caller's own plots do not change.

- `figures`: whole figures; `panels`: one grasp with numbers, a wrench and a legend.
- `planar`, `spatial`: grasps; `polytopes`: wrench sets; `trajectories`: forces over time; `statistics`:
  searches and latencies.
- `scene`: meshes, and drawings that fill their axes; `views`: what is seen from where; `arrows`, `hull`,
  `style`.
"""

from graspforce.errors import MissingExtraError

try:
    import matplotlib as mpl  # noqa: F401 - only to say at once what is missing
except ModuleNotFoundError as error:
    raise MissingExtraError("plot", error) from error

from .figures import (
    grasp_figure,
    history_figure,
    polytope_figure,
    quality_figure,
    solution_figure,
    trajectory_figure,
)
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
    "solution_figure",
    "trajectory_figure",
]
