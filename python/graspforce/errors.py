"""The errors of the library: one root, and one class for each kind of failure.

The extension module raises these classes too, so ``except gf.GraspForceError`` catches everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspforce._internal.printable import printable

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from .typing import SearchResult

__all__ = [
    "BusyError",
    "GraspForceError",
    "GraspWarning",
    "InfeasibleWrenchError",
    "InvalidFileError",
    "InvalidGraspError",
    "InvalidInputError",
    "MissingExtraError",
    "NoContactError",
    "NoGraspError",
    "NotConvergedError",
    "ResumeError",
    "TooLargeError",
]


class GraspForceError(Exception):
    """The root of every error this library raises on purpose.

    Attributes
    ----------
    partial : Plan, Refinement, GlobalOptimum or None
        Best result of a search before the error ended it; None if there is none.
    """

    partial: SearchResult | None = None

    def __str__(self) -> str:
        # A message quotes names from files, and is printed.
        return printable(super().__str__(), keep="\n\t")


class GraspWarning(UserWarning):
    """Contacts are valid but look wrong: all normals point outward, or a contact is in another unit."""


class InvalidGraspError(GraspForceError, ValueError):
    """A grasp cannot be built from these contacts; the message names argument, contact and value.

    Attributes
    ----------
    row : int or None
        Row of the grasp among several; None for a single grasp.
    """

    row: int | None = None


class InvalidInputError(GraspForceError, ValueError):
    """An argument is wrong; the message names argument, row and value."""


class InvalidFileError(InvalidInputError):
    """An input file is wrong; the message names file, line and field.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    line : int or None
        Line of the mistake, counted from 1; None for a file without lines.
    field : tuple of str and int
        Names and indices, from 0, that lead to the field; empty if it is about no field.
    """

    def __init__(self, path: Path, message: str, line: int | None = None) -> None:
        super().__init__(f"{path}:{line}: {message}" if line else f"{path}: {message}")
        self.path, self.line = path, line
        self.field: tuple[str | int, ...] = ()
        self._given = path, message, line

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._given, {"field": self.field}


class MissingExtraError(GraspForceError, ImportError):
    """An optional package is not installed; the message says how to install it.

    Parameters
    ----------
    extra : str
        Extra of graspforce that installs the package.
    error : ImportError
        Error of the import.
    """

    def __init__(self, extra: str, error: ImportError) -> None:
        package = (error.name or str(error)).partition(".")[0]
        install = f"pip install 'graspforce[{extra}]', or in a clone pip install '.[{extra}]'"
        super().__init__(f"{package} is not installed: {install}", name=error.name)
        self._given = extra, error

    def __reduce__(self) -> tuple[type[MissingExtraError], tuple[str, ImportError]]:
        return type(self), self._given


class InfeasibleWrenchError(GraspForceError):
    """No contact forces inside the friction cones balance the external wrench, whatever the force limits.

    Attributes
    ----------
    direction : numpy.ndarray
        (d,) unit vector e that proves it: ``w_ih . e <= 0`` for every primitive wrench, and
        ``-w_ext . e > 0`` by more than the feasibility tolerance. With ``min_normal`` c the second inequality
        is ``-w_ext . e > sum_i c_i max_h w_ih . e``. Of the plan of a hand: no forces within friction and
        torque limits exert as much along e as ``-w_ext . e``.
    """

    direction: NDArray[np.float64]


class TooLargeError(MemoryError, GraspForceError):  # MemoryError, whose constructor is its own, comes first
    """A result would exceed the limit of an enumeration, or memory; also a `MemoryError`.

    The message gives the size.
    """


class BusyError(GraspForceError):
    """Another thread uses the distributor, or another run the folder; give each its own."""


class NoContactError(GraspForceError):
    """Nothing touches the body in the simulation, so that it has no grasp."""


class NoGraspError(GraspForceError):
    """No pose of a hand grasps the object or touches the contacts; the message says why.

    Attributes
    ----------
    nearest : HandPose or None
        Of `Hand.reach`: the pose that comes nearest to the contacts.
    """

    nearest: Any = None


class NotConvergedError(GraspForceError):
    """An iteration reached its limit without an answer that passes its checks.

    The message names the check, the error and what to try.
    """


class ResumeError(GraspForceError):
    """A folder of results belongs to other options or another source; the message says what differs."""
