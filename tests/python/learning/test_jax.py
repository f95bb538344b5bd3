"""`graspforce.jax`: derivatives, transformations, types and shapes, with and without x64."""

import itertools

import numpy as np
import pytest
from support.moved_contacts import ellipsoid_grasps, ragged_grasps

import graspforce as gf

jax = pytest.importorskip("jax", reason="make learning installs it")
gj = pytest.importorskip("graspforce.jax")
jnp = jax.numpy
check_grads = pytest.importorskip("jax.test_util").check_grads

FUNCTIONS = {
    "sum": lambda p, n, _w, **o: gj.quality(p, n, criterion="sum", friction=0.8, **o),
    "max": lambda p, n, _w, **o: gj.quality(p, n, friction=0.8, rtol=1e-12, **o),
    "least force": lambda p, n, w, **o: gj.least_force(p, n, w, unsolved=0.0, friction=0.8, **o),
    "least squares": lambda p, n, w, **o: gj.least_force(
        p, n, w, objective="squares", slack=10.0, friction=0.8, edges=None, **o
    ),
    "residual": lambda p, n, w, **o: gj.residual(p, n, 3 * w, friction=0.8, **o),
}
each_function = pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
FINITE = {"order": 1, "modes": ("fwd", "rev"), "atol": 1e-3, "rtol": 1e-3, "eps": 1e-6}


@pytest.fixture(params=[True, False], ids=["x64", "x32"])
def x64(request):
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", request.param)
    yield request.param
    jax.config.update("jax_enable_x64", before)


@pytest.fixture
def double():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


def case(rows=3, dim=3, seed=0):
    rng = np.random.default_rng(seed)
    arrays = [*ellipsoid_grasps(rng, rows, dim, 4), rng.normal(size=(2, 3 if dim == 2 else 6))]
    return [jnp.asarray(array) for array in arrays]


@pytest.mark.usefixtures("double")
@each_function
@pytest.mark.parametrize("dim", [2, 3])
def test_gradients_are_finite_differences(function, dim):
    positions, normals, wrenches = case(dim=dim)
    # Normals of any length, in the default frames, which spin as they turn.
    check_grads(function, (positions, 1.7 * normals, wrenches), **FINITE)


@pytest.mark.usefixtures("double")
@pytest.mark.parametrize("tangents", [False, True])
def test_gradients_by_friction_limits_and_with_given_frames_are_finite_differences(tangents):
    positions, normals, _ = case()
    rng = np.random.default_rng(1)
    friction, limits = (jnp.asarray(rng.uniform(0.4, 1.0, (3, 4))) for _ in range(2))
    frames = {"tangents": rng.normal(size=(3, 4, 3))} if tangents else {}

    def function(p, n, mu, limit):
        options = {"friction": mu, "max_normal_force": limit, "rtol": 1e-12, "torsion": 0.1, **frames}
        return gj.quality(p, n, friction_margin=1.2, **options)

    check_grads(function, (positions, normals, friction, limits), **FINITE)


@each_function
def test_transformations_agree(function, x64):
    positions, normals, wrenches = case()

    def one(p, n):
        return function(p, n, wrenches).sum()

    expected = jax.grad(lambda p: one(p, normals))(positions)
    assert expected.dtype == (jnp.float64 if x64 else jnp.float32)
    compiled = jax.jit(jax.grad(lambda p: one(p, normals)))(positions)
    mapped = jax.jit(jax.vmap(jax.grad(one)))(positions, normals)
    inside = jax.grad(lambda p: jax.vmap(one)(p, normals).sum())(positions)
    for found in (compiled, mapped, inside):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 if x64 else 1e-6)
    shared = jax.vmap(one, in_axes=(0, None))(positions, normals[0])
    expected = [one(p, normals[0]) for p in positions]
    np.testing.assert_allclose(shared, np.array(expected), rtol=1e-6)
    twice = jax.vmap(jax.vmap(one))(positions[None], normals[None])
    assert twice.shape == (1, 3)


def test_values_are_those_of_the_library_in_the_dtype_of_the_contacts(x64):
    positions, normals, _ = case()
    expected = gf.quality_many(np.asarray(positions), np.asarray(normals)).epsilon
    found = gj.quality(positions, normals)
    assert found.dtype == positions.dtype
    np.testing.assert_array_equal(found, expected.astype(positions.dtype))
    half = gj.quality(positions.astype(jnp.bfloat16), normals.astype(jnp.bfloat16))
    assert half.dtype == jnp.bfloat16
    whole = gj.quality(jnp.array([[-1, 0], [1, 0]]), jnp.array([[1, 0], [-1, 0]]))
    assert whole.dtype == (jnp.float64 if x64 else jnp.float32)


@pytest.mark.parametrize("leading", [(), (1,), (0,), (2, 0), (2, 1, 3)])
def test_any_leading_dimensions(leading):
    positions, normals, wrenches = case(rows=int(np.prod(leading)))
    positions, normals = (x.reshape(*leading, 4, 3) for x in (positions, normals))
    assert gj.quality(positions, normals).shape == leading
    assert gj.residual(positions, normals, wrenches).shape == (*leading, 2)
    assert gj.least_force(positions, normals, wrenches[:0]).shape == (*leading, 0)
    gradient = jax.grad(lambda p: gj.quality(p, normals).sum())(positions)
    assert gradient.shape == positions.shape


@pytest.mark.usefixtures("double")
def test_options_of_each_grasp_and_of_all():
    positions, normals, _ = case()
    options = {
        "origin": np.full((3, 3), 0.1),
        "length_scale": [1.0, 2.0, 0.5],
        "torsion": [0.1, 0.2, 0.1, 0.1],
    }
    edges = [4, 5, 6, 7]
    expected = gf.quality_many(np.asarray(positions), np.asarray(normals), edges=edges, **options).epsilon
    arrays = {name: jnp.asarray(value) for name, value in options.items()}
    for given in (options, arrays):
        np.testing.assert_array_equal(gj.quality(positions, normals, edges=edges, **given), expected)
    mapped = jax.vmap(
        lambda p, n, o, s: gj.quality(p, n, origin=o, length_scale=s, torsion=options["torsion"], edges=edges)
    )
    found = mapped(positions, normals, arrays["origin"], arrays["length_scale"])
    np.testing.assert_array_equal(found, expected)


@each_function
def test_a_row_that_is_no_grasp_passes_nothing_on(function):
    positions, normals, wrenches = case(rows=5)
    good = function(positions, normals, wrenches)
    positions, normals = positions.at[1, 0, 0].set(jnp.nan), normals.at[3, 2].set(0.0)
    values = function(positions, normals, wrenches)
    rows = np.array([0, 2, 4])
    np.testing.assert_array_equal(values[rows], good[rows])

    def loss(p, n):
        return ((function(p, n, wrenches) - 1.0) ** 2).mean()

    # NaN reaches the gradient of the loss by these rows, and stops there.
    for gradient in jax.grad(loss, argnums=(0, 1))(positions, normals):
        assert np.isfinite(gradient).all()
        assert (gradient[np.array([1, 3])] == 0).all()
    assert (jax.grad(loss)(positions, normals)[rows] != 0).any()


def test_the_value_of_rows_without_an_answer_can_be_chosen():
    positions, normals, _ = case()
    normals = normals.at[1].set(0.0)
    assert np.isnan(gj.quality(positions, normals)[1])
    assert gj.quality(positions, normals, unsolved=-1.0)[1] == -1.0
    pushed = gj.least_force(positions[:1, :1], normals[:1, :1], jnp.ones((1, 6)), unsolved=1e3)
    assert pushed.tolist() == [[1e3]]


def test_second_derivatives_are_refused():
    positions, normals, _ = case()

    def value(p):
        return gj.quality(p, normals).sum()

    for second in (
        jax.hessian(value),
        jax.jit(jax.hessian(value)),
        jax.grad(lambda p: jax.grad(value)(p).sum()),
    ):
        with pytest.raises(gf.GraspForceError, match="second"):
            second(positions)
    mixed = jax.grad(lambda scale: jax.grad(lambda p: scale * value(p))(positions).sum())(1.0)
    assert np.isfinite(mixed)


def test_derivatives_that_do_not_exist_are_refused_by_name():
    positions, normals, wrenches = case()
    with pytest.raises(gf.InvalidInputError, match="origin"):
        jax.grad(lambda origin: gj.quality(positions, normals, origin=origin).sum())(jnp.zeros(3))
    with pytest.raises(gf.InvalidInputError, match="friction"):
        jax.grad(lambda mu: gj.least_force(positions, normals, wrenches, friction=mu).sum())(0.5)
    stopped = jax.grad(lambda o: gj.quality(positions, normals, origin=jax.lax.stop_gradient(o)).sum())
    assert (stopped(jnp.zeros(3)) == 0).all()


def test_wrong_arguments_are_refused():
    with pytest.raises(gf.InvalidInputError, match="positions: shape"):
        gj.quality(jnp.zeros(3), jnp.zeros(3))
    with pytest.raises(TypeError, match="frictoin"):
        gj.quality(jnp.zeros((4, 3)), jnp.zeros((4, 3)), frictoin=1)
    with pytest.raises(gf.InvalidInputError, match="criterion"):
        jax.jit(lambda p: gj.quality(p, p, criterion="mean"))(jnp.zeros((4, 3)))


def test_large_batches_under_jit_do_not_wait_for_themselves():
    positions, normals, _ = case(rows=20_000)
    loss = jax.jit(jax.grad(lambda p: gj.quality(jnp.sin(p), normals, criterion="sum").mean()))
    assert np.isfinite(loss(positions)).all()


@pytest.mark.usefixtures("double")
@each_function
def test_a_ragged_batch_is_its_grasps(function):
    rng = np.random.default_rng(3)
    positions, normals, offsets = ragged_grasps(rng)
    positions, normals, wrenches = (jnp.asarray(x) for x in (positions, normals, rng.normal(size=(2, 6))))

    def total(p, n, w, of=slice(None), **options):
        values = function(p, n, w, **options)
        return jnp.nansum(values * weights[of]), values

    weights = jnp.asarray(rng.normal(size=function(positions, normals, wrenches, offsets=offsets).shape))
    by = jax.jit(jax.grad(lambda p, n, w: total(p, n, w, offsets=offsets)[0], argnums=(0, 1, 2)))
    found = by(positions, normals, wrenches)
    sum_by_wrench = jnp.zeros_like(wrenches)
    for row, (start, end) in enumerate(itertools.pairwise(offsets)):
        if start == end:
            continue
        one = positions[start:end], normals[start:end], wrenches
        alone = jax.grad(lambda p, n, w, row=row: total(p, n, w, row)[0], argnums=(0, 1, 2))(*one)
        np.testing.assert_allclose(found[0][start:end], alone[0], atol=1e-9)
        np.testing.assert_allclose(found[1][start:end], alone[1], atol=1e-9)
        sum_by_wrench = sum_by_wrench + alone[2]
    np.testing.assert_allclose(found[2], sum_by_wrench, atol=1e-9)
    twice = jax.vmap(lambda p: function(p, normals, wrenches, offsets=offsets))(jnp.stack([positions] * 2))
    np.testing.assert_allclose(twice[1], total(positions, normals, wrenches, offsets=offsets)[1])


@pytest.mark.usefixtures("double")
def test_smoothing_is_that_of_torch_and_has_its_derivative():
    positions, normals, _ = case(rows=6)

    def smoothed(p, n):
        return gj.quality(p, n, smoothing=0.02, friction=0.8)

    exact = gj.quality(positions, normals, friction=0.8)
    found = smoothed(positions, normals)
    assert (found <= exact).all()
    assert (found >= exact - 0.02 * np.log(16)).all()
    check_grads(smoothed, (positions, normals), **FINITE)
