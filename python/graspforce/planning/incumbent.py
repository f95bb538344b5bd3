"""The best grasp that a search of the best one knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .problem import SearchProblem

    Array = NDArray[np.float64]

__all__ = ["Incumbent"]


class Incumbent:
    """The best grasp known, and which bounds are low enough.

    Attributes
    ----------
    best : numpy.ndarray or None
        (p,) its parameters.
    gap : float
        Bounds up to ``(1 + gap) * epsilon`` are low enough.
    open : float
        An epsilon below this is no force closure.
    """

    def __init__(self, problem: SearchProblem, gap: float, least: float) -> None:
        self._source, self._score = problem.source, problem.score
        self.best: Array | None = None
        self._rho: float | None = None
        self.gap, self.open = gap, least

    @property
    def epsilon(self) -> float:
        """Its quality."""
        return -np.inf if self._rho is None else -self._rho

    @property
    def enough(self) -> float:
        """No better grasp has to be looked for below this bound."""
        return self.epsilon + self.gap * abs(self.epsilon) if self.best is not None else -np.inf

    def attempt(self, params: Array) -> None:
        """Keep the best of these grasps (B, p) if it is better."""
        if self.best is not None:
            params = np.vstack([self.best, params])
        choice = self._source.best(params, 0, self._rho, self._score)
        if choice is not None and (self._rho is None or choice.rho < self._rho):
            self.best, self._rho = params[choice.index], choice.rho
