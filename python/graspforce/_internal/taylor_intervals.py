"""Intervals that hold a function's value and its first two derivatives along a line, everywhere in a box.

Formulas of `graspforce.surfaces` run on them as they run on arrays. The second derivatives bound by how much
a function departs from its values at the corners of the box. Each operation rounds outward: the intervals
hold what exact arithmetic gives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar
from weakref import WeakSet

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]
    Interval = tuple[Array, Array]

_F = TypeVar("_F", bound="Callable[..., Any]")
_FORMULAS: WeakSet[Any] = WeakSet()
_EPS = float(np.finfo(float).eps)
_ROUNDED_DIRECTION = 4e-15  # more than a quotient, a root and the squares beneath it are rounded by


def formula(function: _F) -> _F:
    """Mark a function of parameters as one that runs on Taylor intervals, too."""
    _FORMULAS.add(function)
    return function


def is_formula(function: object) -> bool:
    """Whether a function, or the function of a `functools.partial`, is marked as a formula."""
    inner = getattr(function, "func", function)
    return callable(inner) and inner in _FORMULAS


class TaylorIntervals(NDArrayOperatorsMixin):
    """An array of intervals of (value, first derivative, second derivative).

    Attributes
    ----------
    low, high : numpy.ndarray
        (3, ...) ends of the intervals.
    """

    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high = low, high

    @classmethod
    def of(cls, value: TaylorIntervals | ArrayLike) -> TaylorIntervals:
        """Return the intervals of a constant; intervals stay as they are."""
        if isinstance(value, TaylorIntervals):
            return value
        given = np.asarray(value, dtype=np.float64)
        ends = np.stack([given, np.zeros_like(given), np.zeros_like(given)])
        return cls(ends, ends)

    @classmethod
    def on_line(cls, low: Array, high: Array, direction: Array) -> TaylorIntervals:
        """Return the parameters of boxes (B, p) that move along a direction (p,) or (B, p)."""
        rate = np.broadcast_to(direction, low.shape)
        zero = np.zeros_like(low)
        return cls(np.stack([low, rate, zero]), np.stack([high, rate, zero]))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array, without the derivatives."""
        return self.low.shape[1:]

    @property
    def ndim(self) -> int:
        """Number of its dimensions."""
        return self.low.ndim - 1

    @property
    def T(self) -> TaylorIntervals:  # noqa: N802 - as of an array
        """The array with its dimensions reversed."""
        order = (0, *range(self.ndim, 0, -1))
        return TaylorIntervals(self.low.transpose(order), self.high.transpose(order))

    def __len__(self) -> int:
        return self.shape[0]

    def __iter__(self) -> Iterator[TaylorIntervals]:
        return (self[at] for at in range(len(self)))

    def __getitem__(self, where: Any) -> TaylorIntervals:
        inner = (slice(None), *(where if isinstance(where, tuple) else (where,)))
        return TaylorIntervals(self.low[inner], self.high[inner])

    def __array__(self, *_: object, **__: object) -> Array:
        raise TypeError("intervals are no array of numbers")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        function = _UFUNCS.get(ufunc)
        if function is None or method != "__call__" or options:
            return NotImplemented
        with np.errstate(all="ignore"):
            return function(*inputs)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        function = _FUNCTIONS.get(func)
        return NotImplemented if function is None else function(*args, **kwargs)

    @property
    def coefficients(self) -> list[Interval]:
        """Value, first and second derivative, each as (low, high)."""
        return [(self.low[order], self.high[order]) for order in range(3)]

    @property
    def second(self) -> Interval:
        """The second derivatives."""
        return self.low[2], self.high[2]

    def unit(self) -> TaylorIntervals:
        """Return the vectors along the last axis divided by their lengths.

        With length r, direction u and derivatives of the vector N: ``u' = (N' - u r') / r`` and
        ``u'' = (N'' - 2 u' r' - u r'') / r``, where ``r' = u . N'`` and ``r'' = |u'|^2 r + u . N''``. These
        forms keep the intervals narrow.
        """
        with np.errstate(all="ignore"):
            value, first, second = self.coefficients
            own = _square(value)
            squares = _total(own)
            length = _outward(np.sqrt(squares[0])[..., None], np.sqrt(squares[1])[..., None])
            inverse = _outward(1 / length[1], np.where(length[0] > 0, 1 / length[0], np.inf))
            # Of each component's square, the others' squares are known apart from its own.
            others = [_others(end) for end in own]
            sides = zip(value, (others, others[::-1]), (-1, 1), strict=True)
            direction = tuple(
                np.clip(
                    end / np.sqrt(np.square(end) + np.where(end < 0, *swap)) + side * _ROUNDED_DIRECTION,
                    -1,
                    1,
                )
                for end, swap, side in sides
            )
            rate = _spread(_total(_times(direction, first)))
            turn = _times(_minus(first, _times(direction, rate)), inverse)
            bend = _plus(
                _times(_spread(_total(_square(turn))), length), _spread(_total(_times(direction, second)))
            )
            twice = _scaled(_times(turn, rate), 2.0)
            turned = _times(_minus(_minus(second, twice), _times(direction, bend)), inverse)
        return _joined([direction, turn, turned])

    def largest(self, order: int) -> Array:
        """Return upper bounds of the absolute values; infinite where nothing is known."""
        ends = np.maximum(np.abs(self.low[order]), np.abs(self.high[order]))
        return np.where(np.isnan(ends), np.inf, ends)


def real_numbers(values: Any) -> Any:
    """Return values as an array of float64; intervals stay as they are."""
    return values if isinstance(values, TaylorIntervals) else np.asarray(values, dtype=np.float64)


# Intervals: pairs of arrays.
def _outward(low: Array, high: Array) -> Interval:
    """Widen by the rounding of one operation; zeros are exact, or too small to matter."""
    return low - _EPS * np.abs(low), high + _EPS * np.abs(high)


def _times(a: Interval, b: Interval) -> Interval:
    ends = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]]
    return _outward(np.minimum.reduce(ends), np.maximum.reduce(ends))


def _plus(first: Interval, *others: Interval) -> Interval:
    for other in others:
        first = _outward(first[0] + other[0], first[1] + other[1])
    return first


def _minus(a: Interval, b: Interval) -> Interval:
    return _outward(a[0] - b[1], a[1] - b[0])


def _total(a: Interval) -> Interval:
    return _plus(*((a[0][..., at], a[1][..., at]) for at in range(a[0].shape[-1])))


def _others(squares: Array) -> Array:
    """For each component, the sum of the others."""
    components = range(squares.shape[-1])
    sums = [sum(squares[..., at] for at in components if at != own) for own in components]
    return np.stack(sums, axis=-1) if len(sums) > 1 else np.zeros_like(squares)


def _spread(a: Interval) -> Interval:
    return a[0][..., None], a[1][..., None]


def _scaled(a: Interval, factor: float) -> Interval:
    return _outward(*((factor * a[0], factor * a[1]) if factor >= 0 else (factor * a[1], factor * a[0])))


def _constant(a: Interval, value: float) -> Interval:
    full = np.full_like(a[0], value)
    return full, full


def _square(a: Interval) -> Interval:
    low, high = np.square(a[0]), np.square(a[1])
    inside = (a[0] <= 0) & (a[1] >= 0)
    return _outward(np.where(inside, 0.0, np.minimum(low, high)), np.maximum(low, high))


def _power(a: Interval, exponent: int) -> Interval:
    if exponent == 0:
        return _constant(a, 1.0)
    low, high = a if exponent % 2 else _square(a)
    low, high = (end ** (exponent if exponent % 2 else exponent // 2) for end in (low, high))
    rounded = 2 * exponent * _EPS
    return low - rounded * np.abs(low), high + rounded * np.abs(high)


def _cosine(a: Interval) -> Interval:
    turn, room = 2 * np.pi, 1e-12 * (1 + np.abs(a[0]) + np.abs(a[1]))
    ends = np.cos(a[0]), np.cos(a[1])

    def passes(phase: float) -> NDArray[np.bool_]:
        first, last = (a[0] - phase - room) / turn, (a[1] - phase + room) / turn
        return np.floor(last) >= np.ceil(first)

    # Of the functions of NumPy, which are off by a few units in the last place, and of the phase of a sine.
    rounded = 8 * _EPS * (1 + np.maximum(np.abs(a[0]), np.abs(a[1])))
    low = np.where(passes(np.pi), -1.0, np.maximum(np.minimum(*ends) - rounded, -1.0))
    return low, np.where(passes(0.0), 1.0, np.minimum(np.maximum(*ends) + rounded, 1.0))


def _sine(a: Interval) -> Interval:
    return _cosine((a[0] - np.pi / 2, a[1] - np.pi / 2))


# Taylor intervals.
def _joined(parts: Sequence[Interval]) -> TaylorIntervals:
    return TaylorIntervals(np.stack([part[0] for part in parts]), np.stack([part[1] for part in parts]))


def _composed(inner: TaylorIntervals, *derivatives: Callable[[Interval], Interval]) -> TaylorIntervals:
    """Return a function of one number, by its range and those of its first two derivatives."""
    value, first, second = inner.coefficients
    of, slope, bend = (derivative(value) for derivative in derivatives)
    return _joined([of, _times(slope, first), _plus(_times(bend, _square(first)), _times(slope, second))])


def _pair(one: Any, other: Any) -> tuple[TaylorIntervals, TaylorIntervals]:
    pair = [TaylorIntervals.of(one), TaylorIntervals.of(other)]
    most = max(each.ndim for each in pair)
    shapes = [(3, *(1,) * (most - each.ndim), *each.shape) for each in pair]
    whole = np.broadcast_shapes(*shapes)
    first, second = (
        TaylorIntervals(*(np.broadcast_to(end.reshape(shape), whole) for end in (each.low, each.high)))
        for each, shape in zip(pair, shapes, strict=True)
    )
    return first, second


def _sum(one: Any, other: Any) -> TaylorIntervals:
    a, b = _pair(one, other)
    return TaylorIntervals(*_outward(a.low + b.low, a.high + b.high))


def _negative(one: TaylorIntervals) -> TaylorIntervals:
    return TaylorIntervals(-one.high, -one.low)


def _difference(one: Any, other: Any) -> TaylorIntervals:
    return _sum(one, _negative(TaylorIntervals.of(other)))


def _product(one: Any, other: Any) -> TaylorIntervals:
    a, b = (each.coefficients for each in _pair(one, other))
    return _joined(
        [
            _times(a[0], b[0]),
            _plus(_times(a[1], b[0]), _times(a[0], b[1])),
            _plus(_times(a[2], b[0]), _scaled(_times(a[1], b[1]), 2.0), _times(a[0], b[2])),
        ]
    )


def _raised(one: TaylorIntervals, exponent: Any) -> Any:
    if not isinstance(exponent, int) or exponent < 1:
        return NotImplemented
    return _composed(
        one,
        lambda x: _power(x, exponent),
        lambda x: _scaled(_power(x, exponent - 1), exponent),
        lambda x: _scaled(_power(x, max(exponent - 2, 0)), exponent * (exponent - 1)),
    )


def _cosines(one: TaylorIntervals) -> TaylorIntervals:
    return _composed(one, _cosine, lambda x: _scaled(_sine(x), -1.0), lambda x: _scaled(_cosine(x), -1.0))


def _sines(one: TaylorIntervals) -> TaylorIntervals:
    return _composed(one, _sine, _cosine, lambda x: _scaled(_sine(x), -1.0))


def _linear(one: Any, matrix: Any) -> Any:
    """Return intervals times a matrix or a vector of numbers."""
    if not isinstance(one, TaylorIntervals) or isinstance(matrix, TaylorIntervals):
        return NotImplemented
    above, below = np.maximum(matrix, 0), np.minimum(matrix, 0)
    low, high = one.low @ above + one.high @ below, one.high @ above + one.low @ below
    rounded = 8 * _EPS * (np.maximum(np.abs(one.low), np.abs(one.high)) @ np.abs(matrix))
    return TaylorIntervals(low - rounded, high + rounded)


def _stacked(function: Callable[..., Array]) -> Callable[..., TaylorIntervals]:
    def join(parts: Sequence[Any], axis: int = 0) -> TaylorIntervals:
        each = [TaylorIntervals.of(part) for part in parts]
        inner = axis if axis < 0 else axis + 1
        ends = ([part.low for part in each], [part.high for part in each])
        return TaylorIntervals(*(function(end, axis=inner) for end in ends))

    return join


def _split(whole: TaylorIntervals, places: Any, axis: int = 0) -> list[TaylorIntervals]:
    inner = axis if axis < 0 else axis + 1
    ends = (np.split(end, places, axis=inner) for end in (whole.low, whole.high))
    return [TaylorIntervals(low, high) for low, high in zip(*ends, strict=True)]


def _moved(whole: TaylorIntervals, source: int, destination: int) -> TaylorIntervals:
    places = [at if at < 0 else at + 1 for at in (source, destination)]
    places[1] = places[1] if destination else 1
    return TaylorIntervals(np.moveaxis(whole.low, *places), np.moveaxis(whole.high, *places))


_UFUNCS: dict[Any, Callable[..., Any]] = {
    np.add: _sum,
    np.subtract: _difference,
    np.multiply: _product,
    np.negative: _negative,
    np.power: _raised,
    np.cos: _cosines,
    np.sin: _sines,
    np.matmul: _linear,
}
_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.stack: _stacked(np.stack),
    np.concatenate: _stacked(np.concatenate),
    np.split: _split,
    np.moveaxis: _moved,
    np.shape: lambda whole: whole.shape,
    np.ones_like: lambda whole: np.ones(whole.shape),
    np.zeros_like: lambda whole: np.zeros(whole.shape),
    np.full_like: lambda whole, value: np.full(whole.shape, value),
}
