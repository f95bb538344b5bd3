"""Candidate grasps from parameters: the surface's contacts, checked, and which of them are feasible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp, unwarned_grasp
from graspforce._internal.checks import checked_contacts, real_number
from graspforce.errors import GraspForceError, InvalidGraspError, InvalidInputError

from .scoring import Choice, SearchCounts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from graspforce.typing import Feasible, Surface

    from .scoring import Contacts, Score

    Array = NDArray[np.float64]


class CandidateSource:
    """Candidates from parameters: the surface's contacts, checked, and the best of the feasible ones."""

    def __init__(
        self,
        surface: Surface,
        options: Mapping[str, Any],
        feasible: Feasible | None = None,
        min_distance: float = 0.0,
        max_opening: float = np.inf,
    ) -> None:
        if not callable(surface):
            raise InvalidInputError(f"surface: {surface!r} is not callable")
        if feasible is not None and not callable(feasible):
            raise InvalidInputError(f"feasible: {feasible!r} is not callable")
        self._min_distance = real_number("min_distance", min_distance, least=0)
        self._max_opening = real_number("max_opening", max_opening, positive=True, finite=False)
        self._surface, self._feasible = surface, feasible
        self.options = dict(options)
        self.counts = SearchCounts()
        self._layout: dict[str, tuple[int, ...]] | None = None

    def contacts(self, params: Array) -> Contacts:
        """Contacts of (B, p) parameters, checked."""
        # A copy: a surface that works in place must not move the search.
        contacts = checked_contacts(self._surface(params.copy()), params)
        if "tangents" in contacts and self.options.get("tangents") is not None:
            raise InvalidInputError("tangents: the surface returns tangents already")
        layout = {name: array.shape[1:] for name, array in contacts.items()}
        self._layout = self._layout or layout
        if layout != self._layout:
            raise InvalidInputError(f"surface: returned {layout} for a row, but {self._layout} before")
        return contacts

    def settled(self, params: Array, lower: Array, upper: Array) -> Array:
        """Return the surface's own parameters of the contacts at (p,) parameters, if those are feasible."""
        settle = getattr(self._surface, "settled", None)
        if settle is None:
            return params
        found: Array = settle(params[None].copy())[0]
        inside = bool(((found >= lower) & (found <= upper)).all())
        return found if inside and self.feasible(self.contacts(found[None]))[0] else params

    def answered(self, params: Array) -> tuple[Contacts, dict[int, GraspForceError]]:
        """Contacts of the rows of (B, p) parameters that have any, in order, and why others have none."""
        try:
            return self.contacts(params), {}
        except GraspForceError:
            pass
        failed: dict[int, GraspForceError] = {}
        rows: list[Contacts] = []
        for row in range(len(params)):
            try:
                rows.append(self.contacts(params[row : row + 1]))
            except GraspForceError as error:
                failed[row] = error
        names = rows[0] if rows else ()
        return {name: np.concatenate([contacts[name] for contacts in rows]) for name in names}, failed

    @property
    def conditions(self) -> str:
        """Names of the arguments that refuse candidates."""
        given = {
            "feasible": self._feasible is not None,
            "min_distance": self._min_distance > 0,
            "max_opening": self._max_opening < np.inf,
        }
        return " and ".join(name for name, refuses in given.items() if refuses)

    @property
    def gives_tangents(self) -> bool:
        """Whether each contact has a tangent of its own, from the caller or the surface."""
        return self.options.get("tangents") is not None or "tangents" in (self._layout or {})

    def grasp(self, params: Array) -> Grasp:
        """Grasp at (p,) parameters."""
        return self.grasp_of(self.contacts(params[None]), 0)

    def grasp_of(self, contacts: Contacts, row: int) -> Grasp:
        """Grasp of one row of contacts."""
        return unwarned_grasp(**{**self.options, **{name: array[row] for name, array in contacts.items()}})

    def feasible(self, contacts: Contacts) -> NDArray[np.bool_]:
        """Which rows the caller allows."""
        positions, normals = contacts["positions"], contacts["normals"]
        allowed = np.ones(len(positions), dtype=bool)
        if (self._min_distance > 0 or self._max_opening < np.inf) and positions.shape[1] > 1:
            first, second = np.triu_indices(positions.shape[1], k=1)
            apart = np.linalg.norm(positions[:, first] - positions[:, second], axis=-1)
            allowed &= ((apart >= self._min_distance) & (apart <= self._max_opening)).all(axis=1)
        if self._feasible is not None and allowed.any():
            answer = np.asarray(self._feasible(positions.copy(), normals.copy()))
            if answer.shape != allowed.shape or answer.dtype.kind != "b":
                raise InvalidInputError(
                    f"feasible: returned {answer.dtype} of shape {answer.shape}, expected bool of shape "
                    f"{allowed.shape}"
                )
            allowed &= answer
        return allowed

    def best(self, params: Array, center: int, known: float | None, score: Score) -> Choice | None:
        """Pick the best of the candidates (B, p) that are feasible; None where none is."""
        contacts = self.contacts(params)
        rows = np.flatnonzero(self.feasible(contacts))
        self.counts += SearchCounts(candidates=len(params), infeasible=len(params) - len(rows))
        if not len(rows):
            return None
        where = np.flatnonzero(rows == center)
        inside = len(where) > 0
        if len(rows) < len(params):
            contacts = {name: array[rows] for name, array in contacts.items()}
        # The centre wins ties. Where it is infeasible, the lowest candidate does.
        at = int(where[0]) if inside else 0
        try:
            choice = score.best(self.options, contacts, at, known if inside else None)
        except InvalidGraspError as error:
            if error.row is None:
                raise
            row = int(rows[error.row])
            message = f"surface, row {row}, parameters {params[row].tolist()}: {error}"
            raise InvalidGraspError(message) from error
        self.counts += choice.counts
        center_rho = choice.center_rho if inside else np.inf
        return Choice(int(rows[choice.index]), choice.rho, center_rho, choice.counts)
