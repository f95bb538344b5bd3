"""The errors of the library: one root, one class for each thing that can go wrong.

The extension module raises these classes too, so ``except gf.GraspForceError`` catches everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    "NotConvergedError",
    "ResumeError",
    "TooLargeError",
]


class GraspForceError(Exception):
    """The root of every error this library raises on purpose.

    Attributes
    ----------
    partial : Plan, Refinement, GlobalOptimum or None
        What a search had found before the error ended it; None elsewhere.
    """

    partial: SearchResult | None = None

    def __str__(self) -> str:
        # A message quotes names from files, and is printed.
        return printable(super().__str__(), keep="\n\t")


class GraspWarning(UserWarning):
    """Contacts are possible but look wrong: all normals point outward, or a contact is in another unit."""


class InvalidGraspError(GraspForceError, ValueError):
    """A grasp cannot be built from these contacts; the message names argument, contact and value.

    Attributes
    ----------
    row : int or None
        Which of several grasps it is, where there were several.
    """

    row: int | None = None


class InvalidInputError(GraspForceError, ValueError):
    """An argument of a query is unusable; the message names argument, row and value."""


class InvalidFileError(InvalidInputError):
    """An input file is unusable; the message names file, line and field.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    line : int or None
        The line to look at, counted from 1, where the file has lines.
    """

    def __init__(self, path: Path, message: str, line: int | None = None) -> None:
        super().__init__(f"{path}:{line}: {message}" if line else f"{path}: {message}")
        self.path, self.line = path, line
        self._given = path, message, line

    def __reduce__(self) -> tuple[type[InvalidFileError], tuple[Path, str, int | None]]:
        return type(self), self._given


class MissingExtraError(GraspForceError, ImportError):
    """An optional package is needed and not installed; the message says what to install.

    Parameters
    ----------
    extra : str
        The extra that brings it.
    error : ImportError
        Says which package it is.
    """

    def __init__(self, extra: str, error: ImportError) -> None:
        package = (error.name or str(error)).partition(".")[0]
        super().__init__(f"{package} is not installed: pip install 'graspforce[{extra}]'", name=error.name)
        self._given = extra, error

    def __reduce__(self) -> tuple[type[MissingExtraError], tuple[str, ImportError]]:
        return type(self), self._given


class InfeasibleWrenchError(GraspForceError):
    """No contact forces inside the friction cones balance the external wrench, however strong they are.

    Attributes
    ----------
    direction : numpy.ndarray
        (d,) unit vector e that separates: ``w_ih . e <= 0`` for every primitive wrench, and
        ``-w_ext . e > 0`` by more than the feasibility tolerance. With ``min_normal`` c the second reads
        ``-w_ext . e > sum_i c_i max_h w_ih . e``.
    """

    direction: NDArray[np.float64]


class TooLargeError(GraspForceError, MemoryError):
    """A result would not fit into the limit of an enumeration, or into memory.

    The message says how large it would be. It is a `MemoryError`, too.
    """


class BusyError(GraspForceError):
    """A distributor is in use by another thread, or a folder by another run; give each one of its own."""


class NoContactError(GraspForceError):
    """Nothing touches the body that a simulation was asked about: there is no grasp to read."""


class NotConvergedError(GraspForceError):
    """A bounded iteration ended without an answer that passes its checks.

    The message says which check failed, by how much, and what to try.
    """


class ResumeError(GraspForceError):
    """A folder of results belongs to another question or another source; the message says what differs."""
