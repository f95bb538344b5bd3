"""Placement noise: the quality of grasps whose contacts miss their positions and normals at random."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._core import TIE, quality_many
from graspforce._internal.checks import chosen, finite_array, real_number, whole_number
from graspforce._internal.restored import expect_array
from graspforce._internal.to_dict import Record
from graspforce._internal.vectors import unit
from graspforce.errors import InvalidGraspError, InvalidInputError

from .scoring import Choice, SearchCounts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from .scoring import Contacts

    Array = NDArray[np.float64]

# Noisy grasps measured at a time: a batch of candidates by samples fits in memory whatever its size.
_ROWS = 65_536

_MAX_SAMPLES = 1_000_000
_MAX_NUMBERS = 2**27  # of all noisy positions: a gibibyte

# What `quality_many` also takes with a row for each grasp, and how many axes it then has.
_OF_EACH_GRASP = {"friction": 2, "max_normal_force": 2, "torsion": 2, "origin": 2, "length_scale": 1}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PlacementQuality(Record):
    """Quality of grasps under placement noise.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    epsilon : numpy.ndarray
        (B, samples) epsilon of every noisy grasp; negative if it is not force closure.
    converged : numpy.ndarray
        (B, samples) bool, True if its bracket is as narrow as asked for.
    mean, percentile_5 : numpy.ndarray
        (B,) mean and 5th percentile of epsilon over the samples.
    closure_rate : numpy.ndarray
        (B,) share of the samples that are force closure.
    """

    epsilon: Array
    converged: NDArray[np.bool_]
    mean: Array
    percentile_5: Array
    closure_rate: Array

    def _check(self) -> None:
        expect_array("epsilon", self.epsilon, (None, None))
        expect_array("converged", self.converged, self.epsilon.shape, kind=np.bool_)
        for name in ("mean", "percentile_5", "closure_rate"):
            expect_array(name, getattr(self, name), self.epsilon.shape[:1])

    def __repr__(self) -> str:
        grasps, samples = self.epsilon.shape
        best = f", best mean epsilon={self.mean.max():.6g}" if grasps else ""
        return f"PlacementQuality({grasps} grasps, {samples} samples of each{best})"


@dataclass(frozen=True, slots=True)
class PlacementNoise(Record):
    """Random errors of contact positions and normals, and the statistic that the planner maximises.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    position_std : float
        Standard deviation, in m, of each coordinate of each contact.
    normal_std : float
        Standard deviation, in rad, of the two (planar: one) angles by which each normal tilts.
    samples : int
        Number of noisy copies of each grasp.
    statistic : {"mean", "percentile_5"}
        Statistic of epsilon that the planner maximises.
    seed : int
        Seed of the noise. It is the same for all grasps, so that a comparison does not depend on chance.

    Examples
    --------
    Errors of 5 mm and 0.05 rad lower the quality of three fingers on a disc.

    >>> import numpy as np
    >>> import graspforce as gf
    >>> angles = np.array([0.0, 2.1, 4.2])
    >>> outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    >>> noisy = gf.PlacementNoise(position_std=0.005, normal_std=0.05, samples=200).quality(
    ...     0.1 * outward[None], -outward[None], friction=0.5, length_scale=0.1
    ... )
    >>> nominal = gf.Grasp(0.1 * outward, -outward, friction=0.5, length_scale=0.1).quality().epsilon
    >>> bool(noisy.percentile_5[0] < noisy.mean[0] < nominal)
    True
    """

    position_std: float = 0.0
    normal_std: float = 0.0
    samples: int = 64
    statistic: Literal["mean", "percentile_5"] = "mean"
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("position_std", "normal_std"):
            real_number(name, getattr(self, name), least=0)
        whole_number("samples", self.samples, least=1, most=_MAX_SAMPLES)
        whole_number("seed", self.seed, least=0)
        chosen("statistic", self.statistic, ("mean", "percentile_5"))

    def _check(self) -> None:
        """Nothing is left to check: `__post_init__` did."""

    def perturbed(self, positions: ArrayLike, normals: ArrayLike) -> tuple[Array, Array]:
        """Return noisy copies (B, samples, m, dim) of contacts (B, m, dim), with unit normals."""
        return self._noisy(*_contacts(positions, normals))

    def _noisy(self, where: Array, inward: Array) -> tuple[Array, Array]:
        if where.size * self.samples > _MAX_NUMBERS:
            raise InvalidInputError(
                f"positions: {len(where)} grasps are too many for {self.samples} samples each; take fewer"
            )
        random = np.random.default_rng(self.seed)
        shift, tilt = random.standard_normal((2, 1, self.samples, *where.shape[1:]))
        n = unit(inward)[:, None]
        across = self.normal_std * (tilt - n * (tilt * n).sum(axis=-1, keepdims=True))
        angle = np.linalg.norm(across, axis=-1, keepdims=True)
        # sinc keeps the limit where nothing tilts.
        tilted = n * np.cos(angle) + across * np.sinc(angle / np.pi)
        return where[:, None] + self.position_std * shift, tilted

    def quality(
        self, positions: ArrayLike, normals: ArrayLike, tangents: ArrayLike | None = None, **options: Any
    ) -> PlacementQuality:
        """Compute the quality of grasps (B, m, dim) under this noise; options as for `quality_many`.

        An option with a row for each grasp holds for all noisy copies of that grasp.

        Raises
        ------
        InvalidInputError, InvalidGraspError
            As for `graspforce.quality_many`.
        """
        where, inward = _contacts(positions, normals)
        given = None if tangents is None else finite_array("tangents", tangents)
        if given is not None and given.shape not in (where.shape, where.shape[1:]):
            raise InvalidInputError(
                f"tangents: shape {given.shape}, expected {where.shape} or {where.shape[1:]}"
            )
        batch, samples, shape = len(where), self.samples, where.shape[1:]
        own = _of_each_grasp(options, batch)
        step = max(1, _ROWS // samples)
        parts = []
        # One empty part where there is no grasp at all.
        for start in range(0, max(batch, 1), step):
            rows = slice(start, start + step)
            noisy, tilted = self._noisy(where[rows], inward[rows])
            contacts = {"positions": noisy, "normals": tilted}
            if given is not None:
                along = given[rows, None] if given.ndim == 3 else given
                contacts["tangents"] = np.broadcast_to(along, noisy.shape)
            flat: dict[str, Any] = {name: array.reshape(-1, *shape) for name, array in contacts.items()}
            flat |= {name: np.repeat(array[rows], samples, axis=0) for name, array in own.items()}
            found = quality_many(**{**options, **flat})
            for row, reason in sorted(found.errors.items()):
                error = InvalidGraspError(reason)
                error.row = start + row // samples
                raise error
            columns = (found.epsilon, found.closure == 1, found.status == 0)
            parts.append([column.reshape(-1, samples) for column in columns])
        epsilon, closed, converged = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        low = np.percentile(epsilon, 5, axis=1)
        return PlacementQuality(epsilon, converged, epsilon.mean(axis=1), low, closed.mean(axis=1))

    def score(self, quality_options: Mapping[str, Any]) -> PlacementScore:
        """Return the score of the planner, with these options of `graspforce.Grasp.quality`."""
        return PlacementScore(self, quality_options)


class PlacementScore:
    """The chosen statistic of the noisy quality."""

    def __init__(self, placement: PlacementNoise, quality_options: Mapping[str, Any]) -> None:
        self._placement, self._quality_options = placement, quality_options

    def best(
        self, options: Mapping[str, Any], contacts: Contacts, center: int, known: float | None
    ) -> Choice:
        """Pick the best row; every noisy copy is measured to the end, whatever is `known`."""
        del known
        found = self._placement.quality(**{**options, **contacts}, **self._quality_options)
        values = getattr(found, self._placement.statistic)
        best = values.max()
        good = values >= best - TIE * abs(best)
        index = center if good[center] else int(np.argmax(good))
        counts = SearchCounts(polytopes=found.epsilon.size, converged=int(found.converged.sum()))
        return Choice(index, -float(values[index]), -float(values[center]), counts)


def _of_each_grasp(options: Mapping[str, Any], grasps: int) -> dict[str, NDArray[Any]]:
    """Pick the options with a row for each grasp; what is wrong with their values, the core finds."""
    found = {}
    for name in options.keys() & _OF_EACH_GRASP.keys():
        try:
            array = np.asanyarray(options[name])
        except ValueError:
            continue
        if array.ndim == _OF_EACH_GRASP[name]:
            if len(array) != grasps:
                raise InvalidInputError(f"{name}: {len(array)} rows for {grasps} grasps")
            found[name] = array
    return found


def _contacts(positions: ArrayLike, normals: ArrayLike) -> tuple[Array, Array]:
    """Positions and normals (B, m, dim) that have directions."""
    where, inward = finite_array("positions", positions), finite_array("normals", normals)
    if where.ndim != 3 or where.shape != inward.shape or where.shape[1] < 1 or where.shape[2] not in (2, 3):
        raise InvalidInputError(
            f"positions and normals: shapes {where.shape} and {inward.shape}, expected both to be (B, m, 2) "
            "or (B, m, 3) with m at least 1"
        )
    if not inward.any(axis=-1).all():
        row, contact = (int(i) for i in np.argwhere(~inward.any(axis=-1))[0])
        error = InvalidGraspError(f"normals, row {row}, contact {contact}: {inward[row, contact].tolist()} "
                                  "has no direction")  # fmt: skip
        error.row = row
        raise error
    return where, inward
