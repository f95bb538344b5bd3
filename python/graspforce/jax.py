"""Quality, least forces and residuals as differentiable functions of JAX arrays.

Needs the extra ``jax``. Values come from `graspforce.quality_many` and `graspforce.forces_many`, exact and
in float64. They have the dtype of the positions, with and without ``jax_enable_x64``. ``jit``, ``grad``,
``vmap``, ``jvp`` and ``linearize`` work. There are no second derivatives: asking for them is an error.

All functions take any leading dimensions, also none. The computation is a callback on the CPU, on all its
cores: arrays of another device are copied there, and results are copied back. Options that all grasps share
are known when a function is compiled.

An entry without an answer has the value ``unsolved`` and the gradient zero. Other entries do not change. The
``status`` that the functions above return says why.

Examples
--------
>>> import jax, jax.numpy as jnp
>>> import graspforce.jax
>>> positions, normals = jnp.array([[-1.0, 0.1], [1.0, 0.0]]), jnp.array([[1.0, 0.0], [-1.0, 0.0]])
>>> gradient = jax.grad(graspforce.jax.quality)(positions, normals, friction=0.5)
>>> bool(gradient[0, 1] < 0)  # lowering the first finger is better
True

Two opposite fingers of friction 0.5 lift a disc of 1 N, and one of 3 N. Each contact presses with the weight:

>>> positions = jnp.array([[-1.0, 0], [1, 0]])
>>> weights = jnp.array([[0.0, -1, 0], [0, -3, 0]])
>>> graspforce.jax.least_force(positions, normals, weights, friction=0.5).round(6).tolist()
[1.0, 3.0]
>>> def total(weights):
...     return graspforce.jax.least_force(positions, normals, weights, friction=0.5).sum()
>>> jax.grad(total)(weights)[:, 1].round(6).tolist()
[-1.0, -1.0]

With at most 1 N each they hold 1 N of the 3 N:

>>> unbalanced = graspforce.jax.residual(positions, normals, weights, friction=0.5)
>>> unbalanced.round(6).tolist()
[0.0, 2.0]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.differentiable import Layout
from graspforce._internal.differentiable_functions import DifferentiableFunctions, Question
from graspforce._internal.optional_imports import optional
from graspforce.errors import GraspForceError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Mapping

jax = optional("jax", "jax")
jnp = optional("jax.numpy", "jax")

__all__ = ["least_force", "quality", "residual"]


class _Functions(DifferentiableFunctions):
    """The functions of arrays of JAX."""

    def _arrays(self, given: Mapping[str, Any]) -> dict[str, Any]:
        arrays = {name: jnp.asarray(value) for name, value in given.items()}
        dtype = jnp.result_type(*arrays.values())
        if not jnp.issubdtype(dtype, jnp.floating):
            dtype = jnp.result_type(float)
        return {name: array.astype(dtype) for name, array in arrays.items()}

    def _is_array(self, value: Any) -> bool:
        return isinstance(value, jax.Array)

    def _constant(self, value: Any) -> Any:
        return np.asarray(value, dtype=np.float64)

    def _broadcast(self, array: Any, shape: tuple[int, ...]) -> Any:
        return jnp.broadcast_to(array, shape)

    def _call(self, question: Question, moved: dict[str, Any], rows: dict[str, Any]) -> Any:
        constants = {name: row for name, row in rows.items() if not self._is_array(row)}
        variable = {
            name: row if name in question.gradients else _constant(name, row)
            for name, row in ((name, jnp.asarray(row, dtype=float)) for name, row in rows.items())
            if name not in constants
        }
        return _differentiable(question, {**moved, **variable}, constants)


def _differentiable(question: Question, given: dict[str, Any], constants: dict[str, Any]) -> Any:
    """Compute values whose derivatives by the given arrays JAX knows."""
    layout, dtype = question.layout, given["positions"].dtype
    plain = {name: value for name, value in question.shared.items() if value is not None or name == "edges"}
    question = Question(layout, question.gradients, plain, question.nearest)
    gradients = [name for name in question.gradients if name in given]

    # An empty batch finds mistakes in what all grasps share: JAX hides the types of errors in callbacks.
    empty = layout if layout.offsets else Layout((0,), layout.contacts, layout.dim, layout.wrenches)
    zeros = {name: np.zeros(empty.given(name)) for name in given}
    question.compute({**constants, **zeros}, empty)

    def on_host(*arrays: Any) -> tuple[Any, ...]:
        by_name = dict(zip(given, (np.asarray(array).astype(np.float64) for array in arrays), strict=True))
        leading = by_name["positions"].shape[:-2]
        mapped = Layout(leading, layout.contacts, layout.dim, layout.wrenches, layout.offsets)
        found = question.compute({**constants, **by_name}, mapped)
        derivatives = dict(zip(question.gradients, found.derivatives, strict=True))
        kept = (derivatives[name].astype(dtype) for name in gradients)
        return found.values.astype(dtype), found.solved, *kept

    shapes = [jax.ShapeDtypeStruct(layout.values, dtype), jax.ShapeDtypeStruct(layout.values, np.bool_)]
    shapes += [jax.ShapeDtypeStruct(layout.derivative(name), dtype) for name in gradients]

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
        by_name = dict(zip(given, tangents, strict=True))
        for name, derivative in zip(gradients, derivatives, strict=True):
            change = by_name[name].astype(dtype)
            if name == "external_wrenches":
                total = total + (derivative * change).sum(-1)
                continue
            if layout.wrenches:
                change = change[..., None, :, :]  # the K wrenches of a grasp share its contacts
            product = derivative * change
            total = total + _gathered(
                layout, product.sum(-1) if name in ("positions", "normals") else product
            )
        # What is no answer passes nothing on, not even NaN.
        return found, jnp.where(solved, total, 0)

    return value(*given.values())


def _gathered(layout: Layout, by_contact: Any) -> Any:
    """Sum over the contacts of each grasp: the adjoint of `Layout.spread`."""
    if layout.offsets is None:
        return by_contact.sum(-1)
    zeros = jnp.zeros((*by_contact.shape[:-1], len(layout.offsets) - 1), by_contact.dtype)
    sums = zeros.at[..., layout.owners].add(by_contact)
    return sums.swapaxes(-1, -2) if layout.wrenches else sums


def _constant(name: str, array: Any) -> Any:
    """Return an array that must not be differentiated by."""

    @jax.custom_jvp  # type: ignore[untyped-decorator]
    def constant(value: Any) -> Any:
        return value

    @constant.defjvp  # type: ignore[untyped-decorator]
    def refused(_primals: Any, _tangents: Any) -> Any:
        raise InvalidInputError(f"{name}: no derivatives by it; pass jax.lax.stop_gradient({name})")

    return constant(array)


_functions = _Functions()
quality = _functions.quality
least_force = _functions.least_force
residual = _functions.residual
