"""Quality, least forces and residuals as differentiable functions of JAX arrays.

Needs the extra ``jax``. Values come from `graspforce.quality_many` and `graspforce.forces_many`, exact and
in float64. They have the dtype of the positions, with and without ``jax_enable_x64``. ``jit``, ``grad``,
``vmap``, ``jvp`` and ``linearize`` work. There are no second derivatives: asking for them is an error.

All functions take any leading dimensions, also none. The computation is a callback on the CPU, on all its
cores: arrays of another device are copied there, and results are copied back.

An entry without an answer has the value ``unsolved`` and the gradient zero. Other entries do not change. The
``status`` that the functions above return says why.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._internal import differentiable
from graspforce._internal.differentiable import FORCE_GRADIENTS, QUALITY_GRADIENTS, ROWS, row_shape
from graspforce._internal.optional_imports import optional
from graspforce.errors import GraspForceError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from graspforce._internal.differentiable import Differentiated

jax = optional("jax", "jax")
jnp = optional("jax.numpy", "jax")

__all__ = ["least_force", "quality", "residual"]


def quality(
    positions: Any,
    normals: Any,
    *,
    criterion: Literal["max", "sum"] = "max",
    external_wrench: Any = None,
    metric: Any = None,
    rtol: float | None = None,
    max_facets: int | None = None,
    unsolved: float = np.nan,
    **options: Any,
) -> Any:
    """Return the quality epsilon of each grasp.

    Differentiable by positions, normals, ``friction`` and ``max_normal_force``. Where several directions are
    equally bad, the gradient is one of several. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : jax.Array
        (..., m, dim). Normals of any length.
    criterion, external_wrench, metric, rtol, max_facets : optional
        As for `graspforce.Grasp.quality`, the same for all grasps and known when a function is compiled.
    unsolved : float
        Value of rows that are no grasps. Their gradient is zero.
    **options
        ``friction``, ``max_normal_force``, ``torsion``: a number, (m,) or (..., m). ``tangents`` (..., m, 3),
        ``origin`` (..., dim), ``length_scale`` (...). ``edges``, ``friction_margin``, ``extreme_forces``: the
        same for all grasps and known when a function is compiled. All as for `graspforce.Grasp`.

    Returns
    -------
    jax.Array
        (...,) of the dtype of the positions.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        A shape or type is wrong, an argument that all grasps share, or a derivative is asked for that does
        not exist.

    Examples
    --------
    >>> import jax, jax.numpy as jnp
    >>> import graspforce.jax
    >>> positions, normals = jnp.array([[-1.0, 0.1], [1.0, 0.0]]), jnp.array([[1.0, 0.0], [-1.0, 0.0]])
    >>> gradient = jax.grad(graspforce.jax.quality)(positions, normals, friction=0.5)
    >>> bool(gradient[0, 1] < 0)  # lowering the first finger is better
    True
    """
    shared = {
        "criterion": criterion,
        "external_wrench": external_wrench,
        "metric": metric,
        "rtol": rtol,
        "max_facets": max_facets,
        "unsolved": unsolved,
    }

    def compute(moved: list[Any], rows: dict[str, Any], plain: dict[str, Any]) -> Differentiated:
        positions, normals = moved
        return differentiable.quality(positions, normals, rows, plain)

    return _differentiable(compute, QUALITY_GRADIENTS, [positions, normals], shared, options)


def least_force(
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
    unsolved: float = np.nan,
    **options: Any,
) -> Any:
    """Return the least objective of the contact forces that balance each external wrench.

    Differentiable by positions, normals and wrenches. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : jax.Array
        (..., m, dim). Normals of any length.
    external_wrenches : jax.Array
        (..., K, d) for each grasp, or (K, d) for all.
    objective, weight, min_normal, rtol, reference, weights, slack, limits : optional
        As for `graspforce.ForceDistributor`, the same for all grasps and known when a function is compiled.
    unsolved : float
        Value where no forces balance the wrench, or the row is no grasp. The gradient there is zero;
        `residual` leads to balance.
    **options
        As for `quality`; derivatives by ``friction`` and ``max_normal_force`` do not exist.

    Returns
    -------
    jax.Array
        (..., K) of the dtype of the positions.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        As for `quality`.

    Examples
    --------
    >>> import jax.numpy as jnp
    >>> import graspforce.jax
    >>> positions, normals = jnp.array([[-1.0, 0], [1, 0]]), jnp.array([[1.0, 0], [-1, 0]])
    >>> weights = jnp.array([[0.0, -1, 0], [0, -3, 0]])
    >>> graspforce.jax.least_force(positions, normals, weights, friction=0.5).tolist()
    [1.0, 3.0]
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
    return _forces([positions, normals, external_wrenches], shared, options, nearest=False)


def residual(
    positions: Any,
    normals: Any,
    external_wrenches: Any,
    *,
    metric: Any = None,
    rtol: float = 1e-9,
    unsolved: float = np.nan,
    **options: Any,
) -> Any:
    """Return how far forces within their limits stay from balancing each external wrench.

    It is zero where the forces balance the wrench, and so is its gradient. Differentiable by positions,
    normals and wrenches. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : jax.Array
        (..., m, dim). Normals of any length.
    external_wrenches : jax.Array
        (..., K, d) for each grasp, or (K, d) for all.
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
    jax.Array
        (..., K) norm of the unbalanced wrench, in N, of the dtype of the positions.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        As for `quality`.

    Examples
    --------
    Two fingers of at most 1 N and friction 0.5 hold 1 N of a weight of 3 N:

    >>> import jax.numpy as jnp
    >>> import graspforce.jax
    >>> positions, normals = jnp.array([[-1.0, 0], [1, 0]]), jnp.array([[1.0, 0], [-1, 0]])
    >>> weights = jnp.array([[0.0, -1, 0], [0, -3, 0]])
    >>> graspforce.jax.residual(positions, normals, weights, friction=0.5).round(6).tolist()
    [0.0, 2.0]
    """
    shared = {"metric": metric, "rtol": rtol, "unsolved": unsolved}
    return _forces([positions, normals, external_wrenches], shared, options, nearest=True)


def _forces(moved: list[Any], shared: dict[str, Any], options: dict[str, Any], *, nearest: bool) -> Any:
    def compute(moved: list[Any], rows: dict[str, Any], plain: dict[str, Any]) -> Differentiated:
        positions, normals, wrenches = moved
        return differentiable.forces(positions, normals, wrenches, rows, plain, nearest=nearest)

    return _differentiable(compute, FORCE_GRADIENTS, moved, shared, options)


def _differentiable(
    compute: Callable[[list[Any], dict[str, Any], dict[str, Any]], Differentiated],
    gradients: Sequence[str],
    given: list[Any],
    shared: dict[str, Any],
    options: dict[str, Any],
) -> Any:
    """Compute values whose derivatives by the arguments named in `gradients` JAX knows."""
    moved, leading, dtype = _moved(given)
    contacts, dim = moved[0].shape[-2:]
    wrenches = moved[2].shape[-2:] if len(moved) == 3 else ()
    rows, constants = _rows(options, leading, contacts, dim)
    for name, array in rows.items():
        if name not in gradients:
            rows[name] = _constant(name, array)
    names = (*gradients[: len(moved)], *rows)
    plain = {**{name: value for name, value in options.items() if name not in ROWS}, **shared}
    plain = {name: value for name, value in plain.items() if value is not None or name == "edges"}

    # An empty batch finds mistakes in what all grasps share: JAX hides the types of errors in callbacks.
    empty = {name: np.zeros((0, *row_shape(name, contacts, dim))) for name in rows}
    compute([np.zeros((0, *array.shape[-2:])) for array in moved], {**constants, **empty}, plain)

    def on_host(*arrays: Any) -> tuple[Any, ...]:
        arrays = tuple(np.asarray(array).astype(np.float64) for array in arrays)
        by_row = dict(zip(rows, arrays[len(moved) :], strict=True))
        found = compute(list(arrays[: len(moved)]), {**constants, **by_row}, plain)
        kept = [by for name, by in zip(gradients, found.derivatives, strict=True) if name in names]
        return found.values.astype(dtype), found.solved, *(by.astype(dtype) for by in kept)

    values = (*leading, *wrenches[:1])
    shapes = [jax.ShapeDtypeStruct(values, dtype), jax.ShapeDtypeStruct(values, np.bool_)]
    for name in gradients:
        if name in names:
            trailing = {
                "positions": (contacts, dim),
                "normals": (contacts, dim),
                "external_wrenches": wrenches[1:],
            }
            shapes.append(jax.ShapeDtypeStruct((*values, *trailing.get(name, (contacts,))), dtype))

    @jax.custom_jvp  # type: ignore[untyped-decorator]
    def differentiated(*arguments: Any) -> Any:
        return tuple(jax.pure_callback(on_host, tuple(shapes), *arguments, vmap_method="broadcast_all"))

    @differentiated.defjvp  # type: ignore[untyped-decorator]
    def refused(_primals: Any, _tangents: Any) -> Any:
        raise GraspForceError(
            "graspforce.jax has no second derivatives: use jax.lax.stop_gradient on the first one"
        )

    @jax.custom_jvp  # type: ignore[untyped-decorator]
    def value(*arguments: Any) -> Any:
        return differentiated(*arguments)[0]

    @value.defjvp  # type: ignore[untyped-decorator]
    def tangent(primals: Any, tangents: Any) -> Any:
        found, solved, *derivatives = differentiated(*primals)
        total = jnp.zeros_like(found)
        by_name = dict(zip(names, tangents, strict=True))
        for name, derivative in zip((name for name in gradients if name in names), derivatives, strict=True):
            change = by_name[name].astype(dtype)
            if wrenches and name != "external_wrenches":
                change = change[..., None, :, :]  # the K wrenches of a grasp share its contacts
            axes = tuple(range(found.ndim, derivative.ndim))
            total = total + (derivative * change).sum(axes)
        # What is no answer passes nothing on, not even NaN.
        return found, jnp.where(solved, total, 0)

    return value(*moved, *rows.values())


def _moved(given: list[Any]) -> tuple[list[Any], tuple[int, ...], Any]:
    """Arrays of one floating-point dtype and the same leading dimensions."""
    arrays = [jnp.asarray(value) for value in given]
    for name, array in zip(("positions", "normals", "external_wrenches"), arrays, strict=False):
        if array.ndim < 2:
            raise InvalidInputError(f"{name}: shape {array.shape} where at least two dimensions are needed")
    dtype = jnp.result_type(*arrays)
    if not jnp.issubdtype(dtype, jnp.floating):
        dtype = jnp.result_type(float)
    leading = jnp.broadcast_shapes(*(array.shape[:-2] for array in arrays))
    moved = [jnp.broadcast_to(array.astype(dtype), leading + array.shape[-2:]) for array in arrays]
    return moved, leading, dtype


def _rows(
    options: dict[str, Any], leading: tuple[int, ...], contacts: int, dim: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options of each grasp as arrays of JAX, and those of all grasps as they are."""
    rows, constants = {}, {}
    for name in ROWS:
        value = options.get(name)
        if value is None:
            continue
        shape = row_shape(name, contacts, dim)
        if isinstance(value, jax.Array) or np.ndim(value) > len(shape):
            rows[name] = jnp.broadcast_to(jnp.asarray(value, dtype=float), leading + shape)
        else:
            constants[name] = np.asarray(value, dtype=np.float64)
    return rows, constants


def _constant(name: str, array: Any) -> Any:
    """Return an array that must not be differentiated by."""

    @jax.custom_jvp  # type: ignore[untyped-decorator]
    def constant(value: Any) -> Any:
        return value

    @constant.defjvp  # type: ignore[untyped-decorator]
    def refused(_primals: Any, _tangents: Any) -> Any:
        raise InvalidInputError(f"{name}: no derivatives by it; pass jax.lax.stop_gradient({name})")

    return constant(array)
