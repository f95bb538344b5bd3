"""Checks of the fields of a pickle or a copy, before a result is made of them.

Each class of results has a method ``_check`` that calls these functions. They raise `InvalidInputError` for a
record that contradicts itself. The results of the extension module check theirs in Rust.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp, Quality
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from graspforce.typing import SearchResult


def expect(holds: object, field: str, expected: str) -> None:
    """Refuse a record unless the condition holds."""
    if not holds:
        raise InvalidInputError(f"state: {field}, expected {expected}")


def expect_instance(field: str, value: object, kind: type) -> None:
    """Refuse what is not exactly of a class."""
    expect(type(value) is kind, field, f"an instance of {kind.__name__}")


def expect_tuple(field: str, value: object, kind: type) -> None:
    """Refuse what is not a tuple of instances of one class."""
    expect(type(value) is tuple and all(type(item) is kind for item in value), field, f"{kind.__name__}s")


def expect_number(field: str, value: Any, *, least: float = -math.inf, finite: bool = True) -> None:
    """Refuse what is not a float of at least `least`; infinity only where it has a meaning."""
    expect(isinstance(value, float) and not math.isnan(value), field, "a number")
    expect(value >= least and (math.isfinite(value) or not finite), field, f"a number from {least:g}")


def expect_search_result(result: SearchResult) -> None:
    """Refuse a result of a search whose parameters, grasp and quality do not belong together."""
    expect_array("params", result.params, (None,))
    expect_instance("grasp", result.grasp, Grasp)
    expect_instance("quality", result.quality, Quality)
    expect(result.quality.grasp == result.grasp, "quality", "that of the grasp")


def expect_whole(field: str, value: Any) -> None:
    """Refuse what is not a count."""
    expect(type(value) is int and value >= 0, field, "a whole number from 0")


def expect_array(
    field: str, value: Any, shape: tuple[int | None, ...], *, kind: type = np.float64, finite: bool = True
) -> None:
    """Refuse what is not an array of this shape, where None stands for any length, and of this kind."""
    expect(isinstance(value, np.ndarray) and value.dtype == kind, field, f"an array of {kind.__name__}")
    fits = value.ndim == len(shape) and all(
        wanted is None or wanted == size for wanted, size in zip(shape, value.shape, strict=True)
    )
    expect(fits, field, f"the shape {shape}")
    expect(not finite or np.isfinite(value).all(), field, "finite numbers")
