"""A viewer of spatial grasps in the browser: mesh, contacts, cones, forces over time, the worst wrench.

Needs viser (the ``viewer`` extra). Sliders change friction and limits. Contacts can be dragged. The page
shows the quality of the changed grasp.

- `scene`: the page; `state`: the grasp that it shows; `guard`: token and limits of connections; `messages`:
  what clients may send.
"""

from .scene import Viewer, view
from .state import ViewState

__all__ = ["ViewState", "Viewer", "view"]
