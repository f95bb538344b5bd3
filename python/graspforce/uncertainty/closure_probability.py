"""The probability that a grasp is force closure where its contacts are uncertain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp, quality_many
from graspforce._internal.checks import instance, real_number
from graspforce._internal.restored import expect, expect_number, expect_whole
from graspforce._internal.rounded import outward
from graspforce._internal.to_dict import Record
from graspforce.errors import InvalidGraspError, InvalidInputError
from graspforce.planning.placement_noise import PlacementNoise

from .clopper_pearson import binomial_interval

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["ClosureProbability", "closure_counts", "probability_of_closure"]

_ROWS = 65_536  # samples of all grasps measured at a time
_RTOL = 0.5  # of the qualities, of which only the closure counts


@dataclass(frozen=True, slots=True, repr=False)
class ClosureProbability(Record):
    """How likely a grasp is force closure, with an exact confidence interval.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    estimate : float
        Share of the samples that are force closure.
    lower, upper : float
        Interval of Clopper and Pearson: it holds the probability with at least the confidence asked for.
    closed, samples : int
        Number of samples that are force closure, and of all.
    confidence : float
        The confidence that was asked for.
    """

    estimate: float
    lower: float
    upper: float
    closed: int
    samples: int
    confidence: float

    def __repr__(self) -> str:
        """Write the interval with few digits, rounded outward."""
        lower, upper = outward(self.lower, self.upper)
        return (
            f"ClosureProbability(estimate={self.estimate:.6g}, lower={lower}, upper={upper}, "
            f"closed={self.closed}, samples={self.samples}, confidence={self.confidence:g})"
        )

    def _check(self) -> None:
        for name in ("estimate", "lower", "upper", "confidence"):
            expect_number(name, getattr(self, name), least=0)
        for name in ("closed", "samples"):
            expect_whole(name, getattr(self, name))
        expect(0 < self.samples >= self.closed, "closed", "at most samples")
        expect(self.lower <= self.estimate <= self.upper <= 1, "estimate", "a number of the interval")


def probability_of_closure(
    grasp: Grasp,
    noise: PlacementNoise,
    *,
    friction_std: ArrayLike = 0.0,
    confidence: float = 0.95,
) -> ClosureProbability:
    """Estimate the probability that a grasp is force closure where its contacts are uncertain.

    Positions, normals and friction coefficients miss their values at random, contact by contact. The interval
    is exact: whatever the probability is, intervals of so many samples miss it in at most ``1 - confidence``
    of all cases.

    Safe to call from several threads.

    Parameters
    ----------
    grasp : Grasp
        The nominal grasp.
    noise : PlacementNoise
        Standard deviations of positions and normals, the number of samples and the seed. A thousand samples
        give an interval of at most 0.07, a million one of 0.002. Its ``statistic`` does not matter.
    friction_std : array_like
        Scalar or (m,) standard deviation of the friction coefficients. Samples below zero count as zero.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    ClosureProbability
        The estimate with its interval. The same seed gives the same samples.

    Raises
    ------
    InvalidInputError
        An argument is unusable, or there are too many samples for one call.
    InvalidGraspError
        The grasp has ``extreme_forces`` and `friction_std` is not zero, or a sample is no grasp.

    Examples
    --------
    Three fingers on a disc of 10 cm, placed to within 5 mm and 0.2 rad:

    >>> import numpy as np
    >>> import graspforce as gf
    >>> angles = np.array([0.0, 1.9, 4.2])
    >>> outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    >>> grasp = gf.Grasp(0.05 * outward, -outward, friction=0.3, length_scale=0.05)
    >>> noise = gf.PlacementNoise(position_std=0.005, normal_std=0.2, samples=2000)
    >>> found = gf.probability_of_closure(grasp, noise, friction_std=0.05)
    >>> 0.8 < found.lower < found.estimate < found.upper < 1
    True
    """
    instance("grasp", grasp, Grasp)
    instance("noise", noise, PlacementNoise)
    level = real_number("confidence", confidence)
    if not 0 < level < 1:
        raise InvalidInputError(f"confidence: {level} must lie between 0 and 1")
    arguments = {name: value for name, value in grasp._arguments().items() if value is not None}  # noqa: SLF001
    batch = {name: np.asarray(arguments.pop(name))[None] for name in ("positions", "normals")}
    arguments.setdefault("edges", None)
    counts, reasons = closure_counts(batch["positions"], batch["normals"], noise, friction_std, arguments)
    if reasons:
        raise InvalidGraspError(f"a sample is no grasp: {reasons[0]}")
    closed = int(counts[0])
    lower, upper = binomial_interval(closed, noise.samples, level)
    return ClosureProbability(closed / noise.samples, lower, upper, closed, noise.samples, level)


def closure_counts(
    positions: Array, normals: Array, noise: PlacementNoise, friction_std: ArrayLike, options: dict[str, Any]
) -> tuple[NDArray[np.int64], dict[int, str]]:
    """Count the samples of grasps (B, m, dim) that are force closure; options as for `quality_many`.

    Rows with a sample that is no grasp come with the reason.
    """
    samples, contacts = noise.samples, positions.shape[1]
    std = _friction_std(friction_std, contacts)
    if std.any() and options.get("extreme_forces") is not None:
        raise InvalidGraspError("extreme_forces: given, so there is no friction coefficient to vary")
    # The same chance for all grasps, as in PlacementNoise.
    chance = np.random.default_rng([noise.seed, 1]).standard_normal((samples, contacts))
    step = max(1, _ROWS // samples)
    counts = [np.zeros(0, np.int64)]
    reasons: dict[int, str] = {}
    for start in range(0, len(positions), step):
        rows = slice(start, start + step)
        where, inward = noise.perturbed(positions[rows], normals[rows])
        number = len(where)
        given = {"positions": where, "normals": inward}
        for name in ("friction", "max_normal_force", "torsion", "tangents", "origin", "length_scale"):
            if (value := options.get(name)) is not None:
                given[name] = _of_samples(name, np.asarray(value, float), rows, number, samples, positions)
        if std.any():
            nominal = given.get("friction", np.full((number, samples, contacts), 0.5))
            given["friction"] = np.maximum(0, nominal + std * chance)
        flat = {name: value.reshape(-1, *value.shape[2:]) for name, value in given.items()}
        found = quality_many(**{**options, **flat, "rtol": _RTOL})
        for row, reason in found.errors.items():
            reasons.setdefault(start + row // samples, reason)
        counts.append((found.closure == 1).reshape(-1, samples).sum(axis=1))
    return np.concatenate(counts), reasons


def _of_samples(name: str, value: Array, rows: slice, number: int, samples: int, positions: Array) -> Array:
    """Repeat what all samples of a grasp share: (B, samples, ...)."""
    shapes = {"tangents": positions.shape[1:], "origin": positions.shape[2:], "length_scale": ()}
    own = shapes.get(name, positions.shape[1:2])
    one = value[rows] if value.ndim > len(own) else np.broadcast_to(value, (number, *own))
    return np.repeat(one[:, None], samples, axis=1)


def _friction_std(value: ArrayLike, contacts: int) -> Array:
    try:
        given = np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"friction_std: {error}") from None
    if given.shape not in ((), (contacts,)) or not (np.isfinite(given) & (given >= 0)).all():
        raise InvalidInputError(f"friction_std: {value!r}, expected one number or ({contacts},), at least 0")
    return given
