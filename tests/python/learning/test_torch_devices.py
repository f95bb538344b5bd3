"""`graspforce.torch` beside a device: values and gradients come back to where the tensors are.

The device is one that this machine lacks: its tensors claim to be there, and their numbers lie on the CPU.
"""

import pytest
from support.moved_contacts import ellipsoid_grasps, ragged_grasps

torch = pytest.importorskip("torch", reason="make learning installs it")
gt = pytest.importorskip("graspforce.torch")

import numpy as np
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_map

from graspforce._internal.differentiable import FORCE_GRADIENTS, QUALITY_GRADIENTS
from graspforce.torch.operators import operators

DEVICE = torch.device("meta")


class Elsewhere(torch.Tensor):
    """A tensor on the device."""

    __torch_function__ = torch._C._disabled_torch_function_impl

    @staticmethod
    def __new__(cls, numbers):  # noqa: D102 - a claim, as the class says
        return torch.Tensor._make_wrapper_subclass(
            cls, numbers.shape, strides=numbers.stride(), dtype=numbers.dtype, device=DEVICE
        )

    def __init__(self, numbers):
        self.numbers = numbers

    @classmethod
    def __torch_dispatch__(cls, func, types, args=(), kwargs=None):
        return computed(func, args, kwargs or {})


class Device(TorchDispatchMode):
    """Where copies to the device are allowed."""

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        return computed(func, args, kwargs or {})


def computed(func, args, kwargs):
    """Compute an operation where its tensors are; numbers on both sides are an error, as on a real device."""
    if func.namespace == "graspforce":
        name = func._schema.name
        gradients = QUALITY_GRADIENTS if name == "graspforce::quality" else FORCE_GRADIENTS
        with Device():
            return operators[gradients].compute(*args)
    places = set()

    def plain(value):
        if isinstance(value, torch.Tensor) and (value.dim() or isinstance(value, Elsewhere)):
            places.add(value.device.type)
        return value.numbers if isinstance(value, Elsewhere) else value

    args, kwargs = tree_map(plain, args), tree_map(plain, dict(kwargs))
    target = kwargs.pop("device", None)
    indices = func._schema.name.startswith("aten::index")
    assert len(places) < 2 or indices, f"{func}: tensors on {places}"
    there = DEVICE.type in places if target is None else torch.device(target).type == DEVICE.type
    found = func(*args, **kwargs)
    return tree_map(lambda x: Elsewhere(x) if there and isinstance(x, torch.Tensor) else x, found)


def contacts(dtype):
    rng = np.random.default_rng(0)
    arrays = [*ellipsoid_grasps(rng, 3, 3, 4), rng.normal(size=(2, 6))]
    return [torch.tensor(array, dtype=dtype) for array in arrays]


FUNCTIONS = {
    "quality": lambda p, n, _w, **o: gt.quality(p, n, **o),
    "smoothed": lambda p, n, _w, **o: gt.quality(p, n, smoothing=0.01, **o),
    "least force": lambda p, n, w, **o: gt.least_force(p, n, w, unsolved=0.0, **o),
    "residual": lambda p, n, w, **o: gt.residual(p, n, 3 * w, **o),
}


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
def test_values_and_gradients_of_tensors_on_a_device_come_back_to_it(function, dtype):
    here = [tensor.requires_grad_() for tensor in contacts(dtype)]
    values = function(*here, friction=0.8)
    values.sum().backward()
    with Device():
        there = [Elsewhere(tensor.detach().clone()).requires_grad_() for tensor in here]
        found = function(*there, friction=0.8)
        assert found.device == DEVICE
        assert found.dtype == dtype
        assert found.detach().numbers.tolist() == values.tolist()
        found.sum().backward()
        for one, other in zip(there, here, strict=True):
            if other.grad is None:
                assert one.grad is None
                continue
            assert one.grad.device == DEVICE
            assert one.grad.dtype == dtype
            torch.testing.assert_close(one.grad.numbers, other.grad)


def test_a_gradient_lies_where_its_tensor_does():
    here = contacts(torch.float64)
    friction = torch.full((3, 4), 0.8, dtype=torch.float64, requires_grad=True)
    gt.quality(*here[:2], friction=friction).sum().backward()
    given = friction.detach().clone().requires_grad_()
    with Device():
        positions, normals = (Elsewhere(tensor) for tensor in here[:2])
        gt.quality(positions, normals, friction=given).sum().backward()
        assert given.grad.device.type == "cpu"
    torch.testing.assert_close(given.grad, friction.grad)


def test_ragged_batches_come_back_to_the_device():
    positions, normals, offsets = ragged_grasps(np.random.default_rng(1))
    here = [torch.tensor(array, requires_grad=True) for array in (positions, normals)]
    values = gt.quality(*here, offsets=offsets)
    values.sum().backward()
    with Device():
        there = [Elsewhere(tensor.detach().clone()).requires_grad_() for tensor in here]
        found = gt.quality(*there, offsets=offsets)
        assert found.device == DEVICE
        found.sum().backward()
        torch.testing.assert_close(there[0].grad.numbers, here[0].grad)


def test_fake_tensors_of_a_device_give_fake_values_there():
    from torch._subclasses.fake_tensor import FakeTensorMode  # noqa: PLC0415 - private, in this test alone

    with FakeTensorMode():
        positions, normals = (torch.empty(5, 4, 3, device="cuda", dtype=torch.float32) for _ in range(2))
        rows = (torch.tensor(0.5), torch.tensor(1.0), *[None] * 7)
        found = torch.ops.graspforce.quality(
            positions, normals, *rows, [], [8], None, 1.0, 0.0, "max", None, None, 0.0
        )
    assert {tensor.device.type for tensor in found} == {"cuda"}
    assert [tuple(tensor.shape) for tensor in found[:3]] == [(5,), (5,), (5, 4, 3)]
