"""Grasps from simulators and robot models, read-only: nothing here changes a model or its state.

Each needs its own extra (``mujoco``, ``drake``, ``pinocchio``) and imports it when called. Their result is a
`contact_reading`, or a grasp.
"""

from .contact_reading import ContactReading
from .drake import from_drake
from .mujoco import from_mujoco
from .pinocchio import from_pinocchio

__all__ = ["ContactReading", "from_drake", "from_mujoco", "from_pinocchio"]
