"""Quality, least forces and residuals as differentiable functions of PyTorch tensors.

Needs the extra ``torch``. Values come from `graspforce.quality_many` and `graspforce.forces_many`, exact and
in float64. They have the dtype of the positions. ``backward``, ``torch.func.grad``, ``torch.vmap`` and
``torch.compile`` work. There are no second derivatives: asking for them is an error.

All functions take any leading dimensions, also none. The computation is on the CPU, on all its cores:
tensors of another device are copied there, and results are copied back. Each call then waits for the device.

An entry without an answer has the value ``unsolved`` and the gradient zero. Other entries do not change. The
``status`` that the functions above return says why.
"""

from __future__ import annotations

from typing import Any, Literal

from graspforce._internal.differentiable import ROWS, row_shape
from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError
from graspforce.torch.operators import forces_operator, quality_operator

torch = optional("torch", "torch")

__all__ = ["least_force", "quality", "residual"]

_NAN = float("nan")


def quality(
    positions: Any,
    normals: Any,
    *,
    criterion: Literal["max", "sum"] = "max",
    external_wrench: Any = None,
    metric: Any = None,
    rtol: float | None = None,
    max_facets: int | None = None,
    unsolved: float = _NAN,
    **options: Any,
) -> Any:
    """Return the quality epsilon of each grasp.

    Differentiable by positions, normals, ``friction`` and ``max_normal_force``. Where several directions are
    equally bad, the gradient is one of several. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : torch.Tensor
        (..., m, dim) of a floating-point dtype. Normals of any length.
    criterion, external_wrench, metric, rtol, max_facets : optional
        As for `graspforce.Grasp.quality`, the same for all grasps.
    unsolved : float
        Value of rows that are no grasps. Their gradient is zero.
    **options
        ``friction``, ``max_normal_force``, ``torsion``: a number, (m,) or (..., m). ``tangents`` (..., m, 3),
        ``origin`` (..., dim), ``length_scale`` (...). ``edges``, ``friction_margin``, ``extreme_forces``: the
        same for all grasps. All as for `graspforce.Grasp`.

    Returns
    -------
    torch.Tensor
        (...,) of the dtype and on the device of the positions.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        A shape or type is wrong, an argument that all grasps share, or a tensor requires a gradient that does
        not exist.

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
    """
    moved, leading = _moved(positions, normals)
    return quality_operator(
        *moved,
        *_rows(options, moved[0], leading),
        _constant(external_wrench),
        _constant(metric),
        *_grasp(options, unsolved),
        criterion,
        rtol,
        max_facets,
    )


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
    unsolved: float = _NAN,
    **options: Any,
) -> Any:
    """Return the least objective of the contact forces that balance each external wrench.

    Differentiable by positions, normals and wrenches. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : torch.Tensor
        (..., m, dim) of a floating-point dtype. Normals of any length.
    external_wrenches : torch.Tensor
        (..., K, d) for each grasp, or (K, d) for all.
    objective, weight, min_normal, rtol, reference, weights, slack, limits : optional
        As for `graspforce.ForceDistributor`, the same for all grasps.
    unsolved : float
        Value where no forces balance the wrench, or the row is no grasp. The gradient there is zero;
        `residual` leads to balance.
    **options
        As for `quality`; derivatives by ``friction`` and ``max_normal_force`` do not exist.

    Returns
    -------
    torch.Tensor
        (..., K) of the dtype and on the device of the positions.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        As for `quality`.

    Examples
    --------
    >>> import torch
    >>> import graspforce.torch
    >>> positions, normals = torch.tensor([[[-1.0, 0], [1, 0]], [[1.0, 0], [-1, 0]]])
    >>> weights = torch.tensor([[0.0, -1, 0], [0, -3, 0]], requires_grad=True)
    >>> sigma = graspforce.torch.least_force(positions, normals, weights, friction=0.5)
    >>> sigma.tolist()
    [1.0, 3.0]
    """
    moved, leading = _moved(positions, normals, external_wrenches)
    shared = (min_normal, reference, weights, slack, None)
    return forces_operator(
        *moved,
        *_rows(options, moved[0], leading),
        *(_constant(value) for value in shared),
        *_grasp(options, unsolved),
        objective,
        weight,
        rtol,
        limits,
        False,
    )


def residual(
    positions: Any,
    normals: Any,
    external_wrenches: Any,
    *,
    metric: Any = None,
    rtol: float = 1e-9,
    unsolved: float = _NAN,
    **options: Any,
) -> Any:
    """Return how far forces within their limits stay from balancing each external wrench.

    It is zero where the forces balance the wrench, and so is its gradient. Differentiable by positions,
    normals and wrenches. Safe to call from several threads.

    Parameters
    ----------
    positions, normals : torch.Tensor
        (..., m, dim) of a floating-point dtype. Normals of any length.
    external_wrenches : torch.Tensor
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
    torch.Tensor
        (..., K) norm of the unbalanced wrench, in N, of the dtype and on the device of the positions.

    Raises
    ------
    InvalidGraspError, InvalidInputError
        As for `quality`.

    Examples
    --------
    Two fingers of at most 1 N and friction 0.5 hold 1 N of a weight of 3 N:

    >>> import torch
    >>> import graspforce.torch
    >>> positions, normals = torch.tensor([[[-1.0, 0], [1, 0]], [[1.0, 0], [-1, 0]]])
    >>> weights = torch.tensor([[0.0, -1, 0], [0, -3, 0]])
    >>> unbalanced = graspforce.torch.residual(positions, normals, weights, friction=0.5)
    >>> unbalanced.numpy().round(6).tolist()
    [0.0, 2.0]
    """
    moved, leading = _moved(positions, normals, external_wrenches)
    return forces_operator(
        *moved,
        *_rows(options, moved[0], leading),
        *[None] * 4,
        _constant(metric),
        *_grasp(options, unsolved),
        "max",
        0.0,
        rtol,
        False,
        True,
    )


def _moved(*given: Any) -> tuple[list[Any], tuple[int, ...]]:
    """Tensors of one floating-point dtype and the same leading dimensions."""
    names = ("positions", "normals", "external_wrenches")[: len(given)]
    for name, tensor in zip(names, given, strict=True):
        if not isinstance(tensor, torch.Tensor) or not tensor.dtype.is_floating_point:
            kind = tensor.dtype if isinstance(tensor, torch.Tensor) else type(tensor).__name__
            raise InvalidInputError(f"{name}: {kind} where a floating-point torch.Tensor is needed")
        if tensor.dim() < 2:
            raise InvalidInputError(
                f"{name}: shape {tuple(tensor.shape)} where at least two dimensions are needed"
            )
    dtype = given[0].dtype
    for tensor in given[1:]:
        dtype = torch.promote_types(dtype, tensor.dtype)
    leading = torch.broadcast_shapes(*(tensor.shape[:-2] for tensor in given))
    return [tensor.to(dtype).expand(leading + tensor.shape[-2:]) for tensor in given], leading


def _rows(options: dict[str, Any], positions: Any, leading: tuple[int, ...]) -> list[Any]:
    """Options of each grasp; a tensor gets the leading dimensions of the positions."""
    contacts, dim = positions.shape[-2:]
    options = {"friction": 0.5, "max_normal_force": 1.0, **options}
    rows = []
    for name in ROWS:
        value = options.get(name)
        shape = row_shape(name, contacts, dim)
        constant = not isinstance(value, torch.Tensor)
        value = _constant(value)
        one_for_all = value is None or (constant and value.dim() <= len(shape))
        rows.append(value if one_for_all else value.expand(leading + shape))
    return rows


def _constant(value: Any) -> Any:
    if value is None or isinstance(value, torch.Tensor):
        return value
    return torch.as_tensor(value, dtype=torch.float64, device="cpu")


def _grasp(options: dict[str, Any], unsolved: float) -> tuple[Any, ...]:
    """Return what all grasps have in common."""
    known = {*ROWS, "edges", "friction_margin", "extreme_forces"}
    for name in options:
        if name not in known:
            raise TypeError(f"unexpected argument {name!r}")
    edges = options.get("edges", 8)
    extreme = [_constant(forces) for forces in options.get("extreme_forces") or ()]
    return (
        torch.cat(extreme) if extreme else None,
        [len(forces) for forces in extreme],
        [] if edges is None else [edges] if isinstance(edges, int) else [int(count) for count in edges],
        options.get("friction_margin", 1.0),
        float(unsolved),
    )
