"""The PyTorch operators ``graspforce::quality`` and ``graspforce::forces``.

Each computes values with their derivatives at once; backward multiplies by them. Tensors named in `ROWS` have
the leading dimensions of the positions, or belong to all grasps.
"""

from __future__ import annotations

from types import new_class
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal import differentiable
from graspforce._internal.differentiable import FORCE_GRADIENTS, QUALITY_GRADIENTS, ROWS, Differentiated
from graspforce._internal.optional_imports import optional
from graspforce.errors import GraspForceError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

torch = optional("torch", "torch")

__all__ = ["forces_operator", "quality_operator"]

_ROWS = (
    "Tensor friction, Tensor max_normal_force, Tensor? torsion, Tensor? tangents, Tensor? origin, "
    "Tensor? length_scale"
)
_GRASP = (
    "Tensor? extreme_forces, int[] forces_of_contacts, int[] edges, float friction_margin, float unsolved"
)
_QUALITY = (
    f"(Tensor positions, Tensor normals, {_ROWS}, Tensor? external_wrench, Tensor? metric, {_GRASP}, "
    "str criterion, float? rtol, int? max_facets) -> (Tensor, Tensor, Tensor, Tensor, Tensor, Tensor)"
)
_FORCES = (
    f"(Tensor positions, Tensor normals, Tensor external_wrenches, {_ROWS}, Tensor? min_normal, "
    f"Tensor? reference, Tensor? weights, Tensor? slack, Tensor? metric, {_GRASP}, str objective, "
    "float weight, float rtol, bool limits, bool nearest) -> (Tensor, Tensor, Tensor, Tensor, Tensor)"
)


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

    def __init__(self, name: str, schema: str, gradients: Sequence[str]) -> None:
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

    def __call__(self, *arguments: Any) -> Any:
        """Return the values alone."""
        compiled = torch.compiler.is_compiling()
        found = self.operator(*arguments) if compiled else self.function.apply(*arguments)
        return found[0]

    def compute(self, *arguments: Any) -> tuple[Any, ...]:
        """Compute on the CPU in float64; results go back to where the positions are."""
        given = dict(zip(self.names, arguments, strict=True))
        plain = {name: _plain(value) for name, value in given.items() if value is not None}
        counts = plain.pop("forces_of_contacts")
        if "extreme_forces" in plain:
            plain["extreme_forces"] = np.split(plain["extreme_forces"], np.cumsum(counts[:-1]))
        edges = plain.pop("edges")
        plain["edges"] = edges[0] if len(edges) == 1 else list(edges) or None
        moved = [plain.pop(name) for name in self.gradients if name not in ROWS]
        rows = {name: plain.pop(name) for name in ROWS if name in plain}
        found = self.values(moved, rows, plain)
        positions = given["positions"]
        return (
            torch.from_numpy(found.values).to(positions.dtype).to(positions.device),
            torch.from_numpy(found.solved).to(positions.device),
            *(
                torch.from_numpy(by).to(given[name].dtype).to(positions.device)
                for name, by in zip(self.gradients, found.derivatives, strict=True)
            ),
        )

    def values(self, moved: list[Any], rows: dict[str, Any], options: dict[str, Any]) -> Differentiated:
        """Compute with arrays of NumPy."""
        if self.gradients is QUALITY_GRADIENTS:
            positions, normals = moved
            return differentiable.quality(positions, normals, rows, options)
        positions, normals, wrenches = moved
        nearest = options.pop("nearest")
        return differentiable.forces(positions, normals, wrenches, rows, options, nearest=nearest)

    def compute_below(self, *arguments: Any) -> Any:
        """Call the operator without its autograd."""
        return self.operator(*arguments)

    def shapes(self, *arguments: Any) -> tuple[Any, ...]:
        """Empty tensors like those that `compute` returns."""
        given = dict(zip(self.names, arguments, strict=True))
        positions = given["positions"]
        leading, contact = positions.shape[:-2], positions.shape[-2:]
        if "external_wrenches" in given:
            wrenches = given["external_wrenches"]
            values = (*leading, wrenches.shape[-2])
            shapes = [(*values, *contact), (*values, *contact), (*values, wrenches.shape[-1])]
        else:
            values = leading
            shapes = [(*leading, *contact)] * 2 + [(*leading, contact[0])] * 2
        return (
            positions.new_empty(values),
            positions.new_empty(values, dtype=torch.bool),
            *(
                positions.new_empty(shape, dtype=given[name].dtype)
                for name, shape in zip(self.gradients, shapes, strict=True)
            ),
        )

    def keep(self, ctx: Any, inputs: tuple[Any, ...], output: tuple[Any, ...]) -> None:  # noqa: ARG002 - torch names them
        """Keep the derivatives."""
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(*output[1:])
        ctx.wanted = [self.names.index(name) for name in self.gradients]

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
        for position, name, derivative in zip(ctx.wanted, self.gradients, derivatives, strict=True):
            if ctx.needs_input_grad[position]:
                extra = derivative.dim() - by_value.dim()
                product = derivative * by_value.to(derivative.dtype).reshape(by_value.shape + (1,) * extra)
                # Contacts are shared by the K wrenches of a grasp.
                shared = "external_wrenches" in self.names and name != "external_wrenches"
                found[position] = product.sum(-3) if shared else product
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
        positions = arguments[0]
        leading = positions.dim() - 2 - (dims["positions"] is not None)
        contacts, dim = _contact_shape(positions, dims["positions"])
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
            elif row and (
                name not in ROWS
                or argument.dim() == leading + len(differentiable.row_shape(name, contacts, dim))
            ):
                moved.append(argument.expand(size, *argument.shape))
            else:
                moved.append(argument)
        found = call(*moved)
        return found, (0,) * len(found)


def _contact_shape(positions: Any, batched: int | None) -> tuple[int, int]:
    shape = list(positions.shape)
    if batched is not None:
        del shape[batched]
    return shape[-2], shape[-1]


quality_operator = _Operator("graspforce::quality", _QUALITY, QUALITY_GRADIENTS)
forces_operator = _Operator("graspforce::forces", _FORCES, FORCE_GRADIENTS)
