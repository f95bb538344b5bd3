"""Values of many grasps with their derivatives by arrays of any leading dimensions: what torch and JAX call.

A row without an answer does not stop the others: its value is `unsolved`, and its derivatives are zero.
Derivatives by normals are those by the vectors as given, of any length, with the turn of the contact frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._core import quality_many
from graspforce.grasp_forces import forces_many

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from graspforce._core import QualityBatch

    Array = NDArray[np.float64]
    Derivatives = tuple[Array, ...]

__all__ = [
    "FORCE_GRADIENTS",
    "QUALITY_GRADIENTS",
    "ROWS",
    "Differentiated",
    "Layout",
    "forces",
    "quality",
    "smooth_minimum",
]

ROWS = ("friction", "max_normal_force", "torsion", "tangents", "origin", "length_scale")
"""Options that may differ from grasp to grasp."""

QUALITY_GRADIENTS = ("positions", "normals", "friction", "max_normal_force")
"""What a quality has derivatives by."""

FORCE_GRADIENTS = ("positions", "normals", "external_wrenches")
"""What least forces and residuals have derivatives by."""

_DERIVATIVES = (*QUALITY_GRADIENTS, "spins")

SMOOTHED_DIRECTIONS = 16
"""Critical directions of each grasp whose supports a smooth minimum looks at."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Shapes of a batch of contacts (..., m, dim), for K wrenches of each grasp where there are any.

    Values are (...) or (..., K). In a ragged batch, whose B grasps begin at `offsets`, contacts are
    (..., N, dim) and values (..., B) or (..., B, K).
    """

    leading: tuple[int, ...]
    contacts: int
    dim: int
    wrenches: tuple[int, ...] = ()
    offsets: tuple[int, ...] | None = None

    @property
    def grasps(self) -> tuple[int, ...]:
        """Shape of a number for each grasp."""
        return self.leading if self.offsets is None else (*self.leading, len(self.offsets) - 1)

    @property
    def values(self) -> tuple[int, ...]:
        """Shape of the values."""
        return (*self.grasps, *self.wrenches[:1])

    @property
    def owners(self) -> NDArray[np.int64] | None:
        """The grasp of each contact of a ragged batch."""
        if self.offsets is None:
            return None
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))

    def given(self, name: str) -> tuple[int, ...]:
        """Return the shape of an argument."""
        of_contacts = (*self.leading, self.contacts)
        shapes = {
            "positions": (*of_contacts, self.dim),
            "normals": (*of_contacts, self.dim),
            "external_wrenches": (*self.grasps, *self.wrenches),
            "tangents": (*of_contacts, 3),
            "origin": (*self.grasps, self.dim),
            "length_scale": self.grasps,
        }
        return shapes.get(name, of_contacts)

    def trailing(self, name: str) -> int:
        """Return the number of dimensions of an argument behind the leading ones."""
        return len(self.given(name)) - len(self.leading)

    def derivative(self, name: str) -> tuple[int, ...]:
        """Return the shape of the derivative by an argument: contacts have one for each wrench."""
        shape = self.given(name)
        if name == "external_wrenches":
            return shape
        return (*self.leading, *self.wrenches[:1], *shape[len(self.leading) :])

    def flat(self) -> Layout:
        """Return the layout with joined leading dimensions; copies of a ragged batch follow each other."""
        count, offsets = prod(self.leading), self.offsets
        if offsets is None:
            return Layout((count,), self.contacts, self.dim, self.wrenches)
        joined = [copy * self.contacts + offset for copy in range(count) for offset in offsets[1:]]
        return Layout((), count * self.contacts, self.dim, self.wrenches, (0, *joined))

    def spread(self, values: Any) -> Any:
        """Give each contact the values of its grasp: (..., m) or (..., K, m), where m may be 1.

        NumPy's arrays, JAX's and tensors will do.
        """
        if self.offsets is None:
            return values[..., None]
        return values.swapaxes(-1, -2)[..., self.owners] if self.wrenches else values[..., self.owners]


@dataclass(frozen=True, slots=True)
class Differentiated:
    """Values, which of them are answers, and the derivatives by each named argument."""

    values: Array
    solved: NDArray[np.bool_]
    derivatives: Derivatives


def quality(
    layout: Layout, positions: Array, normals: Array, rows: Mapping[str, Array], options: Mapping[str, Any]
) -> Differentiated:
    """Compute epsilon with derivatives by `QUALITY_GRADIENTS`, in the shapes of the layout."""
    kept = dict(options)
    unsolved, smoothing = kept.pop("unsolved"), kept.pop("smoothing", 0.0)
    flat, positions, normals, kept = _flattened(layout, positions, normals, rows, kept)
    if smoothing > 0:
        batch = quality_many(positions, normals, **kept, bundle=SMOOTHED_DIRECTIONS)
        values, derivatives = smooth_minimum(batch, smoothing, flat.owners)
    else:
        batch = quality_many(positions, normals, **kept, gradient=True)
        values, derivatives = batch.epsilon, {name: getattr(batch.gradient, name) for name in _DERIVATIVES}
    by_turn, spins = derivatives["normals"], derivatives["spins"]
    derivatives["normals"] = _by_given_normals(by_turn, spins, normals, kept.get("tangents"))
    solved = np.asarray(batch.status) != 2
    found = {name: derivatives[name] for name in QUALITY_GRADIENTS}
    return _differentiated(layout, flat, values, solved, found, unsolved)


def forces(
    layout: Layout,
    positions: Array,
    normals: Array,
    external_wrenches: Array,
    rows: Mapping[str, Array],
    options: Mapping[str, Any],
    *,
    nearest: bool,
) -> Differentiated:
    """Compute least objectives or, if nearest, residuals, with derivatives by `FORCE_GRADIENTS`."""
    kept = dict(options)
    unsolved = kept.pop("unsolved")
    flat, positions, normals, kept = _flattened(layout, positions, normals, rows, kept)
    wrenches = external_wrenches.reshape(flat.given("external_wrenches"))
    answer: Literal["nearest", "status"] = "nearest" if nearest else "status"
    found = forces_many(positions, normals, wrenches, **kept, infeasible=answer, gradient=True)
    gradient = found.distance_gradient if nearest else found.gradient
    assert gradient is not None  # noqa: S101 - it was asked for
    tangents = kept.get("tangents")
    by_normals = _by_given_normals(
        gradient.normals,
        gradient.spins,
        normals[:, None],
        None if tangents is None else np.broadcast_to(tangents, normals.shape)[:, None],
    )
    values = found.distance if nearest else found.sigma
    # Nearest forces whose gap is wide are not converged, but there.
    solved = np.isfinite(found.sigma)
    derivatives = {
        "positions": gradient.positions,
        "normals": by_normals,
        "external_wrenches": gradient.external_wrench,
    }
    return _differentiated(layout, flat, values, solved, derivatives, unsolved)


def _differentiated(
    layout: Layout,
    flat: Layout,
    values: Array,
    solved: NDArray[np.bool_],
    derivatives: Mapping[str, Array],
    unsolved: float,
) -> Differentiated:
    """Bring answers into the shapes of the layout; derivatives are zero where there are none."""
    solved, found = solved.copy(), []
    for name, derivative in derivatives.items():
        # By normals of subnormal length, derivatives lie beyond float64: the row has no answer.
        owners = None if name == "external_wrenches" else flat.owners
        trailing = tuple(range(solved.ndim, derivative.ndim))
        beyond = np.argwhere(~np.isfinite(derivative).all(axis=trailing))
        rows = beyond[:, 0] if owners is None else owners[beyond[:, 0]]
        solved[(rows, *beyond[:, 1:].T)] = False
    for name, derivative in derivatives.items():
        owners = None if name == "external_wrenches" else flat.owners
        known = solved if owners is None else solved[owners]
        known = known.reshape(known.shape + (1,) * (derivative.ndim - known.ndim))
        by = np.where(known, derivative, 0.0)
        if owners is not None and layout.wrenches:
            # The wrenches of each contact of a ragged batch go before the contacts.
            by = np.moveaxis(by.reshape(-1, layout.contacts, *by.shape[1:]), 2, 1)
        found.append(by.reshape(layout.derivative(name)))
    filled = np.where(solved, values, unsolved)
    return Differentiated(filled.reshape(layout.values), solved.reshape(layout.values), tuple(found))


def _flattened(
    layout: Layout, positions: Array, normals: Array, rows: Mapping[str, Array], options: dict[str, Any]
) -> tuple[Layout, Array, Array, dict[str, Any]]:
    """Join the leading dimensions; an option without them belongs to all grasps."""
    flat = layout.flat()
    for name, array in rows.items():
        one = array.ndim < len(layout.given(name)) and layout.offsets is None
        options[name] = (
            array
            if one or not array.ndim
            else np.broadcast_to(array, layout.given(name)).reshape(flat.given(name))
        )
    if layout.offsets is not None:
        # A ragged batch that is none is refused by what reads its offsets.
        options["offsets"] = layout.offsets if prod(layout.leading) == 1 else flat.offsets
        for name in ("edges", "extreme_forces"):
            if not isinstance(options.get(name, 8), (Integral, type(None))):
                options[name] = list(options[name]) * prod(layout.leading)
    return (
        flat,
        positions.reshape(flat.given("positions")),
        normals.reshape(flat.given("normals")),
        options,
    )


def smooth_minimum(
    batch: QualityBatch, smoothing: float, owners: NDArray[np.int64] | None
) -> tuple[Array, dict[str, Array]]:
    """Return the smooth minimum of the supports along critical directions, and its derivatives.

    It is ``-s log(sum_j exp(-v_j / s))`` over the worst direction and all others of the bundle at which the
    support has a local minimum with one gradient. By the envelope theorem, that gradient is the derivative of
    the minimum, although the direction moves.
    """
    bundle = batch.bundle
    assert bundle is not None  # noqa: S101 - it was asked for
    counted = bundle.unique.copy()
    counted[:, 0] = bundle.count > 0
    with np.errstate(all="ignore"):  # rows that are no grasps
        weights = np.where(counted, np.exp((bundle.values[:, :1] - bundle.values) / smoothing), 0.0)
        total = weights.sum(axis=1)
        # From the proven epsilon on, not from the upper end of its bracket.
        values = batch.epsilon - smoothing * np.log(total)
        weights /= total[:, None]
    shares = weights if owners is None else weights[owners]
    return values, {name: np.einsum("rk,rk...->r...", shares, getattr(bundle, name)) for name in _DERIVATIVES}


def _by_given_normals(by_turn: Array, spins: Array, normals: Array, tangents: Array | None) -> Array:
    """Return derivatives by normals of any length, in frames that turn as those of `Grasp` do.

    `by_turn` holds for frames that turn by the smallest rotation. A frame made from the axis a by projection,
    with o = p / |p| and p = a - (a . n) n, also spins: by -(a . n) (t . dn) / |p| rad.
    """
    with np.errstate(all="ignore"):  # rows that are no grasps
        size = np.abs(normals).max(-1, keepdims=True, initial=0.0)
        unit = normals / size
        length = np.linalg.norm(unit, axis=-1, keepdims=True)
        unit = unit / length
        if normals.shape[-1] == 3:
            if tangents is None:
                axis = np.where(np.abs(unit[..., :1]) > 0.7, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
            else:
                axis = tangents / np.linalg.norm(tangents, axis=-1, keepdims=True)
            along = (axis * unit).sum(-1, keepdims=True)
            projected = axis - along * unit
            # t / |p| = n x p / |p|^2
            across = np.cross(unit, projected) / (projected * projected).sum(-1, keepdims=True)
            by_turn = by_turn - spins[..., None] * along * across
        by_normals: Array = by_turn / length / size
    return by_normals
