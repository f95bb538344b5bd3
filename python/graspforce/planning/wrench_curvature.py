"""How far the wrenches of contacts within boxes of parameters can be from those at the boxes' corners.

Along each axis of a box, the wrench of a fixed contact force departs from its interpolation between the
corners by at most half its largest second derivative times the square of the half-width. Second derivatives
are given by the caller, bounded by formulas over the box, or estimated by differences.

The default tangents switch axes where ``|n_x|`` passes 0.7. A box in which they do has both frames at its
corners.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_array
from graspforce._internal.taylor_intervals import TaylorIntervals
from graspforce.errors import GraspForceError, InvalidInputError

from .contact_wrenches import SEEDS, SWITCH, ContactWrenches, unit_columns

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = [
    "Departures",
    "FormulaCurvature",
    "GivenCurvature",
    "checked_curvature",
    "estimated_departures",
]

_ROUNDED = 1e-9  # of a second derivative: more than rounding takes


@dataclass(frozen=True, slots=True)
class Departures:
    """What boxes leave open between their corners.

    Attributes
    ----------
    each : numpy.ndarray
        (B, contacts) largest departure of any wrench of a contact.
    seeds : numpy.ndarray
        (K, contacts, 3) first tangents of frames; none if the frames are those of the grasp.
    needs : numpy.ndarray
        (B, K) bool: the frames that each box has at its corners.
    along : numpy.ndarray or None
        (B, axes) the part of all contacts' departures that is due to each axis, if that is known.
    """

    each: Array
    seeds: Array
    needs: NDArray[np.bool_]
    along: Array | None = None

    @classmethod
    def of_grasp(cls, each: Array, along: Array | None = None) -> Departures:
        """Return departures in the frames of the grasp."""
        return cls(each, np.zeros((0, each.shape[1], 3)), np.zeros((len(each), 0), dtype=bool), along)


class GivenCurvature:
    """Second derivatives that the caller bounds: (m, p) everywhere, or (B, m, p) as a function of boxes."""

    proven = True

    def __init__(self, largest: Array | Callable[[Array, Array], Array], num_contacts: int) -> None:
        self._largest, self._num_contacts = largest, num_contacts

    def over(
        self, low: Array, high: Array, contacts: NDArray[np.int64], axes: NDArray[np.int64]
    ) -> Departures:
        """Bound the departures of some contacts in boxes (B, p) along some axes."""
        largest = self._largest
        if callable(largest):
            largest = checked_curvature(
                largest(low.copy(), high.copy()), (len(low), self._num_contacts, low.shape[1])
            )
        half = (high - low)[:, axes] / 2
        each = 0.5 * half[:, None] ** 2 * largest[..., contacts, :][..., axes]
        return Departures.of_grasp(each.sum(axis=-1), each.sum(axis=-2))


def checked_curvature(curvature: ArrayLike, expected: tuple[int, ...]) -> Array:
    """Check bounds of second derivatives."""
    bends = finite_array("curvature", curvature)
    if bends.shape != expected or (bends < 0).any():
        raise InvalidInputError(f"curvature: shape {bends.shape}, expected {expected} of nonnegative numbers")
    return bends


class FormulaCurvature:
    """Second derivatives by the formulas of curves and surfaces, for each box apart."""

    proven = True

    def __init__(self, surface: Callable[..., Any], wrenches: ContactWrenches) -> None:
        self._surface, self._wrenches = surface, wrenches

    @classmethod
    def of(
        cls, surface: Callable[..., Any], wrenches: ContactWrenches, low: Array, high: Array
    ) -> FormulaCurvature | None:
        """Return the curvature of a surface; None if formulas do not give it."""
        if not getattr(surface, "has_formulas", False):
            return None
        found = cls(surface, wrenches)
        try:
            middle = (low + high)[None] / 2
            found.over(middle, middle, np.arange(wrenches.num_contacts), np.arange(len(low)))
        except (TypeError, GraspForceError):
            return None
        return found

    def over(
        self, low: Array, high: Array, contacts: NDArray[np.int64], axes: NDArray[np.int64]
    ) -> Departures:
        """Bound the departures of some contacts in boxes (B, p) along some axes."""
        boxes = len(low)
        along = np.eye(low.shape[1])[axes]
        # One line for each axis of each box: (axes * boxes, p).
        lines = TaylorIntervals.on_line(
            np.tile(low, (len(axes), 1)), np.tile(high, (len(axes), 1)), np.repeat(along, boxes, axis=0)
        )
        positions, normals, *tangents = (
            part[:, contacts] for part in map(TaylorIntervals.of, self._surface(lines))
        )
        half = ((high - low)[:, axes] / 2).T.reshape(-1, 1)

        def departures(seed: Any) -> Array:
            columns = unit_columns(positions, normals, seed, self._wrenches.origin, self._wrenches.force_dim)
            bends = np.stack(
                [
                    self._wrenches.largest_bend(columns, at, int(contact))
                    for at, contact in enumerate(contacts)
                ],
                axis=1,
            )
            # A box without width has no departure, whatever the derivative.
            each: Array = 0.5 * half**2 * np.where(half > 0, bends, 0.0) * (1 + _ROUNDED)
            return each.reshape(len(axes), boxes, len(contacts))

        fixed = self._wrenches.tangents(contacts)
        if tangents or fixed is not None or not self._wrenches.is_spatial:
            found = departures(tangents[0] if tangents else fixed)
            return Departures.of_grasp(found.sum(axis=0), found.sum(axis=2).T)
        ends = normals[:boxes, :, 0]
        size = ends.largest(0)
        least = np.where(
            (ends.low[0] <= 0) & (ends.high[0] >= 0), 0.0, np.minimum(abs(ends.low[0]), abs(ends.high[0]))
        )
        needed = [~(least > SWITCH + 1e-9), ~(size <= SWITCH - 1e-9)]
        cones = np.array([self._wrenches.is_cone(int(contact)) for contact in contacts])
        # The support of a true cone does not depend on its frame.
        middle = np.abs(ends.low[0] + ends.high[0]) / 2 <= SWITCH
        needed = [np.where(cones, middle, needed[0]), np.where(cones, ~middle, needed[1])]
        each = [departures(np.broadcast_to(seed, (len(contacts), 3))) for seed in SEEDS]
        largest = np.maximum(*(np.where(use, part, 0.0) for use, part in zip(needed, each, strict=True)))
        choices = list(itertools.product((0, 1), repeat=len(contacts)))
        used = [
            np.all([needed[frame][:, at] for at, frame in enumerate(choice)], axis=0) for choice in choices
        ]
        return Departures(
            largest.sum(axis=0), SEEDS[np.array(choices)], np.stack(used, axis=1), largest.sum(axis=2).T
        )


def estimated_departures(
    wrenches: ContactWrenches,
    low: Array,
    high: Array,
    contacts: NDArray[np.int64],
    axes: NDArray[np.int64],
    safety: float,
) -> Departures:
    """Estimate departures in boxes (B, p) along some axes, by second differences half a box wide each."""
    arms = np.kron(np.eye(low.shape[1])[axes], np.array([[-1.0], [-0.5], [0.5], [1.0]]))
    steps = np.vstack([np.zeros(low.shape[1]), arms])
    center, half = (low + high) / 2, (high - low) / 2
    # Rounding must not carry a place over the bounds, where the surface may end.
    places = np.clip(center[:, None] + steps * half[:, None], low[:, None], high[:, None])
    return Departures.of_grasp(2 * safety * wrenches.second_differences(places, contacts, len(axes)))
