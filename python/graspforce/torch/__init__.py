"""Quality, least forces and residuals as differentiable functions of PyTorch tensors.

Needs the extra ``torch``. Values come from `graspforce.quality_many` and `graspforce.forces_many`, exact and
in float64. They have the dtype of the positions. ``backward``, ``torch.func.grad``, ``torch.vmap`` and
``torch.compile`` work. There are no second derivatives: asking for them is an error.

All functions take tensors of a floating-point dtype with any leading dimensions, also none. The computation
is on the CPU, on all its cores: tensors of another device are copied there, and results are copied back.
Each call then waits for the device.

An entry without an answer has the value ``unsolved`` and the gradient zero. Other entries do not change. The
``status`` that the functions above return says why.

Examples
--------
>>> import torch
>>> import graspforce.torch
>>> positions = torch.tensor([[-1.0, 0.1], [1.0, 0.0]], requires_grad=True)
>>> normals = torch.tensor([[1.0, 0.0], [-1.0, 0.0]])
>>> epsilon = graspforce.torch.quality(positions, normals, friction=0.5)
>>> epsilon.backward()
>>> bool(positions.grad[0, 1] < 0)  # lowering the first finger is better
True

Two opposite fingers of friction 0.5 lift a disc of 1 N, and one of 3 N. Each contact presses with the weight:

>>> positions = torch.tensor([[-1.0, 0.0], [1.0, 0.0]])
>>> weights = torch.tensor([[0.0, -1, 0], [0, -3, 0]], requires_grad=True)
>>> sigma = graspforce.torch.least_force(positions, normals, weights, friction=0.5)
>>> sigma.detach().numpy().round(6).tolist()
[1.0, 3.0]
>>> sigma.sum().backward()
>>> weights.grad[:, 1].numpy().round(6).tolist()
[-1.0, -1.0]

With at most 1 N each they hold 1 N of the 3 N:

>>> unbalanced = graspforce.torch.residual(positions, normals, weights, friction=0.5)
>>> unbalanced.detach().numpy().round(6).tolist()
[0.0, 2.0]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspforce._internal.differentiable_functions import DifferentiableFunctions, Question
from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError
from graspforce.torch.operators import as_tensor, operators

if TYPE_CHECKING:
    from collections.abc import Mapping

torch = optional("torch", "torch")

__all__ = ["least_force", "quality", "residual"]


class _Functions(DifferentiableFunctions):
    """The functions of tensors."""

    def _arrays(self, given: Mapping[str, Any]) -> dict[str, Any]:
        for name, tensor in given.items():
            if not isinstance(tensor, torch.Tensor) or not tensor.dtype.is_floating_point:
                kind = tensor.dtype if isinstance(tensor, torch.Tensor) else type(tensor).__name__
                raise InvalidInputError(f"{name}: {kind} where a floating-point torch.Tensor is needed")
        dtype = given["positions"].dtype
        for tensor in given.values():
            dtype = torch.promote_types(dtype, tensor.dtype)
        return {name: tensor.to(dtype) for name, tensor in given.items()}

    def _is_array(self, value: Any) -> bool:
        return isinstance(value, torch.Tensor)

    def _constant(self, value: Any) -> Any:
        return as_tensor(value)

    def _broadcast(self, array: Any, shape: tuple[int, ...]) -> Any:
        return array.expand(shape)

    def _call(self, question: Question, moved: dict[str, Any], rows: dict[str, Any]) -> Any:
        options = dict(question.shared)
        extreme = [as_tensor(forces) for forces in options.pop("extreme_forces", None) or ()]
        edges = options.pop("edges", 8)
        given = {
            **options,
            "extreme_forces": torch.cat(extreme) if extreme else None,
            "forces_of_contacts": [len(forces) for forces in extreme],
            "edges": [] if edges is None else [edges] if isinstance(edges, int) else [int(n) for n in edges],
            "offsets": None if question.layout.offsets is None else list(question.layout.offsets),
            "nearest": question.nearest,
        }
        return operators[question.gradients](**moved, **rows, **given)


_functions = _Functions()
quality = _functions.quality
least_force = _functions.least_force
residual = _functions.residual
