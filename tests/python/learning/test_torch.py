"""`graspforce.torch`: derivatives, transformations, types and shapes on the real package."""

import itertools

import numpy as np
import pytest
from support.moved_contacts import ellipsoid_grasps, ragged_grasps

import graspforce as gf

torch = pytest.importorskip("torch", reason="make learning installs it")
gt = pytest.importorskip("graspforce.torch")

# torch.func.hessian warns of torch.jit, which it uses itself.
pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:FutureWarning")

FUNCTIONS = {
    "sum": lambda p, n, _w, **o: gt.quality(p, n, criterion="sum", friction=0.8, **o),
    "max": lambda p, n, _w, **o: gt.quality(p, n, friction=0.8, rtol=1e-12, **o),
    "least force": lambda p, n, w, **o: gt.least_force(p, n, w, unsolved=0.0, friction=0.8, **o),
    "least squares": lambda p, n, w, **o: gt.least_force(
        p, n, w, objective="squares", slack=10.0, friction=0.8, edges=None, **o
    ),
    "residual": lambda p, n, w, **o: gt.residual(p, n, 3 * w, friction=0.8, **o),
}
each_function = pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)


def case(rows=3, dim=3, seed=0, gradient=False):
    rng = np.random.default_rng(seed)
    arrays = [*ellipsoid_grasps(rng, rows, dim, 4), rng.normal(size=(2, 3 if dim == 2 else 6))]
    return [torch.tensor(array, requires_grad=gradient) for array in arrays]


@each_function
@pytest.mark.parametrize("dim", [2, 3])
def test_gradients_are_finite_differences(function, dim):
    moved = case(dim=dim, gradient=True)
    # Normals of any length, in the default frames, which spin as they turn.
    moved[1] = (1.7 * moved[1].detach()).requires_grad_()
    assert torch.autograd.gradcheck(function, moved, eps=1e-6, atol=1e-4, rtol=1e-3)


@pytest.mark.parametrize("tangents", [False, True])
def test_gradients_by_friction_limits_and_with_given_frames_are_finite_differences(tangents):
    positions, normals, _ = case(gradient=True)
    rng = np.random.default_rng(1)
    friction, limits = (torch.tensor(rng.uniform(0.4, 1.0, (3, 4)), requires_grad=True) for _ in range(2))
    frames = {"tangents": torch.tensor(rng.normal(size=(3, 4, 3)))} if tangents else {}

    def function(p, n, mu, limit):
        options = {"friction": mu, "max_normal_force": limit, "rtol": 1e-12, "torsion": 0.1, **frames}
        return gt.quality(p, n, friction_margin=1.2, **options)

    assert torch.autograd.gradcheck(function, (positions, normals, friction, limits), atol=1e-4, rtol=1e-3)


def test_one_friction_for_all_gets_the_sum_of_the_gradients():
    positions, normals, _ = case()
    one = torch.tensor(0.6, dtype=torch.float64, requires_grad=True)
    each = torch.full((3, 4), 0.6, dtype=torch.float64, requires_grad=True)
    gt.quality(positions, normals, friction=one).sum().backward()
    gt.quality(positions, normals, friction=each).sum().backward()
    torch.testing.assert_close(one.grad, each.grad.sum())


@each_function
def test_transformations_agree_with_backward(function):
    positions, normals, wrenches = case(gradient=True)
    (expected,) = torch.autograd.grad(function(positions, normals, wrenches).sum(), positions)
    positions, normals, wrenches = case()

    def one(p, n):
        return function(p, n, wrenches).sum()

    found = torch.vmap(torch.func.grad(one))(positions, normals)
    torch.testing.assert_close(found, expected, rtol=0, atol=1e-12)
    batched = torch.func.grad(lambda p: torch.vmap(one)(p, normals).sum())(positions)
    torch.testing.assert_close(batched, expected, rtol=0, atol=1e-12)
    shared = torch.vmap(one, in_dims=(0, None))(positions, normals[0])
    torch.testing.assert_close(shared, torch.stack([one(p, normals[0]) for p in positions]))


@each_function
def test_compiled_functions_agree_with_eager_ones(function):
    positions, normals, wrenches = case(gradient=True)

    def loss(p, n, w):
        return function(torch.sin(p), n, w).sum()

    expected = torch.autograd.grad(loss(positions, normals, wrenches), positions)[0]
    compiled = torch.compile(loss, fullgraph=True, backend="aot_eager")
    found = torch.autograd.grad(compiled(positions, normals, wrenches), positions)[0]
    torch.testing.assert_close(found, expected, rtol=0, atol=1e-12)


@each_function
def test_compiled_batches_agree_with_eager_ones(function):
    positions, normals, wrenches = case()

    def loss(p, n, w):
        return function(torch.sin(p), n, w).sum()

    mapped = torch.compile(torch.vmap(lambda p, n: loss(p, n, wrenches)), fullgraph=True, backend="aot_eager")
    torch.testing.assert_close(mapped(positions, normals).sum(), loss(positions, normals, wrenches))


def test_operators_keep_the_rules_of_torch():
    positions, normals, _ = case(gradient=True)
    rows = (torch.tensor(0.5), torch.tensor(1.0), *[None] * 7)
    torch.library.opcheck(
        torch.ops.graspforce.quality.default,
        (positions, normals, *rows, [], [8], None, 1.0, 0.0, "max", None, None, 0.0),
        test_utils=("test_schema", "test_autograd_registration", "test_faketensor"),
    )


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32, torch.float16, torch.bfloat16])
def test_values_and_gradients_have_the_dtype_of_the_contacts(dtype):
    positions, normals, wrenches = (tensor.to(dtype) for tensor in case())
    positions.requires_grad_()
    rounded = gf.quality_many(positions.detach().double().numpy(), normals.double().numpy()).epsilon
    value = gt.quality(positions, normals)
    assert value.dtype == dtype
    assert value.detach().tolist() == torch.tensor(rounded).to(dtype).tolist()
    value.sum().backward()
    assert positions.grad.dtype == dtype
    assert gt.least_force(positions, normals, wrenches).dtype == dtype


@pytest.mark.parametrize("leading", [(), (1,), (0,), (2, 0), (2, 1, 3)])
def test_any_leading_dimensions(leading):
    positions, normals, wrenches = case(rows=int(np.prod(leading)))
    positions, normals = (x.reshape(*leading, 4, 3).requires_grad_() for x in (positions, normals))
    values = gt.quality(positions, normals)
    assert values.shape == leading
    assert gt.residual(positions, normals, wrenches).shape == (*leading, 2)
    assert gt.least_force(positions, normals, wrenches[:0]).shape == (*leading, 0)
    values.sum().backward()
    assert positions.grad.shape == positions.shape


def test_options_of_each_grasp_and_of_all():
    positions, normals, _ = case()
    options = {
        "origin": np.full((3, 3), 0.1),
        "length_scale": [1.0, 2.0, 0.5],
        "torsion": [0.1, 0.2, 0.1, 0.1],
    }
    expected = gf.quality_many(positions.numpy(), normals.numpy(), edges=[4, 5, 6, 7], **options).epsilon
    tensors = {name: torch.tensor(value, dtype=torch.float64) for name, value in options.items()}
    for given in (options, tensors):
        found = gt.quality(positions, normals, edges=[4, 5, 6, 7], **given)
        np.testing.assert_array_equal(found.numpy(), expected)
    forces = [np.array([[1.0, 0.3, 0.1], [1.0, -0.3, 0.1], [1.0, 0.0, -0.4]])] * 4
    expected = gf.quality_many(positions.numpy(), normals.numpy(), extreme_forces=forces).epsilon
    np.testing.assert_array_equal(gt.quality(positions, normals, extreme_forces=forces).numpy(), expected)


@each_function
def test_a_row_that_is_no_grasp_passes_nothing_on(function):
    positions, normals, wrenches = case(rows=5)
    good = function(positions, normals, wrenches)
    positions[1, 0, 0] = torch.nan
    normals[3, 2] = 0.0
    positions.requires_grad_()
    normals.requires_grad_()
    values = function(positions, normals, wrenches)
    torch.testing.assert_close(values[[0, 2, 4]].detach(), good[[0, 2, 4]])
    # NaN reaches the gradient of the loss by these rows, and stops there.
    ((values - 1.0) ** 2).mean().backward()
    for gradient in (positions.grad, normals.grad):
        assert gradient.isfinite().all()
        assert (gradient[[1, 3]] == 0).all()
    assert (positions.grad[[0, 2, 4]] != 0).any()


def test_the_value_of_rows_without_an_answer_can_be_chosen():
    positions, normals, _ = case()
    normals[1] = 0.0
    assert gt.quality(positions, normals)[1].isnan()
    assert gt.quality(positions, normals, unsolved=-1.0)[1] == -1.0
    pushed = gt.least_force(positions[:1, :1], normals[:1, :1], torch.ones(1, 6), unsolved=1e3)
    assert pushed.tolist() == [[1e3]]


def test_second_derivatives_are_refused():
    positions, normals, _ = case(gradient=True)
    (first,) = torch.autograd.grad(gt.quality(positions, normals).sum(), positions, create_graph=True)
    with pytest.raises(gf.GraspForceError, match="second"):
        torch.autograd.grad(first.sum(), positions)
    with pytest.raises(gf.GraspForceError, match="second"):
        torch.func.hessian(lambda p: gt.quality(p, normals.detach()).sum())(positions.detach())
    scale = torch.ones((), dtype=torch.float64, requires_grad=True)
    (first,) = torch.autograd.grad(scale * gt.quality(positions, normals).sum(), positions, create_graph=True)
    assert torch.autograd.grad(first.sum(), scale)[0].isfinite()


def test_derivatives_that_do_not_exist_are_refused_by_name():
    positions, normals, wrenches = case(gradient=True)
    origin = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    with pytest.raises(gf.InvalidInputError, match="origin"):
        gt.quality(positions, normals, origin=origin).sum().backward()
    friction = torch.tensor(0.5, requires_grad=True)
    with pytest.raises(gf.InvalidInputError, match="friction"):
        gt.least_force(positions, normals, wrenches, friction=friction).sum().backward()


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        (np.zeros((4, 3)), "positions: ndarray"),
        (torch.zeros(4, 3, dtype=torch.int64), "torch.int64"),
        (torch.zeros(3), "two dim"),
    ],
)
def test_wrong_contacts_are_refused(positions, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gt.quality(positions, torch.zeros(4, 3))
    with pytest.raises(TypeError, match="frictoin"):
        gt.quality(torch.zeros(4, 3), torch.zeros(4, 3), frictoin=1)


@each_function
def test_a_ragged_batch_is_its_grasps(function):
    rng = np.random.default_rng(3)
    positions, normals, offsets = ragged_grasps(rng)
    wrenches = torch.tensor(rng.normal(size=(2, 6)))
    p, n = (torch.tensor(array, requires_grad=True) for array in (positions, normals))

    def ragged(p, n):
        return function(p, n, wrenches, offsets=offsets)

    values = ragged(p, n)
    weights = torch.tensor(rng.normal(size=values.shape))
    (weights * values).nansum().backward()
    for row, (start, end) in enumerate(itertools.pairwise(offsets)):
        if start == end:
            assert not values[row].nan_to_num(0.0).any()
            continue
        one = [array[start:end].detach().clone().requires_grad_() for array in (p, n)]
        alone = function(*one, wrenches)
        torch.testing.assert_close(values[row], alone, equal_nan=True)
        (weights[row] * alone).nansum().backward()
        torch.testing.assert_close(p.grad[start:end], one[0].grad)
        torch.testing.assert_close(n.grad[start:end], one[1].grad)
    twice = ragged(p.expand(2, *p.shape), n)
    torch.testing.assert_close(twice[1], values, equal_nan=True)
    mapped = torch.vmap(ragged, in_dims=(0, None))(p.detach().expand(2, *p.shape), n.detach())
    torch.testing.assert_close(mapped[1], values.detach(), equal_nan=True)
    compiled = torch.compile(lambda p: ragged(p, n).nansum(), fullgraph=True, backend="aot_eager")
    torch.testing.assert_close(compiled(p), values.nansum())


@pytest.mark.parametrize("edges", [8, None])
@pytest.mark.parametrize("criterion", ["max", "sum"])
def test_a_smooth_minimum_has_its_bound_its_limit_and_its_derivative(criterion, edges):
    positions, normals, _ = case(rows=10, gradient=True)
    options = {"criterion": criterion, "friction": 0.8, "edges": edges}
    exact = gt.quality(positions, normals, **options).detach()
    before = exact
    for smoothing in (1e-12, 1e-3, 1e-2, 0.1):
        smooth = gt.quality(positions, normals, smoothing=smoothing, **options).detach()
        assert (smooth <= before).all()
        assert (smooth >= exact - smoothing * np.log(16)).all()
        before = smooth
    torch.testing.assert_close(gt.quality(positions, normals, smoothing=1e-12, **options), exact)
    # Smooth sets have few local minima.
    assert edges is None or (before < exact).any()

    # The bracket of true cones is the noise of differences.
    options["rtol"], step = (1e-12, 1e-6) if edges else (1e-9, 1e-4)

    def smoothed(p, n):
        return gt.quality(p, n, smoothing=0.02, **options)

    smoothed(positions, normals).sum().backward()
    rng = np.random.default_rng(1)
    errors = []
    with torch.no_grad():
        for _ in range(3):
            move, turn = (torch.tensor(rng.normal(size=positions.shape)) for _ in range(2))
            sides = [smoothed(positions + h * move, normals + h * turn) for h in (step, -step)]
            slope = (positions.grad * move + normals.grad * turn).sum((-2, -1))
            errors.append((sides[0] - sides[1]) / (2 * step) - slope)
    errors = torch.stack(errors).abs()
    # A direction that joins or leaves within the step makes the value jump; that is rare.
    assert edges is None or (errors < 1e-3).double().mean() > 0.9
    assert errors.median() < 1e-5


def test_a_smooth_minimum_mixes_the_gradients_of_equally_bad_directions():
    positions = torch.tensor([(1.0, 0.0), (-1.0, 0.0)], dtype=torch.float64, requires_grad=True)
    normals = -positions.detach()
    gt.quality(positions, normals).backward()
    one = positions.grad.clone()
    positions.grad = None
    gt.quality(positions, normals, smoothing=0.01).backward()
    # The mirror images of the grasp cancel what one direction alone says.
    assert one[:, 1].abs().max() > 0.1
    assert positions.grad[:, 1].abs().max() < 1e-12


@pytest.mark.parametrize("smoothing", [-1.0, float("nan"), float("inf"), "0.1"])
def test_what_is_no_scale_of_smoothing_is_refused(smoothing):
    positions, normals, _ = case()
    with pytest.raises(gf.InvalidInputError, match="smoothing"):
        gt.quality(positions, normals, smoothing=smoothing)


@pytest.mark.parametrize(
    ("offsets", "message"),
    [
        ([0, 3], "entry 1: 3, expected 12"),
        ([1, 12], "entry 0: 1, expected 0"),
        ([0, 7, 4, 12], "entry 2: 4, expected at least 7"),
        ([], "whole numbers"),
        ([0.0, 12.0], "whole numbers"),
    ],
)
def test_offsets_that_cut_no_batch_are_refused(offsets, message):
    positions, normals, _ = case()
    with pytest.raises(gf.InvalidInputError, match=message):
        gt.quality(positions.reshape(12, 3), normals.reshape(12, 3), offsets=offsets)
