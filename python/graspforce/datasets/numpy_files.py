"""NumPy files of other programs, read without running code from them.

Many datasets of grasps are ``.npy`` files that hold one pickled dictionary. Unpickling can run any code. Here
a pickle may only make arrays, numbers, texts and Python's own containers. It calls no function of NumPy: it
fills placeholders, which become arrays after its end and after checks.
"""

from __future__ import annotations

import pickle
import re
import zipfile
from collections import OrderedDict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce.errors import InvalidFileError

if TYPE_CHECKING:
    import os
    from collections.abc import Callable
    from typing import IO

__all__ = ["load_numpy"]

_PLAIN = re.compile(r"[<>|=]?[?bBhHiIlLqQefdgFDGSUaOuc]\d*")


def load_numpy(path: str | os.PathLike[str]) -> Any:
    """Return what a ``.npy`` or ``.npz`` file holds, without running code from it.

    Unlike ``numpy.load(path, allow_pickle=True)`` it can open files of strangers. Pickled parts may hold
    arrays, dtypes and scalars of NumPy, numbers, texts, and containers: dict, list, tuple, set. All else is
    refused. Safe to call from several threads.

    Parameters
    ----------
    path : path
        The file. Its content decides whether it is ``.npy`` or ``.npz``.

    Returns
    -------
    object
        The array. Of a 0-d array of objects its one object, usually a dict. Of an ``.npz`` file a dict of
        all its entries.

    Raises
    ------
    InvalidFileError
        The file holds an object of another kind, which the message names, or it is damaged.
    OSError
        The file cannot be read.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.datasets import load_numpy
    >>> np.save("grasp.npy", {"positions": np.zeros((3, 3)), "hand": "allegro"}, allow_pickle=True)
    >>> load_numpy("grasp.npy")["positions"].shape
    (3, 3)
    """
    path = Path(path)
    with path.open("rb") as file:
        try:
            if not zipfile.is_zipfile(file):
                file.seek(0)
                return _array(file)
            return _entries(file)
        except _Refused as error:
            raise InvalidFileError(path, str(error)) from None
        except Exception as error:  # zipfile, zlib, tokenize and pickle raise errors of many kinds
            raise InvalidFileError(path, f"no NumPy file, or a damaged one: {error}") from error


def _entries(file: IO[bytes]) -> dict[str, Any]:
    """Return all entries of an open ``.npz`` file."""
    entries = {}
    with zipfile.ZipFile(file) as archive:
        for name in archive.namelist():
            with archive.open(name) as entry:
                entries[name.removesuffix(".npy")] = _array(entry)
    return entries


class _Refused(pickle.UnpicklingError):
    """A pickle asks for what it may not have."""


def _array(file: IO[bytes]) -> Any:
    """Return the array of an open ``.npy`` file, or the object of a 0-d array."""
    form: Any = np.lib.format
    first = form.read_magic(file)[0] == 1
    shape, _, dtype = (form.read_array_header_1_0 if first else form.read_array_header_2_0)(file)
    if not dtype.hasobject:
        file.seek(0)
        return form.read_array(file, allow_pickle=False)
    array = _resolved(_Unpickler(file).load(), {})
    if not isinstance(array, np.ndarray) or array.dtype != object or array.size != np.prod(shape, dtype=int):
        raise ValueError("the header does not describe the array")
    return array.reshape(shape) if shape else array.reshape(1)[0]


class _Unpickler(pickle._Unpickler):  # noqa: SLF001 - the public one is written in C
    """A pickle whose names lead to placeholders and containers only.

    The unpickler written in C takes memory for every memo index below the largest: a file of 100 bytes can
    ask for gigabytes. The one written in Python keeps its memo in a dict.
    """

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _CONTAINERS:
            return _CONTAINERS[module, name]
        # NumPy 1 called its private package `core`.
        found = module.replace("numpy.core.", "numpy._core."), name
        if found in _MAKERS:
            return _Maker(_MAKERS[found])
        if found == ("numpy", "ndarray"):
            return None  # what _reconstruct is given, and does not need
        raise _Refused(f"holds {module}.{name}, and only arrays, numbers, texts and containers are read")


_CONTAINERS = {
    ("builtins", "set"): set,
    ("builtins", "frozenset"): frozenset,
    ("builtins", "complex"): complex,
    ("collections", "OrderedDict"): OrderedDict,
}


class _Maker:
    """A function that a pickle can call but not change."""

    __slots__ = ("_call",)

    def __init__(self, call: Callable[..., Any]) -> None:
        self._call = call

    def __call__(self, *arguments: Any) -> Any:
        return self._call(*arguments)

    def __setstate__(self, state: Any) -> None:
        raise _Refused("changes a function")


class _Dtype:
    """A plain dtype: numbers, booleans, texts or objects. A pickle states its byte order afterwards."""

    __slots__ = ("value",)

    def __init__(self, code: Any) -> None:
        if not isinstance(code, str) or not _PLAIN.fullmatch(code):
            raise _Refused(f"holds an array of dtype {code!r}, and only numbers, texts and objects are read")
        self.value: np.dtype[Any] = np.dtype(code)

    def __setstate__(self, state: Any) -> None:
        if state[1] in ("<", ">"):
            self.value = self.value.newbyteorder(state[1])


class _Array:
    """An array or a scalar of NumPy that is still to be made."""

    __slots__ = ("_data", "_dtype", "_order", "_shape")
    _data: Any
    _dtype: Any
    _order: Any
    _shape: Any

    def __setstate__(self, state: Any) -> None:
        _, shape, dtype, fortran, data = state
        self.fill(data, dtype, tuple(map(int, shape)), "F" if fortran else "C")

    def fill(self, data: Any, dtype: _Dtype, shape: Any, order: str) -> _Array:
        self._data, self._dtype, self._shape, self._order = data, dtype.value, shape, order
        return self

    def resolved(self, memo: dict[int, Any]) -> Any:
        flat: Any
        if self._dtype.hasobject:
            flat = np.empty(len(self._data), dtype=object)
            for index, each in enumerate(self._data):
                flat[index] = _resolved(each, memo)
        elif self._shape is None and not self._dtype.itemsize:
            return self._dtype.type()  # an empty text has no bytes
        else:
            flat = np.frombuffer(self._data, dtype=self._dtype)
        # Of its own, in the byte order of this machine.
        flat = flat.astype(self._dtype.newbyteorder("="))
        return flat.reshape(1)[0] if self._shape is None else flat.reshape(self._shape, order=self._order)


_MAKERS: dict[tuple[str, str], Callable[..., Any]] = {
    ("numpy._core.multiarray", "_reconstruct"): lambda *_: _Array(),
    ("numpy._core.multiarray", "scalar"): lambda dtype, data: _Array().fill(data, dtype, None, "C"),
    ("numpy._core.numeric", "_frombuffer"): lambda *state: _Array().fill(*state),
    ("numpy", "dtype"): lambda code, *_: _Dtype(code),
}


def _resolved(value: Any, memo: dict[int, Any]) -> Any:
    """Return a value in which all placeholders are arrays; what was shared stays shared.

    Raises
    ------
    ValueError
        A container holds itself.
    """
    if not isinstance(value, (dict, list, tuple, set, frozenset, _Array, _Dtype, _Maker)):
        return value
    key = id(value)
    if key in memo:
        if memo[key] is None:
            raise ValueError("a container holds itself")
        return memo[key]
    memo[key] = None
    made: Any
    if isinstance(value, _Array):
        made = value.resolved(memo)
    elif isinstance(value, dict):
        made = {_resolved(name, memo): _resolved(each, memo) for name, each in value.items()}
    elif isinstance(value, _Dtype):
        made = value.value
    elif isinstance(value, _Maker):
        raise _Refused("holds a function")
    else:
        made = type(value)(_resolved(each, memo) for each in value)
    memo[key] = made
    return made
