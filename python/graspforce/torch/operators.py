"""The PyTorch operators ``graspforce::quality`` and ``graspforce::forces``.

Each computes values with their derivatives at once; backward multiplies by them. Tensors named in `ROWS` have
the leading dimensions of the positions, or belong to all grasps.
"""

from __future__ import annotations

from types import new_class
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.differentiable import FORCE_GRADIENTS, QUALITY_GRADIENTS, ROWS, Layout
from graspforce._internal.differentiable_functions import Question
from graspforce._internal.optional_imports import optional
from graspforce.errors import GraspForceError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

torch = optional("torch", "torch")

__all__ = ["as_tensor", "operators"]

_ROWS = (
    "Tensor friction, Tensor max_normal_force, Tensor? torsion, Tensor? tangents, Tensor? origin, "
    "Tensor? length_scale"
)
_GRASP = (
    "Tensor? extreme_forces, int[] forces_of_contacts, int[] edges, int[]? offsets, float friction_margin, "
    "float unsolved"
)
_QUALITY = (
    f"(Tensor positions, Tensor normals, {_ROWS}, Tensor? external_wrench, Tensor? metric, {_GRASP}, "
    "str criterion, float? rtol, int? max_facets, float smoothing) "
    "-> (Tensor, Tensor, Tensor, Tensor, Tensor, Tensor)"
)
_FORCES = (
    f"(Tensor positions, Tensor normals, Tensor external_wrenches, {_ROWS}, Tensor? min_normal, "
    f"Tensor? reference, Tensor? weights, Tensor? slack, Tensor? metric, {_GRASP}, str objective, "
    "float weight, float rtol, bool limits, bool nearest) -> (Tensor, Tensor, Tensor, Tensor, Tensor)"
)


_DEFAULTS = {"friction_margin": 1.0, "objective": "max", "weight": 0.0, "limits": False}
_CONSTANTS = ("external_wrench", "metric", "min_normal", "reference", "weights", "slack", "extreme_forces")


def _names(schema: str) -> list[str]:
    arguments = schema[1 : schema.index(")")].split(", ")
    return [argument.split()[1] for argument in arguments]


def _array(tensor: Any) -> NDArray[np.float64]:
    """Return a tensor as float64, cast on the CPU: some devices have no float64."""
    array: NDArray[np.float64] = tensor.detach().cpu().to(torch.float64).numpy()
    return array


def _plain(argument: Any) -> Any:
    return _array(argument) if isinstance(argument, torch.Tensor) else argument


class _Operator:
    """An operator whose outputs are values, which of them are answers, and derivatives."""

    def __init__(self, name: str, schema: str, gradients: tuple[str, ...]) -> None:
        self.names = _names(schema)
        self.gradients = gradients
        self.operator = torch.library.custom_op(name, self.compute, mutates_args=(), schema=schema)
        self.operator.register_fake(self.shapes)
        self.operator.register_autograd(self.backward, setup_context=self.keep)
        self.operator.register_vmap(lambda *given: self.batch(self.operator, *given))
        # Operators with registered autograd refuse torch.func.grad; functions do not.
        parts: dict[str, Any] = {
            "forward": self.compute_below,
            "setup_context": self.keep,
            "backward": self.backward,
            "jvp": self.refuse,
            "vmap": lambda *given: self.batch(self.function.apply, *given),
        }
        parts = {part: staticmethod(function) for part, function in parts.items()}
        base = torch.autograd.Function
        self.function: Any = new_class(
            name.replace("::", "_"), (base,), {}, lambda space: space.update(parts)
        )

    def __call__(self, **given: Any) -> Any:
        """Return the values alone."""
        constants = {name: as_tensor(given.get(name)) for name in (*ROWS, *_CONSTANTS)}
        given = {**_DEFAULTS, **given, **constants}
        compiled = torch.compiler.is_compiling()
        call = self.operator if compiled else self.function.apply
        return call(*(given[name] for name in self.names))[0]

    def layout(self, given: Mapping[str, Any], dims: Mapping[str, int | None] | None = None) -> Layout:
        """Return the shapes of a call, without the dimensions that are mapped."""
        shapes = {}
        for name in ("positions", "external_wrenches"):
            if name in given:
                shape, mapped = list(given[name].shape), (dims or {}).get(name)
                if mapped is not None:
                    del shape[mapped]
                shapes[name] = tuple(shape)
        *leading, contacts, dim = shapes["positions"]
        wrenches = shapes.get("external_wrenches", ())[-2:]
        offsets = given["offsets"]
        starts = None if offsets is None else tuple(offsets)
        return Layout(tuple(leading), contacts, dim, wrenches, starts)

    def compute(self, *arguments: Any) -> tuple[Any, ...]:
        """Compute on the CPU in float64; results go back to where the positions are."""
        given = dict(zip(self.names, arguments, strict=True))
        plain = {name: _plain(value) for name, value in given.items() if value is not None}
        counts, edges = plain.pop("forces_of_contacts"), plain.pop("edges")
        if "extreme_forces" in plain:
            plain["extreme_forces"] = np.split(plain["extreme_forces"], np.cumsum(counts[:-1]))
        plain["edges"] = edges[0] if len(edges) == 1 else list(edges) or None
        plain.pop("offsets", None)
        nearest = plain.pop("nearest", False)
        arrays = {name: plain.pop(name) for name in (*self.gradients, *ROWS) if name in plain}
        found = Question(self.layout(given), self.gradients, plain, nearest).compute(arrays)
        positions = given["positions"]
        return (
            torch.from_numpy(found.values).to(positions.dtype).to(positions.device),
            torch.from_numpy(found.solved).to(positions.device),
            *(
                torch.from_numpy(by).to(given[name].dtype).to(positions.device)
                for name, by in zip(self.gradients, found.derivatives, strict=True)
            ),
        )

    def compute_below(self, *arguments: Any) -> Any:
        """Call the operator without its autograd."""
        return self.operator(*arguments)

    def shapes(self, *arguments: Any) -> tuple[Any, ...]:
        """Empty tensors like those that `compute` returns."""
        given = dict(zip(self.names, arguments, strict=True))
        positions, layout = given["positions"], self.layout(given)
        return (
            positions.new_empty(layout.values),
            positions.new_empty(layout.values, dtype=torch.bool),
            *(
                positions.new_empty(layout.derivative(name), dtype=given[name].dtype)
                for name in self.gradients
            ),
        )

    def keep(self, ctx: Any, inputs: tuple[Any, ...], output: tuple[Any, ...]) -> None:
        """Keep the derivatives."""
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(*output[1:])
        ctx.wanted = [self.names.index(name) for name in self.gradients]
        given = dict(zip(self.names, inputs, strict=True))
        ctx.devices = [given[name].device for name in self.gradients]
        ctx.layout = self.layout(given)

    def backward(self, ctx: Any, by_value: Any, _solved: Any, *by_derivatives: Any) -> tuple[Any, ...]:
        """Multiply by the derivatives; a value that is no answer passes nothing on, not even NaN."""
        for name, needed in zip(self.names, ctx.needs_input_grad, strict=True):
            if needed and name not in self.gradients:
                raise InvalidInputError(f"{name}: no derivatives by it; detach() it")
        if any(by is not None for by in by_derivatives):
            self.refuse()
        found: list[Any] = [None] * len(self.names)
        if by_value is None:
            return tuple(found)
        solved, *derivatives = ctx.saved_tensors
        by_value = torch.where(solved, by_value, torch.zeros_like(by_value))
        by_contact = ctx.layout.spread(by_value)
        parts = zip(ctx.wanted, self.gradients, derivatives, ctx.devices, strict=True)
        for position, name, derivative, device in parts:
            if ctx.needs_input_grad[position]:
                by = by_value[..., None] if name == "external_wrenches" else by_contact
                by = by.to(derivative.dtype)
                by = by.reshape(by.shape + (1,) * (derivative.dim() - by.dim()))
                product = derivative * by
                # Contacts are shared by the K wrenches of a grasp.
                shared = "external_wrenches" in self.names and name != "external_wrenches"
                found[position] = (product.sum(-3) if shared else product).to(device)
        return tuple(found)

    def refuse(self, *_: Any) -> None:
        """Say which derivatives there are."""
        raise GraspForceError(
            "graspforce.torch has first derivatives by backward alone, no second ones and no forward mode: "
            "differentiate once, or detach the derivative"
        )

    def batch(self, call: Any, info: Any, in_dims: tuple[Any, ...], *arguments: Any) -> tuple[Any, Any]:
        """Call with one more leading dimension."""
        size, moved = info.batch_size, []
        dims = dict(zip(self.names, in_dims, strict=True))
        layout = self.layout(dict(zip(self.names, arguments, strict=True)), dims)
        for name, argument in zip(self.names, arguments, strict=True):
            by = dims[name]
            if not isinstance(argument, torch.Tensor):
                moved.append(argument)
                continue
            row = name in self.gradients or name in ROWS
            if by is not None:
                if not row:
                    raise InvalidInputError(f"{name}: the same for all grasps, so vmap cannot map it")
                moved.append(argument.movedim(by, 0))
            elif row and (name not in ROWS or argument.dim() == len(layout.given(name))):
                moved.append(argument.expand(size, *argument.shape))
            else:
                moved.append(argument)
        found = call(*moved)
        return found, (0,) * len(found)


def as_tensor(value: Any) -> Any:
    """Return a constant as float64 on the CPU; tensors stay as they are."""
    if value is None or isinstance(value, torch.Tensor):
        return value
    return torch.as_tensor(value, dtype=torch.float64, device="cpu")


operators = {
    QUALITY_GRADIENTS: _Operator("graspforce::quality", _QUALITY, QUALITY_GRADIENTS),
    FORCE_GRADIENTS: _Operator("graspforce::forces", _FORCES, FORCE_GRADIENTS),
}
"""By what they have derivatives."""
