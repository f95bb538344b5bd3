"""The errors of the library: one root, one class for each thing that can go wrong.

The extension module raises these classes too, so ``except gf.GraspForceError`` catches everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "BusyError",
    "GraspForceError",
    "InfeasibleWrenchError",
    "InvalidGraspError",
    "InvalidInputError",
    "NotConvergedError",
    "TooLargeError",
]


class GraspForceError(Exception):
    """The root of every error this library raises on purpose."""


class InvalidGraspError(GraspForceError, ValueError):
    """A grasp cannot be built from these contacts; the message names argument, contact and value."""


class InvalidInputError(GraspForceError, ValueError):
    """An argument of a query is unusable; the message names argument, row and value."""


class InfeasibleWrenchError(GraspForceError):
    """No contact forces inside the friction cones balance the external wrench, however strong they are.

    Attributes
    ----------
    direction : numpy.ndarray
        (d,) unit vector e that separates: ``w_ih . e <= 0`` for every primitive wrench, and
        ``-w_ext . e > 0``. With ``min_normal`` c the second reads ``-w_ext . e > sum_i c_i max_h w_ih . e``.
    """

    direction: NDArray[np.float64]


class TooLargeError(GraspForceError):
    """An explicit enumeration would pass the limit; the message says how many points and bytes."""


class BusyError(GraspForceError):
    """A solver is in use by another thread; give each thread one of its own."""


class NotConvergedError(GraspForceError):
    """A bounded iteration ended without an answer that meets the tolerance."""
