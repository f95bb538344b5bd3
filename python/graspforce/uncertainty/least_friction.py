"""The least friction at which a grasp is force closure, or holds a wrench."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from graspforce._core import least_friction as bracket_of
from graspforce._internal.restored import expect, expect_number
from graspforce._internal.rounded import outward
from graspforce._internal.to_dict import Record

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from graspforce._core import Grasp
    from graspforce.typing import Criterion

__all__ = ["FrictionBracket", "least_friction"]


@dataclass(frozen=True, slots=True, repr=False)
class FrictionBracket(Record):
    """A proven bracket of the least friction coefficient.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    lower : float
        Less friction than this does not suffice.
    upper : float
        This friction suffices. It is infinite if `max_friction` does not; then `lower` is `max_friction`.
    """

    lower: float
    upper: float

    def __repr__(self) -> str:
        """Write the ends with few digits, rounded outward."""
        lower, upper = outward(self.lower, self.upper)
        return f"FrictionBracket(lower={lower}, upper={upper})"

    def _check(self) -> None:
        expect_number("lower", self.lower, least=0)
        expect_number("upper", self.upper, least=0, finite=False)
        expect(self.lower <= self.upper, "upper", "a number from lower")


def least_friction(
    grasp: Grasp,
    external_wrench: ArrayLike | None = None,
    criterion: Criterion = "max",
    *,
    rtol: float = 1e-6,
    max_friction: float = 10.0,
) -> FrictionBracket:
    """Find the least friction at which a grasp is force closure, or holds a wrench.

    The coefficient is the same at all contacts. Everything else about them stays, also ``torsion`` and the
    limits: ``grasp.replace(friction=bracket.upper)`` is the grasp that closes. Compare it with the friction
    that is there: the difference is the margin.

    Safe to call from several threads.

    Parameters
    ----------
    grasp : Grasp
        Its own friction does not matter. A ``friction_margin`` divides the coefficient, as everywhere.
    external_wrench : array_like, optional
        (d,) wrench in N and N m that contact forces within their limits have to balance. By default the
        question is force closure, which no limit matters for.
    criterion : {"max", "sum"}
        With a wrench: which normalised normal forces are limited to 1, each of them or their sum.
    rtol : float
        Relative width of the bracket, at least 1e-12.
    max_friction : float
        Largest coefficient that is tried.

    Returns
    -------
    FrictionBracket
        ``lower`` and ``upper``, both proven. Coefficients below 1e-9 count as no friction: the bracket of a
        grasp that closes at any friction ends there.

    Raises
    ------
    InvalidInputError
        An argument is unusable.
    InvalidGraspError
        The grasp has ``extreme_forces`` instead of friction cones.
    NotConvergedError
        It is not decided whether forces hold the wrench at some coefficient.

    Notes
    -----
    Friction cones grow with the coefficient, so that bisection applies. Each step is an answer with its own
    proof.

    Examples
    --------
    Two fingers press with up to 20 N each; 5 N hang on them. Each finger carries half by friction.

    >>> import graspforce as gf
    >>> pinch = gf.Grasp([(-0.03, 0), (0.03, 0)], [(1, 0), (-1, 0)], max_normal_force=20.0)
    >>> needed = gf.least_friction(pinch, external_wrench=[0, -5, 0])
    >>> round(needed.lower, 4), round(needed.upper, 4)
    (0.125, 0.125)
    """
    return FrictionBracket(*bracket_of(grasp, external_wrench, criterion, rtol, max_friction))
