"""The paper's two examples: as printed, computed, reported and drawn.

Y. Zheng and W.-H. Qian, "Limiting and minimizing the contact forces in multifingered grasping", Mechanism and
Machine Theory 41 (2006) 1243-1257, section 5.

- `examples`: the printed inputs and results.
- `racket`; `tile` and `tile_forces`: the same, computed. `racket_report`, `tile_report`: as text;
  `racket_drawing`, `racket_outline`, `tile_drawing`, `tile_forces_drawing`: drawn.
- `reproduce`: prints an example; `completed`: refuses an interrupted search.
"""

from .examples import (
    RACKET,
    RACKET_WRENCH,
    TABLE_1,
    TILE,
    TILE_FORCE_MILLISECONDS,
    TILE_WRENCHES,
    PlanningProblem,
    PublishedForces,
    tile_side,
)

__all__ = [
    "RACKET",
    "RACKET_WRENCH",
    "TABLE_1",
    "TILE",
    "TILE_FORCE_MILLISECONDS",
    "TILE_WRENCHES",
    "PlanningProblem",
    "PublishedForces",
    "tile_side",
]
