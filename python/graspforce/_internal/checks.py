"""Checks of arguments that Python code receives, with errors that name argument, row and value.

The extension module checks its own arguments.
"""

from __future__ import annotations

import inspect
import operator
import reprlib
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from numpy.typing import ArrayLike, NDArray


def chosen(argument: str, value: object, choices: tuple[str, ...]) -> None:
    """Refuse a word that is none of the choices."""
    if value not in choices:
        words = ", ".join(map(repr, choices[:-1]))
        either = f"neither {words} nor" if len(choices) == 2 else f"none of {words} and"
        raise InvalidInputError(f"{argument}: {value!r} is {either} {choices[-1]!r}")


def instance(argument: str, value: object, *kinds: type) -> None:
    """Refuse what is not an instance of one of the classes."""
    if not isinstance(value, kinds):
        names = " or ".join(f"{kind.__module__.partition('.')[0]}.{kind.__name__}" for kind in kinds)
        raise InvalidInputError(f"{argument}: {reprlib.repr(value)} is not a {names}")


def progress_function(value: object) -> None:
    """Refuse what cannot be called, before any work is done."""
    if value is not None and not callable(value):
        raise InvalidInputError(f"progress: {value!r} is not callable")


def known_options(
    options: Iterable[str], known: Collection[str], function: Callable[..., object] | None = None
) -> None:
    """Refuse unknown keywords. The error also lists the keywords of `function` itself."""
    for name in options:
        if name not in known:
            parameters = () if function is None else inspect.signature(function).parameters.values()
            own = [parameter.name for parameter in parameters if parameter.kind is parameter.KEYWORD_ONLY]
            raise InvalidInputError(f"{name}: no such option; there are {', '.join([*own, *known])}")


def whole_number(argument: str, value: Any, *, least: int, most: int | None = None) -> int:
    """Convert `value` to an int that is at least `least`, and at most `most`."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InvalidInputError(f"{argument}: {value!r} is not a whole number") from None
    if number < least:
        raise InvalidInputError(f"{argument}: {value!r} must be at least {least}")
    if most is not None and number > most:
        raise InvalidInputError(f"{argument}: {value!r} must be at most {most}")
    return number


def real_number(
    argument: str, value: Any, *, least: float = -np.inf, positive: bool = False, finite: bool = True
) -> float:
    """Convert `value` to a float within its range; infinity only where it has a meaning."""
    try:
        array = np.asarray(value)
    except Exception as error:  # whatever the object's own conversion raises
        raise InvalidInputError(f"{argument}: {error}") from error
    if array.ndim or array.dtype.kind not in "iuf":
        raise InvalidInputError(f"{argument}: {value!r} is not a real number")
    number = float(array)
    if np.isnan(number) or (finite and np.isinf(number)):
        raise InvalidInputError(f"{argument}: {number} is not {'finite' if finite else 'a number'}")
    if positive and number <= 0:
        raise InvalidInputError(f"{argument}: {number} must be positive")
    if number < least:
        raise InvalidInputError(f"{argument}: {number} must be at least {least:g}")
    return number


# A view that repeats itself may claim to be larger than memory.
_MAX_NUMBERS = 2**27

# Squares of parameters and of their differences must be representable.
_LARGEST = 1e140


def real_array(argument: str, value: ArrayLike) -> NDArray[np.float64]:
    """Convert `value` to a float64 array of its own, refusing what is not of real numbers."""
    try:
        given = np.asarray(value)
    except Exception as error:  # whatever the object's own conversion raises
        raise InvalidInputError(f"{argument}: {error}") from error
    if given.dtype.kind not in "iuf":
        raise InvalidInputError(f"{argument}: {reprlib.repr(value)} is not an array of real numbers")
    if np.ma.is_masked(value):
        raise InvalidInputError(f"{argument}: some of its entries are masked")
    if given.size > _MAX_NUMBERS:
        raise InvalidInputError(f"{argument}: {given.size} numbers, more than the {_MAX_NUMBERS} of one call")
    # Numbers beyond float64 become infinite, and are then refused by name.
    with np.errstate(over="ignore"):
        return given.astype(np.float64)


def finite_array(argument: str, value: ArrayLike) -> NDArray[np.float64]:
    """Convert `value` to a float64 array of its own, refusing what is not a finite real number."""
    array = real_array(argument, value)
    if not np.isfinite(array).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f", entry {at[0] if len(at) == 1 else at}" if at else ""
        raise InvalidInputError(f"{argument}{where}: {array[at]} is not finite")
    return array


def finite_vector(
    argument: str, value: ArrayLike, size: int | None = None, *, positive: bool = False
) -> NDArray[np.float64]:
    """Convert `value` to (size,) float64; a scalar stands for all entries where the size is known."""
    array = finite_array(argument, value)
    if size is not None and array.ndim == 0:
        array = np.full(size, array)
    if array.ndim != 1 or array.size == 0 or (size is not None and array.size != size):
        expected = f"({size},)" if size is not None else "(p,) with p >= 1"
        raise InvalidInputError(f"{argument}: shape {array.shape}, expected {expected}")
    if positive and (array <= 0).any():
        at = int(np.argmax(array <= 0))
        raise InvalidInputError(f"{argument}, entry {at}: {array[at]} must be positive")
    return array


def triangles(argument: str, mesh: Any) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Check vertices (V, 3) and triangles (F, 3) for pictures: of a pair, or of a mesh that has both."""
    try:
        given, corners = (mesh.vertices, mesh.faces) if hasattr(mesh, "faces") else mesh
    except (TypeError, ValueError):
        message = f"{argument}: {reprlib.repr(mesh)} is no mesh and no pair of vertices and faces"
        raise InvalidInputError(message) from None
    vertices, faces = finite_array(argument, given), np.asarray(corners)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InvalidInputError(f"{argument}: vertices of shape {vertices.shape}, expected (V, 3)")
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        message = f"{argument}: faces of {faces.dtype} and shape {faces.shape}, expected whole numbers (F, 3)"
        raise InvalidInputError(message)
    if faces.size and not (faces.min() >= 0 and faces.max() < len(vertices)):
        raise InvalidInputError(f"{argument}: faces name vertices that are none of {len(vertices)}")
    return vertices, faces.astype(np.int64)


def strength(friction: float | None, max_normal_force: float | None) -> None:
    """Refuse a friction coefficient or limit that no contact can have."""
    if friction is not None:
        real_number("friction", friction, least=0)
    if max_normal_force is not None:
        real_number("max_normal_force", max_normal_force, positive=True)


def bounds_array(bounds: ArrayLike) -> NDArray[np.float64]:
    """Convert bounds to (p, 2) finite numbers, whatever their order."""
    array = finite_array("bounds", bounds)
    if array.ndim != 2 or array.shape[1:] != (2,):
        raise InvalidInputError(f"bounds: shape {array.shape}, expected (p, 2)")
    return array


def search_bounds(
    bounds: ArrayLike, initial: NDArray[np.float64], argument: str = "initial"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Split (p, 2) bounds into lower and upper, which must be in order and hold the start."""
    array = bounds_array(bounds)
    if len(array) != initial.size:
        raise InvalidInputError(f"{argument}: {initial.size} parameters, but bounds has {len(array)} rows")
    if beyond := np.argwhere(np.abs(array) > _LARGEST).tolist():
        row, side = beyond[0]
        raise InvalidInputError(
            f"bounds, row {row}: {array[row, side]} must be within -1e140 to 1e140; check the units"
        )
    lower, upper = array[:, 0].copy(), array[:, 1].copy()
    for row, (low, high, start) in enumerate(zip(lower, upper, initial, strict=True)):
        if low > high:
            raise InvalidInputError(f"bounds, row {row}: lower {low} is above upper {high}")
        if not low <= start <= high:
            raise InvalidInputError(f"{argument}, entry {row}: {start} is outside its bounds [{low}, {high}]")
    return lower, upper


def checked_contacts(returned: object, params: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Check what a surface returned for (B, p) parameters and name its arrays."""
    if not isinstance(returned, tuple) or len(returned) not in (2, 3):
        what = f"tuple of {len(returned)}" if isinstance(returned, tuple) else type(returned).__name__
        raise InvalidInputError(
            f"surface: returned {what}, expected (positions, normals) or (positions, normals, tangents)"
        )
    contacts: dict[str, NDArray[np.float64]] = {}
    for name, value in zip(("positions", "normals", "tangents"), returned, strict=False):
        contacts[name] = _contact_array(name, value, params)
        if contacts[name].shape != contacts["positions"].shape:
            expected = contacts["positions"].shape
            raise InvalidInputError(f"surface: {name} of shape {contacts[name].shape}, expected {expected}")
    return contacts


def _contact_array(name: str, value: ArrayLike, params: NDArray[np.float64]) -> NDArray[np.float64]:
    array = real_array(f"surface: {name}", value)
    rows = len(params)
    if array.ndim != 3 or len(array) != rows or array.shape[1] < 1 or array.shape[2] not in (2, 3):
        expected = f"({rows}, m, 2) or ({rows}, m, 3) with m at least 1"
        raise InvalidInputError(f"surface: {name} of shape {array.shape}, expected {expected}")
    if not np.isfinite(array).all():
        row, contact, _ = (int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInputError(
            f"surface, row {row}: {name} of contact {contact} at parameters {params[row].tolist()} "
            f"are not finite: {array[row, contact].tolist()}"
        )
    return array
