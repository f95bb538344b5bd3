"""Quality, least forces and residuals as differentiable functions, whatever the library of their arrays.

`graspforce.torch` and `graspforce.jax` are these functions for tensors and for arrays of JAX.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._internal.differentiable import (
    FORCE_GRADIENTS,
    QUALITY_GRADIENTS,
    ROWS,
    Differentiated,
    Layout,
    forces,
    quality,
)
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["DifferentiableFunctions", "Question"]

_NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Question:
    """One call: the shapes of its arrays, what to differentiate by, and the options that all grasps share."""

    layout: Layout
    gradients: tuple[str, ...]
    shared: Mapping[str, Any]
    nearest: bool = False

    def compute(self, arrays: Mapping[str, Any], layout: Layout | None = None) -> Differentiated:
        """Compute with arrays of NumPy, by argument; a given layout has more leading dimensions."""
        layout = layout or self.layout
        rows = {name: arrays[name] for name in ROWS if name in arrays}
        contacts = arrays["positions"], arrays["normals"]
        if self.gradients is QUALITY_GRADIENTS:
            return quality(layout, *contacts, rows, self.shared)
        wrenches = arrays["external_wrenches"]
        return forces(layout, *contacts, wrenches, rows, self.shared, nearest=self.nearest)


class DifferentiableFunctions(ABC):
    """The functions; a subclass knows the arrays of a library."""

    def quality(
        self,
        positions: Any,
        normals: Any,
        *,
        criterion: Literal["max", "sum"] = "max",
        external_wrench: Any = None,
        metric: Any = None,
        rtol: float | None = None,
        max_facets: int | None = None,
        smoothing: float = 0.0,
        offsets: Any = None,
        unsolved: float = _NAN,
        **options: Any,
    ) -> Any:
        """Return the quality epsilon of each grasp.

        Differentiable by positions, normals, ``friction`` and ``max_normal_force``. Where several directions
        are equally bad, the gradient is one of several, unless ``smoothing`` mixes them. Safe to call from
        several threads.

        Parameters
        ----------
        positions, normals : array
            (..., m, dim) arrays of the library, (..., N, dim) beside ``offsets``. Normals of any length.
        criterion, external_wrench, metric, rtol, max_facets : optional
            As for `graspforce.Grasp.quality`, the same for all grasps.
        smoothing : float
            Scale s in N of a smooth minimum in place of epsilon, ``-s log(sum_j exp(-v_j / s))``. Zero, the
            default, is epsilon itself. The ``v_j`` are the supports along n directions: the worst one, and
            further local minima of the support among the 16 most critical directions. A local minimum with
            several gradients does not count. The value lies between ``epsilon - s log(n)`` and ``epsilon``.
            So it never flatters a grasp, and the error is at most 2.78 s. The gradient mixes those of the
            directions. A grasp that is not closed has one direction: its value is epsilon. The value jumps
            within the bound where a direction joins or leaves the minimum.
        offsets : array_like, optional
            (B + 1,) for grasps of different numbers of contacts, as for `graspforce.quality_many`.
        unsolved : float
            Value of rows that are no grasps. Their gradient is zero.
        **options
            ``friction``, ``max_normal_force``, ``torsion``: a number, (m,) or (..., m). ``tangents``
            (..., m, 3), ``origin`` (..., dim), ``length_scale`` (...). ``edges``, ``friction_margin``,
            ``extreme_forces``: the same for all grasps. All as for `graspforce.Grasp`. Beside ``offsets``,
            options of contacts have N in place of m, those of grasps are (..., B), and ``edges`` and
            ``extreme_forces`` may have one entry for each of the N contacts.

        Returns
        -------
        array
            (...,) or, beside ``offsets``, (..., B); of the dtype of the positions, where they are.

        Raises
        ------
        InvalidGraspError, InvalidInputError
            A shape or type is wrong, an argument that all grasps share, or a derivative is asked for that
            does not exist.
        """
        if not isinstance(smoothing, Real) or not 0 <= smoothing < inf:
            raise InvalidInputError(f"smoothing: {smoothing!r} where a force in N, at least 0, is needed")
        shared = {
            "criterion": criterion,
            "external_wrench": external_wrench,
            "metric": metric,
            "rtol": rtol,
            "max_facets": max_facets,
            "smoothing": smoothing,
            "unsolved": unsolved,
        }
        given = {"positions": positions, "normals": normals}
        return self._answer(QUALITY_GRADIENTS, given, shared, options, offsets)

    def least_force(
        self,
        positions: Any,
        normals: Any,
        external_wrenches: Any,
        *,
        objective: Literal["max", "sum", "squares"] = "max",
        weight: float = 0.0,
        min_normal: Any = None,
        rtol: float = 1e-9,
        reference: Any = None,
        weights: Any = None,
        slack: Any = None,
        limits: bool = False,
        offsets: Any = None,
        unsolved: float = _NAN,
        **options: Any,
    ) -> Any:
        """Return the least objective of the contact forces that balance each external wrench.

        Differentiable by positions, normals and wrenches. Safe to call from several threads.

        Parameters
        ----------
        positions, normals, offsets
            As for `quality`.
        external_wrenches : array
            (..., K, d) for each grasp, or (K, d) for all; (..., B, K, d) for each beside ``offsets``.
        objective, weight, min_normal, rtol, reference, weights, slack, limits : optional
            As for `graspforce.ForceDistributor`, the same for all grasps.
        unsolved : float
            Value where no forces balance the wrench, or the row is no grasp. The gradient there is zero;
            `residual` leads to balance.
        **options
            As for `quality`; derivatives by ``friction`` and ``max_normal_force`` do not exist.

        Returns
        -------
        array
            (..., K) of the dtype of the positions, where they are.

        Raises
        ------
        InvalidGraspError, InvalidInputError
            As for `quality`.
        """
        shared = {
            "objective": objective,
            "weight": weight,
            "min_normal": min_normal,
            "rtol": rtol,
            "reference": reference,
            "weights": weights,
            "slack": slack,
            "limits": limits,
            "unsolved": unsolved,
        }
        given = {"positions": positions, "normals": normals, "external_wrenches": external_wrenches}
        return self._answer(FORCE_GRADIENTS, given, shared, options, offsets)

    def residual(
        self,
        positions: Any,
        normals: Any,
        external_wrenches: Any,
        *,
        metric: Any = None,
        rtol: float = 1e-9,
        offsets: Any = None,
        unsolved: float = _NAN,
        **options: Any,
    ) -> Any:
        """Return how far forces within their limits stay from balancing each external wrench.

        It is zero where the forces balance the wrench, and so is its gradient. Differentiable by positions,
        normals and wrenches. Safe to call from several threads.

        Parameters
        ----------
        positions, normals, external_wrenches, offsets
            As for `least_force`.
        metric : optional
            (d, d) of the norm; else that of ``length_scale``.
        rtol : float
            As for `graspforce.ForceDistributor`.
        unsolved : float
            Value of rows that are no grasps. Their gradient is zero.
        **options
            As for `least_force`.

        Returns
        -------
        array
            (..., K) norm of the unbalanced wrench, in N, of the dtype of the positions, where they are.

        Raises
        ------
        InvalidGraspError, InvalidInputError
            As for `quality`.
        """
        shared = {"metric": metric, "rtol": rtol, "unsolved": unsolved}
        given = {"positions": positions, "normals": normals, "external_wrenches": external_wrenches}
        return self._answer(FORCE_GRADIENTS, given, shared, options, offsets, nearest=True)

    def _answer(
        self,
        gradients: tuple[str, ...],
        given: dict[str, Any],
        shared: dict[str, Any],
        options: dict[str, Any],
        offsets: Any,
        *,
        nearest: bool = False,
    ) -> Any:
        for name in options:
            if name not in (*ROWS, "edges", "friction_margin", "extreme_forces"):
                raise TypeError(f"unexpected argument {name!r}")
        arrays = self._arrays(given)
        for name, array in arrays.items():
            if array.ndim < 2:
                shape = tuple(array.shape)
                raise InvalidInputError(f"{name}: shape {shape} where at least two dimensions are needed")
        layout = _layout(arrays, offsets)
        moved = {name: self._expanded(name, array, layout.given(name)) for name, array in arrays.items()}
        rows = {}
        for name in ROWS:
            value = options.pop(name, {"friction": 0.5, "max_normal_force": 1.0}.get(name))
            if value is None:
                continue
            constant = value if self._is_array(value) else self._constant(value)
            if constant is value or constant.ndim > layout.trailing(name):
                constant = self._expanded(name, constant, layout.given(name))
            rows[name] = constant
        return self._call(Question(layout, gradients, {**options, **shared}, nearest), moved, rows)

    @abstractmethod
    def _arrays(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return arrays of the library, of one floating-point dtype."""

    @abstractmethod
    def _is_array(self, value: Any) -> bool:
        """Return whether this is an array of the library."""

    @abstractmethod
    def _constant(self, value: Any) -> Any:
        """Return an option that is no array of the library as float64."""

    @abstractmethod
    def _broadcast(self, array: Any, shape: tuple[int, ...]) -> Any:
        """Return the array in a shape of more leading dimensions."""

    @abstractmethod
    def _call(self, question: Question, moved: dict[str, Any], rows: dict[str, Any]) -> Any:
        """Return the values."""

    def _expanded(self, name: str, array: Any, shape: tuple[int, ...]) -> Any:
        try:
            return self._broadcast(array, shape)
        except (ValueError, RuntimeError) as error:
            raise InvalidInputError(f"{name}: shape {tuple(array.shape)}, expected {shape}") from error


def _starts(offsets: Any, contacts: int) -> tuple[int, ...] | None:
    """Return offsets as whole numbers."""
    if offsets is None:
        return None
    # What torch.compile traces must not pass through NumPy.
    listed = offsets if isinstance(offsets, (list, tuple)) else np.asarray(offsets).tolist()
    if (
        not isinstance(listed, (list, tuple))
        or not listed
        or not all(isinstance(n, Integral) for n in listed)
    ):
        raise InvalidInputError("offsets: expected (B + 1,) whole numbers")
    starts = tuple(int(start) for start in listed)
    for entry, (least, offset) in enumerate(zip((0, *starts), starts, strict=False)):
        most = 0 if entry == 0 else contacts
        if not least <= offset <= most or (entry == len(starts) - 1 and offset != contacts):
            expected = f"{contacts}, the number of contacts" if entry else "0"
            expected = f"at least {least}, the one before" if offset < least else expected
            raise InvalidInputError(f"offsets, entry {entry}: {offset}, expected {expected}")
    return starts


def _layout(arrays: Mapping[str, Any], offsets: Any) -> Layout:
    """Return the shapes that arrays of any leading dimensions have in common."""
    contacts, dim = arrays["positions"].shape[-2:]
    starts = _starts(offsets, contacts)
    wrenches: tuple[int, ...] = ()
    leading = [tuple(arrays[name].shape[:-2]) for name in ("positions", "normals")]
    if "external_wrenches" in arrays:
        *others, count, size = arrays["external_wrenches"].shape
        wrenches = (count, size)
        leading.append(tuple(others if starts is None else others[:-1]))
    common = leading[0]
    for other in leading[1:]:
        common = _common(common, other)
    return Layout(common, contacts, dim, wrenches, starts)


def _common(one: tuple[int, ...], other: tuple[int, ...]) -> tuple[int, ...]:
    """Return leading dimensions to which both can be broadcast."""
    size = max(len(one), len(other))
    pairs = list(zip((1,) * (size - len(one)) + one, (1,) * (size - len(other)) + other, strict=True))
    if any(1 not in pair and pair[0] != pair[1] for pair in pairs):
        raise InvalidInputError(f"leading dimensions {one} and {other} do not fit together")
    return tuple(second if first == 1 else first for first, second in pairs)
