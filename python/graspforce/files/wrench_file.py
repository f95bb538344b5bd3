"""External wrenches from CSV and NPY files, and from the command line."""

from __future__ import annotations

import array
import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.checks import finite_array, whole_number
from graspforce._internal.safe_read import limited_bytes
from graspforce._internal.to_dict import ReadOnly
from graspforce.errors import InvalidFileError, InvalidInputError

from .grasp_file import MAX_ARRAY_BYTES

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from numpy.typing import NDArray

MAX_CSV_BYTES = 64 * 1024 * 1024
"""Hours of wrenches at control rate; in memory they take eight times as much."""

COLUMNS = {3: ("fx", "fy", "tau"), 6: ("fx", "fy", "fz", "tx", "ty", "tz")}
"""Names of the components of a wrench, by their number."""


@dataclass(frozen=True, slots=True, eq=False)
class WrenchFile(ReadOnly):
    """External wrenches over time.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    wrenches : numpy.ndarray
        (T, d) in N and N m.
    times : numpy.ndarray or None
        (T,) in s, where the file has a column ``t``.
    """

    wrenches: NDArray[np.float64]
    times: NDArray[np.float64] | None = None


def load_wrenches(path: str | os.PathLike[str], wrench_dim: int) -> WrenchFile:
    r"""Read external wrenches from a CSV or NPY file.

    Safe to call from several threads.

    Parameters
    ----------
    path : path-like
        ``.npy`` holds a (T, d) or (d,) array. Everything else is text: numbers separated by commas, one
        wrench a line, lines that start with ``#`` left out. The first may name the columns, ``fx,fy,tau`` or
        ``fx,fy,fz,tx,ty,tz``, with ``t`` before them for the time in s.
    wrench_dim : int
        3 or 6.

    Returns
    -------
    WrenchFile
        The wrenches.

    Raises
    ------
    InvalidFileError
        The file cannot be read, is too large, or does not hold finite wrenches; the message names the line.
    InvalidInputError
        `wrench_dim` is neither 3 nor 6.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from graspforce.files import load_wrenches
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "lift.csv")
    ...     _ = path.write_text("t,fx,fy,tau\n0,0,-1,0\n0.5,0,-2,0\n")
    ...     lift = load_wrenches(path, 3)
    >>> lift.wrenches.tolist(), lift.times.tolist()
    ([[0.0, -1.0, 0.0], [0.0, -2.0, 0.0]], [0.0, 0.5])
    """
    path, columns = Path(path), _columns(wrench_dim)
    found = _from_npy(path) if path.suffix.lower() == ".npy" else _from_csv(path, columns)
    if found.wrenches.ndim != 2 or found.wrenches.shape[1] != wrench_dim or len(found.wrenches) == 0:
        raise InvalidFileError(path, f"shape {found.wrenches.shape}, expected (T, {wrench_dim})")
    return found


def parse_wrench(text: str, wrench_dim: int, argument: str = "text") -> NDArray[np.float64]:
    """Read one wrench from numbers separated by commas or spaces.

    Safe to call from several threads.

    Parameters
    ----------
    text : str
        The numbers, in N and N m.
    wrench_dim : int
        3 or 6.
    argument : str
        Name of the text in error messages.

    Raises
    ------
    InvalidInputError
        The text does not hold this many finite numbers, or `wrench_dim` is neither 3 nor 6.
    """
    return numbers_of(argument, text, _columns(wrench_dim))


def numbers_of(argument: str, text: str, names: tuple[str, ...]) -> NDArray[np.float64]:
    """Read finite numbers, separated by commas or spaces, one for each name."""
    if not isinstance(text, str):
        raise InvalidInputError(f"{argument}: {text!r} is not text")
    cells = text.replace(",", " ").split()
    if len(cells) != len(names):
        raise InvalidInputError(f"{argument}: {text!r} is not {len(names)} numbers {','.join(names)}")
    numbers = np.array([_number(cell) for cell in cells])
    if not np.isfinite(numbers).all():
        at = int(np.argmin(np.isfinite(numbers)))
        raise InvalidInputError(f"{argument}: {names[at]}: {cells[at]!r} is not a finite number")
    return numbers


def _number(cell: str) -> float:
    """Read a number; NaN where there is none."""
    # Python reads 1_000 and the digits of every script; a file of numbers holds neither.
    try:
        return float(cell if cell.isascii() and "_" not in cell else "nan")
    except ValueError:
        return np.nan


def _columns(wrench_dim: int) -> tuple[str, ...]:
    columns = COLUMNS.get(whole_number("wrench_dim", wrench_dim, least=3))
    if columns is None:
        raise InvalidInputError(f"wrench_dim: {wrench_dim} is neither 3 nor 6")
    return columns


def _from_npy(path: Path) -> WrenchFile:
    size = len(limited_bytes(path, MAX_ARRAY_BYTES))
    try:
        # Mapped, so that a header which claims more than the file holds allocates nothing.
        mapped = np.load(path, mmap_mode="r", allow_pickle=False)
        wrenches = finite_array("wrenches", mapped)
    except Exception as error:  # noqa: BLE001 - NumPy's reader of headers raises whatever a tokenizer does
        raise InvalidFileError(path, f"not an array of numbers: {error}") from None
    if mapped.offset + mapped.nbytes < size:
        raise InvalidFileError(path, f"holds more numbers than its shape {mapped.shape} claims")
    return WrenchFile(np.atleast_2d(wrenches))


def _from_csv(path: Path, columns: tuple[str, ...]) -> WrenchFile:
    content = io.BytesIO(limited_bytes(path, MAX_CSV_BYTES))
    # Flat: a Python list of numbers takes many times the file's size.
    rows = array.array("d")
    timed = False
    place = _Place()
    stream = io.TextIOWrapper(content, encoding="utf-8-sig", newline="")
    reader = csv.reader(_without_comments(stream, place))
    begun = 0
    try:
        for cells in reader:
            if reader.line_num > begun + 1:
                # The lines up to the next quote would be one cell.
                raise InvalidFileError(path, "not CSV: a quote that is not closed on its line", place.first)
            begun, place.first = reader.line_num, 0
            names = tuple(cell.strip() for cell in cells)
            if not any(names) or names[0].startswith("#"):
                continue
            if not rows and names in (columns, ("t", *columns)):
                timed = names[0] == "t"
                continue
            if not rows and all(np.isnan(_number(name)) and name.lower() != "nan" for name in names):
                expected = ",".join(columns)
                message = f"columns {','.join(names)}, expected {expected} or t,{expected}"
                raise InvalidFileError(path, message, place.line)
            rows.extend(_numbers(path, place.line, names, timed, columns))
    except UnicodeDecodeError as error:
        raise InvalidFileError(path, f"not UTF-8 text: {error.reason}", place.line + 1) from None
    except csv.Error as error:
        raise InvalidFileError(path, f"not CSV: {error}", place.line) from None
    if not rows:
        raise InvalidFileError(path, "no wrenches")
    table = np.array(rows).reshape(-1, len(columns) + timed)
    return WrenchFile(table[:, 1:], table[:, 0]) if timed else WrenchFile(table)


@dataclass(slots=True)
class _Place:
    """The line of a table that was read last, and the first one of its row."""

    line: int = 0
    first: int = 0


def _without_comments(stream: io.TextIOWrapper, place: _Place) -> Iterator[str]:
    """Yield lines but those of comments, in which a quote means nothing."""
    for place.line, line in enumerate(stream, 1):
        if not line.lstrip().startswith("#"):
            place.first = place.first or place.line
            yield line


def _numbers(
    path: Path,
    line: int,
    cells: tuple[str, ...],
    timed: bool,
    columns: tuple[str, ...],
) -> list[float]:
    expected = (["t"] if timed else []) + list(columns)
    if len(cells) != len(expected):
        message = f"{len(cells)} columns, expected {len(expected)}: {','.join(expected)}"
        raise InvalidFileError(path, message, line)
    numbers = []
    for name, cell in zip(expected, cells, strict=True):
        number = _number(cell)
        if not np.isfinite(number):
            raise InvalidFileError(path, f"{name}: {cell!r} is not a finite number", line)
        numbers.append(number)
    return numbers
