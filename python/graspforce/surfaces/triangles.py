"""Vertices and faces of OBJ, OFF and STL files, in one pass and in the order of the file.

A general reader of these formats keeps materials, groups and solids apart, in time that grows with the square
of their number. A surface to put contacts on needs none of them.
"""

from __future__ import annotations

import array
import re
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from graspforce.errors import InvalidFileError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Triangles = tuple[NDArray[np.float64], NDArray[np.int64]]

_OFF = re.compile(rb"\s*(ST)?C?N?OFF(?=[\s\d]|$)")
_STL_HEADER = 84
_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def checked_faces(path: Path, faces: NDArray[np.int64], num_vertices: int) -> NDArray[np.int64]:
    """Refuse faces (F, 3) that name vertices which are not there; NumPy would count -1 from the end."""
    wrong = (faces < 0) | (faces >= num_vertices)
    if wrong.any():
        row, corner = np.argwhere(wrong)[0]
        raise InvalidFileError(
            path, f"triangle {row}: vertex {faces[row, corner]}, but there are {num_vertices}, counted from 0"
        )
    return faces


def _obj(path: Path, content: bytes) -> Triangles:
    vertices, faces = array.array("d"), array.array("q")
    for number, line in enumerate(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines(), 1):
        if line[:2] in (b"v ", b"v\t"):
            vertices.extend(_coordinates(path, number, line.split()[1:4]))
        elif line[:2] in (b"f ", b"f\t"):
            corners = [_whole(path, number, word.partition(b"/")[0]) for word in line.split()[1:]]
            if min(corners, default=1) < 1:
                message = (
                    f"face {min(corners)}: vertices are counted from 1; indices from the end are not read"
                )
                raise InvalidFileError(path, message, number)
            _fan(faces, [corner - 1 for corner in corners])
    return _arrays(vertices, faces)


def _off(path: Path, content: bytes) -> Triangles:
    head = _OFF.match(content.lstrip(b"\xef\xbb\xbf"))
    if head is None:
        raise InvalidFileError(path, "not a mesh: an OFF file begins with OFF", 1)
    lines = content.lstrip(b"\xef\xbb\xbf")[head.end() :].splitlines()
    rows = ((number, line.partition(b"#")[0].split()) for number, line in enumerate(lines, 1))
    left = [row for row in rows if row[1]]
    number, counts = left.pop(0) if left else (1, [])
    num_vertices, num_faces = (_whole(path, number, word) for word in (*counts[:2], b"", b"")[:2])
    if min(num_vertices, num_faces) < 0 or num_vertices + num_faces != len(left):
        message = f"claims {num_vertices} vertices and {num_faces} faces, but {len(left)} lines follow"
        raise InvalidFileError(path, message, number)
    vertices, faces = array.array("d"), array.array("q")
    for number, words in left[:num_vertices]:
        vertices.extend(_coordinates(path, number, words[:3]))
    for number, words in left[num_vertices:]:
        size = _whole(path, number, words[0])
        if not 1 <= size < len(words):
            message = f"a face of {size} corners, but {len(words) - 1} numbers follow"
            raise InvalidFileError(path, message, number)
        _fan(faces, [_whole(path, number, word) for word in words[1 : size + 1]])
    return _arrays(vertices, faces)


def _stl(path: Path, content: bytes) -> Triangles:
    claimed = int.from_bytes(content[_STL_HEADER - 4 : _STL_HEADER], "little")
    held = len(content) - _STL_HEADER
    if held == claimed * _STL_TRIANGLE.itemsize:
        corners = np.frombuffer(content, _STL_TRIANGLE, offset=_STL_HEADER)["corners"].astype(np.float64)
        return corners.reshape(-1, 3), np.arange(3 * claimed).reshape(-1, 3)
    if content.lstrip()[:5].lower() != b"solid":
        message = f"not a mesh: claims {claimed} triangles, but {max(0, held)} bytes follow, 50 for each"
        if held < 0:
            message = f"not a mesh: neither 'solid' nor the header of {_STL_HEADER} bytes stands in it"
        raise InvalidFileError(path, message)
    vertices, num_facets = array.array("d"), 0
    for number, line in enumerate(content.splitlines(), 1):
        words = line.split()
        key = words[0].lower() if words else b""
        num_facets += key == b"facet"
        if key == b"vertex":
            vertices.extend(_coordinates(path, number, words[1:4]))
    if len(vertices) != 9 * num_facets:
        raise InvalidFileError(
            path, f"{len(vertices) // 3} vertices in {num_facets} facets, expected three in each"
        )
    return _arrays(vertices, array.array("q", range(3 * num_facets)))


READERS = {"obj": _obj, "off": _off, "stl": _stl}
"""By the suffix: content to vertices (V, 3) and faces (F, 3), which may name vertices that are not there."""


def _coordinates(path: Path, line: int, words: list[bytes]) -> list[float]:
    try:
        numbers = [float(_plain(word)) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(abs(number) < np.inf for number in numbers):
        given = b" ".join(words)[:60].decode("ascii", "replace")
        raise InvalidFileError(path, f"not a mesh: {given!r} are not three finite coordinates", line)
    return numbers


def _whole(path: Path, line: int, word: bytes) -> int:
    try:
        number = int(_plain(word))
    except ValueError:
        number = 2**63
    if not -(2**63) <= number < 2**63:
        given = word[:60].decode("ascii", "replace")
        raise InvalidFileError(path, f"not a mesh: {given!r} is not a whole number", line)
    return number


def _plain(word: bytes) -> bytes:
    """Refuse what only Python calls a number: 1_000."""
    if b"_" in word:
        raise ValueError
    return word


def _fan(faces: array.array[int], corners: list[int]) -> None:
    """Add a polygon as triangles around its first corner."""
    for second, third in pairwise(corners[1:]):
        faces.extend((corners[0], second, third))


def _arrays(vertices: array.array[float], faces: array.array[int]) -> Triangles:
    return np.array(vertices).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)
