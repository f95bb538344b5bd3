"""The result of branch and bound."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

from graspforce._internal.restored import (
    expect,
    expect_instance,
    expect_number,
    expect_search_result,
    expect_whole,
)
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graspforce._core import Grasp, Quality

Ended: TypeAlias = Literal["tolerance", "open", "estimate", "boxes", "time", "interrupted", "error"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GlobalOptimum(Record):
    """The best grasp found, and an upper bound of every other one.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the best grasp found.
    quality, grasp : Quality, Grasp
        Its quality and the grasp itself.
    epsilon_upper : float
        Upper bound of epsilon over all parameters within the bounds. It is proven if `proven` is True.
        Otherwise it is an estimate, and a better grasp may exist.
    gap : float
        ``(epsilon_upper - quality.epsilon) / abs(quality.epsilon)``, relative. It is infinite if epsilon is
        zero and its bound is not.
    boxes : int
        Number of boxes, or of products of faces, that were bounded.
    proven : bool
        True if the curvature is known by formulas, by the caller, or not needed; False if it was estimated.
    stopped : {"tolerance", "open", "estimate", "boxes", "time", "interrupted", "error"}
        Why the search ended:

        - "tolerance": the gap is proven to be within the argument `gap`.
        - "open": it is proven that no grasp within the bounds is force closure by more than a millionth of
          the norm of the longest wrench that a normal force at its limit exerts.
        - "estimate": one of the two above holds by an estimated curvature, without a proof.
        - "boxes": `max_boxes` was reached, memory would not hold more, or no box is left that can be cut.
        - "time": `time_limit` was reached.
        - "interrupted": Ctrl-C was pressed.
        - "error": an error ended the search and carries this result as its ``partial``.
    seconds : float
        Duration of the search in s.
    """

    params: NDArray[np.float64]
    quality: Quality
    grasp: Grasp
    epsilon_upper: float
    gap: float
    boxes: int
    proven: bool
    stopped: Ended
    seconds: float

    def _check(self) -> None:
        expect_search_result(self)
        expect_number("epsilon_upper", self.epsilon_upper, least=self.quality.epsilon, finite=False)
        expect_number("gap", self.gap, least=0, finite=False)
        reached = self.quality.epsilon + self.gap * abs(self.quality.epsilon)
        rounding = 1e-9 * (abs(self.epsilon_upper) + abs(self.quality.epsilon))
        same = math.isinf(self.gap) or abs(self.epsilon_upper - reached) <= rounding
        expect(same, "gap", "that of epsilon and its upper bound")
        expect_whole("boxes", self.boxes)
        expect_instance("proven", self.proven, bool)
        expect(self.stopped in get_args(Ended), "stopped", "a reason")
        expect_number("seconds", self.seconds, least=0)

    def __repr__(self) -> str:
        upper = f"{self.epsilon_upper:.6g} ({'proven' if self.proven else 'estimate'})"
        return (
            f"GlobalOptimum(epsilon={self.quality.epsilon:.6g}, epsilon_upper={upper}, "
            f"stopped={self.stopped!r}, boxes={self.boxes}, {self.seconds:.1f} s)"
        )
