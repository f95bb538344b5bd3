"""A viewer of spatial grasps in the browser: mesh, contacts, cones, forces over time, the worst wrench.

Needs viser (the ``viewer`` extra). Sliders change friction and limits, contacts can be dragged, the quality
follows.
"""

from .scene import Viewer, view
from .state import ViewState

__all__ = ["ViewState", "Viewer", "view"]
