"""Linear pieces of epsilon by the parameters of a surface: supports along its critical directions.

Supports along the most critical directions change with the contacts as `graspforce.quality_many` says, and
the contacts with the parameters as differences of the surface say. A difference that meets an edge, where a
normal turns at once, is taken on the side of the edge where the contact is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import quality_many
from graspforce.errors import InvalidGraspError

from .contact_moves import ContactArrays, ContactMoves
from .frame_spins import contact_frames
from .linear_pieces import LinearPieces

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graspforce.gradients import BundleBatch

    from .problem import SearchProblem
    from .scoring import Contacts

    Array = NDArray[np.float64]

DIFFERENCE = 1e-6  # of the parameters' range: the surface's derivatives by central differences
_COARSE = 2e-2  # of the range: the same across many faces of a mesh, whose normals hardly turn within one
_JUMP, _COARSE_JUMP = 1e-2, 0.3  # rad: a normal or a frame that turns so far has no derivative
_SPARE_PIECES = 4  # critical directions beyond the number of ways to move the contacts
_NOWHERE = 1e-9  # squares of derivatives below this part of the largest are rounding
_FLAT = 1e-6  # rad: a normal that turns less over the full range is that of a plane face
_DROP = 0.3  # a piece that falls by more than this share of the steepest slope is one beyond an edge


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Pieces at places, continued to parameters, the same across many faces, and how the contacts move."""

    pieces: LinearPieces
    coarse: LinearPieces
    here: Contacts
    """Contacts (1, m, dim) of the first place."""
    moves: Array
    """(p, m, dim) derivatives of their positions by unit parameters."""
    shares: Array
    """(p, p) projection of changes of the parameters onto those that move contacts."""
    flat: NDArray[np.bool_]
    """(m,) whether their normals stay as they are."""

    def moved(self, steps: Array) -> Array:
        """Return the shortest changes (n, p) of the parameters that move the contacts like these do.

        A point in space beside a mesh has one direction that leads its contact nowhere: into the object,
        where the contact jumps to another face.
        """
        return steps @ self.shares


class SupportPieces:
    """Linear pieces of epsilon in unit parameters: each runs from 0 to 1 over its bounds."""

    def __init__(self, problem: SearchProblem, lower: Array, upper: Array) -> None:
        self._source, self._quality_options = problem.source, problem.quality_options
        self._lower, self._upper, self._range = lower, upper, upper - lower
        # A parameter whose bounds are so close that rounding swallows the difference has nowhere to go.
        rounding = np.spacing(np.maximum(np.abs(lower), np.abs(upper)))
        self.free = np.flatnonzero(DIFFERENCE * self._range >= rounding)

    def at(self, places: Array, params: Array, epsilon: float) -> Surroundings:
        """Return pieces at places (n, p), continued to the parameters (p,), where epsilon is known."""
        free, steps = self.free, np.diag(self._range)[self.free]
        ends = [
            np.clip(places[:, None] + step * steps, self._lower, self._upper)
            for step in (DIFFERENCE, -DIFFERENCE, _COARSE, -_COARSE)
        ]
        rows = [places, *(end.reshape(-1, len(params)) for end in ends)]
        contacts = self._source.contacts(np.concatenate(rows))
        first = {name: x[: len(places)] for name, x in contacts.items()}
        bundle = self._bundle(first, places)
        back, known = (params - places)[:, free] / self._range[free], np.isfinite(bundle.values)
        frames = None
        if np.any(bundle.spins):
            frames = contact_frames(contacts, self._source.options.get("tangents"))
        arrays = ContactArrays.of(contacts, frames)
        here = arrays.rows(slice(len(places)), (len(places), 1))
        found, count = [], len(rows[1])
        for end, jump in ((0, _JUMP), (2, _COARSE_JUMP)):
            starts = [len(places) + side * count for side in (end, end + 1)]
            sides = [arrays.rows(slice(start, start + count), ends[end].shape[:2]) for start in starts]
            spans = [
                np.abs(side - places[:, None]).sum(axis=2) / self._range[free] for side in ends[end : end + 2]
            ]
            moves = ContactMoves.of(here, (sides[0], sides[1]), spans, jump)
            rise = moves.rise(bundle)
            slopes = np.zeros((int(known.sum()), len(params)))
            slopes[:, free] = rise[known]
            gaps = (bundle.values + np.einsum("nkp,np->nk", rise, back) - epsilon)[known]
            pieces = LinearPieces(np.maximum(gaps, 0.0), slopes)
            if len(places) > 1:
                away = np.broadcast_to(np.linalg.norm(back, axis=1)[:, None], known.shape)[known]
                pieces = pieces.rows(gaps >= -_DROP * pieces.steepest * away)
            found.append((pieces, moves))
        fine = found[0][1]
        shifts = np.zeros((len(params), *fine.positions.shape[2:]))
        shifts[free] = fine.positions[0]
        flat = (np.abs(fine.normals[0]) <= _FLAT).all(axis=(0, 2))
        shares = np.zeros((len(params), len(params)))
        shares[np.ix_(free, free)] = _row_space(fine, self._range[free])
        one = {name: x[:1] for name, x in first.items()}
        return Surroundings(found[0][0], found[1][0], one, shifts, shares, flat)

    def _bundle(self, contacts: Contacts, places: Array) -> BundleBatch:
        """Return the most critical directions of the grasps at places."""
        options: dict[str, Any] = {**self._source.options, **contacts, **self._quality_options}
        _, count, dim = contacts["positions"].shape
        # A contact on a surface moves along it alone, whatever the number of its parameters.
        ways = min(len(self.free), count * (dim - 1))
        batch = quality_many(**options, bundle=ways + _SPARE_PIECES)
        for row, reason in batch.errors.items():
            raise InvalidGraspError(f"parameters {places[row].tolist()}: {reason}")
        if batch.bundle is None:
            raise InvalidGraspError("no critical directions")
        return batch.bundle


def _row_space(moves: ContactMoves, ranges: Array) -> Array:
    """Return the projection (p, p) of changes of parameters onto those that move contacts."""
    size = max(float(np.abs(moves.positions[0]).max()), 1e-300)
    parts = [moves.positions[0] / size, moves.normals[0]]
    parts += [] if moves.spins is None else [moves.spins[0]]
    rows = np.concatenate([part.reshape(len(ranges), -1) for part in parts], axis=1) / ranges[:, None]
    sizes, vectors = np.linalg.eigh(rows @ rows.T)
    vectors = vectors[:, sizes > _NOWHERE * sizes[-1]]
    return np.asarray(vectors @ vectors.T)
