"""Rows of a dataset as batches of grasps with equally many contacts.

This module checks the shapes of rows. The core checks their values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .arrow_lists import Numbers, Ragged, first_within, numbers, ragged
from .schema import is_list

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import pyarrow as pa
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Indices = NDArray[np.int64]
    Mask = NDArray[np.bool_]

_VECTORS = ("positions", "normals", "tangents")
_NUMBERS = ("friction", "max_normal_force", "torsion")


class Faults:
    """The first fault of each row, in words."""

    def __init__(self, rows: int) -> None:
        self.bad: Mask = np.zeros(rows, bool)
        self.messages: dict[int, str] = {}

    def add(self, wrong: Mask, message: Callable[[int], str]) -> None:
        """Add a message to the wrong rows that have none yet."""
        for row in np.flatnonzero(wrong & ~self.bad).tolist():
            self.messages[row] = message(row)
        self.bad |= wrong

    def compare(self, message: str, found: Indices, expected: Indices) -> None:
        """Refuse the rows where two counts differ; the message has a placeholder for each count."""
        self.add(found != expected, lambda row: message.format(found[row], expected[row]))


@dataclass(frozen=True, slots=True)
class _Vectors:
    """A column of one vector for each contact. All vectors of a row have equally many coordinates."""

    contacts: Ragged
    coordinates: Ragged
    values: Numbers
    dims: Indices

    @classmethod
    def read(cls, name: str, column: pa.Array, faults: Faults) -> _Vectors:
        contacts = ragged(column)
        coordinates = ragged(contacts.values)
        values = numbers(coordinates.values)
        starts, ends = contacts.starts, contacts.ends
        faults.add(contacts.null, lambda _: f"{name}: null")
        null = first_within(starts, ends, coordinates.null)
        faults.add(null >= 0, lambda row: f"{name}, contact {null[row]}: null")
        lengths = coordinates.lengths
        # The first contact of empty last rows would lie past the end.
        dims = np.append(lengths, 0)[np.minimum(starts, len(lengths))]

        def size(row: int, contact: int) -> str:
            return f"{name}, contact {contact}: {lengths[starts[row] + contact]} coordinates"

        odd = first_within(starts, ends, (lengths != 2) & (lengths != 3))
        faults.add(odd >= 0, lambda row: f"{size(row, odd[row])}, expected 2 or 3")
        changed = np.append(False, lengths[1:] != lengths[:-1])
        other = first_within(starts + 1, ends, changed) + 1
        faults.add(other > 0, lambda row: f"{size(row, other[row])}, contact 0 has {dims[row]}")
        if values.null.any():
            holes = first_within(coordinates.starts, coordinates.ends, values.null) >= 0
            hole = first_within(starts, ends, holes)
            faults.add(hole >= 0, lambda row: f"{name}, contact {hole[row]}: a coordinate is null")
        return cls(contacts, coordinates, values, dims)

    def gather(self, rows: Indices, count: int, dim: int) -> Array:
        contacts = self.contacts.starts[rows, None] + np.arange(count)
        return self.values.at(self.coordinates.starts[contacts][..., None] + np.arange(dim))


@dataclass(frozen=True, slots=True)
class _PerContact:
    """A column of one number for each contact, or one for all contacts of a row."""

    lists: Ragged | None
    values: Numbers

    @classmethod
    def read(cls, name: str, column: pa.Array, counts: Indices, faults: Faults) -> _PerContact:
        if not is_list(column.type):
            values = numbers(column)
            faults.add(values.null, lambda _: f"{name}: null")
            return cls(None, values)
        lists = ragged(column)
        values = numbers(lists.values)
        faults.add(lists.null, lambda _: f"{name}: null")
        faults.compare(f"{name}: {{}} numbers for {{}} contacts", lists.lengths, counts)
        null = first_within(lists.starts, lists.ends, values.null)
        faults.add(null >= 0, lambda row: f"{name}, contact {null[row]}: null")
        return cls(lists, values)

    def gather(self, rows: Indices, count: int) -> Array:
        if self.lists is None:
            return np.repeat(self.values.at(rows[:, None]), count, axis=1)
        return self.values.at(self.lists.starts[rows, None] + np.arange(count))


class Rows:
    """The grasps of a record batch whose schema has been checked.

    Attributes
    ----------
    faults : Faults
        Rows that the core cannot take, with the reasons.
    """

    def __init__(self, batch: pa.RecordBatch) -> None:
        self.faults = faults = Faults(batch.num_rows)
        given = set(batch.schema.names)
        self._vectors = {
            name: _Vectors.read(name, batch.column(name), faults) for name in _VECTORS if name in given
        }
        positions = self._vectors["positions"]
        self._counts, self._dims = counts, dims = positions.contacts.lengths, positions.dims
        faults.add(counts == 0, lambda _: "positions: a grasp needs at least one contact")
        for name, vectors in self._vectors.items():
            faults.compare(f"{name}: {{}} contacts, positions has {{}}", vectors.contacts.lengths, counts)
            faults.compare(f"{name}: {{}} coordinates, positions has {{}}", vectors.dims, dims)
        if "tangents" in given:
            faults.add(dims == 2, lambda _: "tangents: a planar contact has only one tangent")
        self._per_contact = {
            name: _PerContact.read(name, batch.column(name), counts, faults)
            for name in _NUMBERS
            if name in given
        }
        self._origins = self._read_origins(batch.column("origin")) if "origin" in given else None
        self._scales: Array | None = None
        if "length_scale" in given:
            scales = numbers(batch.column("length_scale"))
            faults.add(scales.null, lambda _: "length_scale: null")
            self._scales = scales.values

    def _read_origins(self, column: pa.Array) -> tuple[Ragged, Array]:
        origins, dims = ragged(column), self._dims
        values = numbers(origins.values)
        self.faults.add(origins.null, lambda _: "origin: null")
        self.faults.compare("origin: {} coordinates, positions has {}", origins.lengths, dims)
        hole = first_within(origins.starts, origins.ends, values.null)
        self.faults.add(hole >= 0, lambda _: "origin: a coordinate is null")
        return origins, values.values

    def groups(self) -> Iterator[tuple[Indices, dict[str, Array]]]:
        """Yield groups of rows of equal shape, with their arguments for `quality_many`."""
        good = np.flatnonzero(~self.faults.bad)
        shapes = np.stack([self._counts[good], self._dims[good]], axis=1)
        for count, dim in np.unique(shapes, axis=0).tolist():
            rows = good[(shapes == (count, dim)).all(axis=1)]
            arguments = {name: v.gather(rows, count, dim) for name, v in self._vectors.items()}
            arguments |= {name: v.gather(rows, count) for name, v in self._per_contact.items()}
            if self._origins is not None:
                origins, values = self._origins
                arguments["origin"] = values[origins.starts[rows, None] + np.arange(dim)]
            if self._scales is not None:
                arguments["length_scale"] = self._scales[rows]
            yield rows, arguments
