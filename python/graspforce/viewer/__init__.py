"""A viewer of spatial grasps in the browser: mesh, contacts, cones, forces over time, the worst wrench.

Needs viser (the ``viewer`` extra). Sliders change friction and limits. Contacts can be dragged. The page
shows the quality of the changed grasp. Plans of hands are shown with their hand.

- `scene`: the page; `state`: the grasp that it shows; `controls`: sliders and buttons; `drawing`: cones and
  forces; `panel`: numbers, table and legend; `hand`: the hand of a plan; `share`: the page as one file.
- `guard`: token and limits of connections; `messages`: what clients may send; `ports`: a free port.
"""

from .scene import Viewer, view
from .state import ViewState

__all__ = ["ViewState", "Viewer", "view"]
