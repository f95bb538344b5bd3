"""Optimal grasp planning: the pattern search of section 3.4.

Python moves the pattern; every candidate of an iteration is measured in one call to the core, which works on
all of them in parallel.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict, Unpack

import numpy as np

from ._checks import checked_contacts, finite_vector, search_bounds
from ._core import Grasp, quality_many
from .errors import InvalidGraspError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from ._core import Quality

__all__ = ["Criterion", "GraspOptions", "Iterate", "Plan", "Surface", "plan"]

Criterion: TypeAlias = Literal["max", "sum"]

Surface: TypeAlias = Callable[["NDArray[np.float64]"], "tuple[ArrayLike, ...]"]
"""Parameters (B, p) to positions (B, m, dim), normals (B, m, dim) and, optionally, tangents (B, m, dim)."""

# The paper does not say which of equally good candidates wins; see the notes of `plan`.
_TIE = 1e-9


class GraspOptions(TypedDict, total=False):
    """What `plan` passes on to every grasp it builds; see `graspforce.Grasp`."""

    friction: ArrayLike
    max_normal_force: ArrayLike
    edges: ArrayLike | None
    torsion: ArrayLike | None
    tangents: ArrayLike | None
    origin: ArrayLike | None
    length_scale: float
    friction_margin: float
    extreme_forces: Sequence[ArrayLike] | None


@dataclass(frozen=True, slots=True, eq=False)
class Iterate:
    """One iterate of a plan.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the contacts.
    rho : float
        Quality there; negative means force closure, smaller is better.
    step : numpy.ndarray
        (p,) steps with which the search goes on from here.
    """

    params: NDArray[np.float64]
    rho: float
    step: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Plan:
    """Where the contacts should go, and how the search got there.

    Attributes
    ----------
    params : numpy.ndarray
        (p,) parameters of the best grasp found.
    quality : Quality
        Its quality, with the bracket that certifies it.
    grasp : Grasp
        The grasp itself.
    history : tuple of Iterate
        One row per iterate, the initial one included.
    criterion : {"max", "sum"}
        Which quality was improved.
    num_candidates : int
        How many grasps were measured on the way.
    """

    params: NDArray[np.float64]
    quality: Quality
    grasp: Grasp
    history: tuple[Iterate, ...]
    criterion: Criterion
    num_candidates: int

    def __repr__(self) -> str:
        where = np.array2string(self.params, precision=6, separator=", ", max_line_width=10_000)
        return (
            f"Plan(params={where}, rho_{self.criterion}={self.quality.rho:.6g}, "
            f"iterations={len(self.history) - 1}, candidates={self.num_candidates})"
        )


def plan(
    surface: Surface,
    initial: ArrayLike,
    step: ArrayLike,
    tolerance: ArrayLike,
    bounds: ArrayLike,
    criterion: Criterion = "max",
    *,
    rtol: float | None = None,
    **grasp_options: Unpack[GraspOptions],
) -> Plan:
    r"""Search for the contact positions that minimise rho, by the OGP algorithm of section 3.4.

    Each iteration measures all combinations of every parameter one step down, where it is, and one step up
    (clipped to its bounds), moves to the best, and halves the step of each parameter that stayed. It stops
    when every step is within its tolerance.

    Parameters
    ----------
    surface : callable
        Maps parameters (B, p) to positions (B, m, dim) in m and normals (B, m, dim) into the object, of any
        length; spatial surfaces may return tangents (B, m, 3) as well. Tie parameters to each other by
        computing several contacts from one.
    initial : array_like
        (p,) where the search starts, within the bounds.
    step, tolerance : array_like
        (p,) or scalar, positive: the first steps, and the steps at which the search ends.
    bounds : array_like
        (p, 2) finite lower and upper bounds.
    criterion : {"max", "sum"}
        Limit each normalised normal force (``rho_max``) or their sum (``rho_sum``).
    rtol : float, optional
        Relative width of the bracket to which each quality is computed; by default as for `Grasp.quality`.
    **grasp_options
        ``friction``, ``max_normal_force``, ``edges``, ``torsion``, ``tangents``, ``origin``,
        ``length_scale``, ``friction_margin`` and ``extreme_forces`` of `Grasp`.

    Returns
    -------
    Plan
        The best grasp found, its quality and the iterates.

    Raises
    ------
    InvalidInputError
        An argument has the wrong shape or is not finite, a step or tolerance is not positive, bounds are
        reversed, the start is outside them, or the surface returns something else than finite contacts.
    InvalidGraspError
        The contacts do not make a grasp (zero normals, negative friction, ...).

    Notes
    -----
    Section 3.4 leaves ties open. Candidates are numbered with offsets in the order (-, 0, +), the last
    parameter fastest; among those within 1e-9 (relative) of the best, the centre wins, else the lowest
    number. Step 2's upper offset reads :math:`\phi_i^{(k)} + \Delta\phi_i`. The end is a local optimum of
    the pattern: other starts and steps may end better.

    Examples
    --------
    Two fingers squeeze a disc of radius 0.1 m; the search finds them opposite each other.

    >>> import numpy as np
    >>> import graspforce as gf
    >>> def disc(angles):
    ...     outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ...     return 0.1 * outward, -outward
    >>> found = gf.plan(disc, [0.0, 2.0], step=0.5, tolerance=1e-3, bounds=[(0, 1), (1, 4)], friction=0.6)
    >>> bool(abs(found.params[1] - found.params[0] - np.pi) < 2e-3)
    True
    >>> found.history[0].rho > 0 > found.quality.rho
    True
    """
    if criterion not in ("max", "sum"):
        raise InvalidInputError(f"criterion: {criterion!r} is neither 'max' nor 'sum'")
    if not callable(surface):
        raise InvalidInputError(f"surface: {surface!r} is not callable")
    center = finite_vector("initial", initial)
    steps = finite_vector("step", step, size=center.size, positive=True)
    tolerances = finite_vector("tolerance", tolerance, size=center.size, positive=True)
    lower, upper = search_bounds(bounds, center)

    history: list[Iterate] = []
    num_candidates = 0
    while True:
        candidates, center_at = _pattern(center, steps, lower, upper)
        rho = _measure(surface, candidates, criterion, rtol, grasp_options)
        num_candidates += len(rho)
        if not history:
            history.append(Iterate(center, float(rho[center_at]), steps))
        winner = _winner(rho, center_at)
        best = candidates[winner]
        steps = np.where(best == center, steps / 2, steps)
        center = best
        history.append(Iterate(center, float(rho[winner]), steps))
        if np.all(steps <= tolerances):
            break

    grasp = _grasp_at(surface, center, grasp_options)
    quality = grasp.quality(criterion, rtol=rtol)
    return Plan(center, quality, grasp, tuple(history), criterion, num_candidates)


def _pattern(
    center: NDArray[np.float64],
    steps: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> tuple[NDArray[np.float64], int]:
    """All candidates of an iteration (B, p), last parameter fastest, and which of them is the centre."""
    down = np.maximum(lower, center - steps)
    up = np.minimum(upper, center + steps)
    # At a bound, or where a step is lost to rounding, two offsets coincide and one candidate is enough.
    axes = [np.unique(values) for values in np.stack([down, center, up], axis=1)]
    candidates = np.array(list(itertools.product(*axes)))
    return candidates, int(np.flatnonzero((candidates == center).all(axis=1))[0])


def _winner(rho: NDArray[np.float64], center_at: int) -> int:
    best = rho.min()
    good = rho <= best + _TIE * abs(best)
    return center_at if good[center_at] else int(np.argmax(good))


def _measure(
    surface: Surface,
    candidates: NDArray[np.float64],
    criterion: Criterion,
    rtol: float | None,
    options: GraspOptions,
) -> NDArray[np.float64]:
    contacts = checked_contacts(surface(candidates), candidates)
    result = quality_many(**_with_contacts(options, contacts), criterion=criterion, rtol=rtol)
    for row, reason in sorted(result.errors.items()):
        raise InvalidGraspError(f"surface, row {row}, parameters {candidates[row].tolist()}: {reason}")
    return result.rho


def _grasp_at(surface: Surface, params: NDArray[np.float64], options: GraspOptions) -> Grasp:
    contacts = checked_contacts(surface(params[None]), params[None])
    return Grasp(**_with_contacts(options, {name: array[0] for name, array in contacts.items()}))


def _with_contacts(options: GraspOptions, contacts: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
    if "tangents" in contacts and options.get("tangents") is not None:
        raise InvalidInputError("tangents: the surface returns tangents already")
    return {**options, **contacts}
