"""Results own their arrays, and no pickle makes a result that contradicts itself."""

import contextlib
import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import graspforce as gf
from graspforce.adapters.contact_reading import ContactReading
from graspforce.surfaces import contacts_on, ellipse

SPATIAL = gf.Grasp(
    [(-1, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 0, 0), (-1, 0, 0), (0, -1, 0)], torsion=0.1, edges=3
)
PLANAR = gf.Grasp([(-1, 0.1), (1, 0)], [(1, 0), (-1, 0)])


def results():
    for grasp, wrench in ((SPATIAL, [0, 0, -1, 0, 0, 0]), (PLANAR, [0, -1, 0])):
        distributor = gf.ForceDistributor(grasp)
        yield grasp
        yield distributor
        yield grasp.quality("max")
        yield grasp.quality("sum", external_wrench=wrench)
        yield grasp.quality("max").gradient
        yield grasp.minkowski_sum()
        yield distributor.solve(wrench)
        yield distributor.solve_many([wrench, np.full(len(wrench), np.nan)])
    one_sided = gf.Grasp([(-1, 0)], [(1, 0)])
    yield one_sided.quality("max")
    yield gf.ForceDistributor(one_sided).solve_many([[1.0, 0, 0], [-1.0, 0, 0]])
    yield gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0).quality("max")
    yield gf.quality_many([PLANAR.positions, PLANAR.positions], [PLANAR.normals, 0 * PLANAR.normals])
    disc = contacts_on(*[ellipse(2.0, 1.0)] * 2)
    yield gf.plan(contacts_on(*[ellipse(2.0, 1.0)] * 3), [0.5, 2.5, 4.5], 0.2, 0.1, [(0, 7)] * 3)
    yield gf.plan_multistart(disc, [(0, 6)] * 2, 0.5, 0.2, starts=3)
    yield gf.plan_global(disc, [(0, 6)] * 2, max_boxes=50)
    yield gf.refine(disc, [0.5, 3.0], [(0, 6)] * 2, max_iterations=3)
    yield gf.PlacementNoise(0.01, 0.1, samples=3)
    yield gf.PlacementNoise(0.01, 0.1, samples=3).quality(PLANAR.positions[None], PLANAR.normals[None])
    yield PLANAR.measures()
    yield ContactReading(PLANAR, np.ones((2, 2)), (0, 1))


RESULTS = list(results())
OF_FINITE_SETS = {"extreme_forces", "primitive_wrenches"}


def use(result):
    """Ask a result everything it can answer without an argument, and return its arrays."""
    for method in ("__repr__", "_repr_html_", "to_dict", "to_scipy", "__len__"):
        if hasattr(result, method):
            getattr(result, method)()
    values = {}
    for name in (name for name in dir(result) if not name.startswith("_")):
        # The gradient is computed when it is asked for, and an external wrench may be too large for that.
        raises = name == "gradient" or (name in OF_FINITE_SETS and not result.num_edges.all())
        with contextlib.suppress(gf.GraspForceError if raises else ()):
            values[name] = getattr(result, name)
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


@pytest.mark.parametrize("again", [lambda x: x, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
@pytest.mark.parametrize("result", RESULTS, ids=lambda result: type(result).__name__)
def test_arrays_of_results_cannot_be_written(result, again):
    for name, array in use(again(result)).items():
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
        assert not array.flags.writeable, name


@pytest.mark.parametrize("result", RESULTS, ids=lambda result: type(result).__name__)
def test_arrays_of_compiled_results_stay_as_they_are_whatever_their_flags_are_set_to(result):
    if type(result).__module__ != "graspforce" or isinstance(result, gf.PlanSet):
        pytest.skip("of Python")
    before = {name: array.copy() for name, array in use(result).items()}
    for array in use(result).values():
        with contextlib.suppress(ValueError):
            array.flags.writeable = True
            array[...] = 7
    for name, array in use(result).items():
        np.testing.assert_array_equal(array, before[name], err_msg=name)


def test_arrays_of_python_results_cannot_be_written_and_their_makers_still_can_write():
    given = np.ones((3, 4))
    reading = ContactReading(SPATIAL, given, (0, 1, 2))
    for reading_ in (reading, copy.copy(reading), pickle.loads(pickle.dumps(reading))):
        arrays = use(reading_)
        assert len(arrays) >= 2
        for array in arrays.values():
            assert not array.flags.writeable
    given[0, 0] = 2.0


def test_a_witness_cannot_be_written():
    with pytest.raises(gf.InfeasibleWrenchError) as raised:
        gf.ForceDistributor(gf.Grasp([(-1, 0)], [(1, 0)])).solve([1.0, 0, 0])
    with pytest.raises(ValueError, match="read-only"):
        raised.value.direction[0] = 0


def leaves(state, path=()):
    """Paths to everything inside a state that a pickle could claim otherwise."""
    yield path
    items = (
        state.items()
        if isinstance(state, dict)
        else enumerate(state if isinstance(state, tuple | list) else ())
    )
    for i, item in items:
        yield from leaves(item, (*path, i))


def replaced(state, path, value):
    if not path:
        return value
    if isinstance(state, dict):
        return state | {path[0]: replaced(state[path[0]], path[1:], value)}
    items = list(state)
    items[path[0]] = replaced(items[path[0]], path[1:], value)
    return type(state)(items)


def at(state, path):
    for i in path:
        state = state[i]
    return state


STRANGE = [
    None, True, -1, 0, 1, 2, 7, 2**31, 2**63, -(2**70), 0.0, -1.0, 0.5, 1e308, math.nan, math.inf, -math.inf,
    "", "force", "none", "max", [], (), [1], [1.0, 2.0], [math.nan] * 6, [[0.0] * 3] * 3, [[1.0] * 4] * 3,
]  # fmt: skip


@st.composite
def mangled(draw):
    result = draw(st.sampled_from(RESULTS))
    make, state = result.__reduce__()[:2]
    for _ in range(draw(st.integers(1, 2))):
        path = draw(st.sampled_from(list(leaves(state))))
        old = at(state, path)
        choices = [draw(st.sampled_from(STRANGE))]
        if isinstance(old, list | tuple) and path:
            choices += [old[:-1], type(old)([*old, *old[:1]]), old[::-1], type(old)(), list(old)]
        if isinstance(old, gf.Grasp | gf.Quality):
            choices += [SPATIAL, SPATIAL.quality(), PLANAR.quality("sum")]
        if isinstance(old, float) and not isinstance(old, bool):
            choices += [-old, math.nextafter(old, math.inf), 2 * old, draw(st.floats())]
        if isinstance(old, np.ndarray):
            changed = np.array(old)
            if changed.size:
                entry = draw(st.integers(0, changed.size - 1))
                strange = [0, 1, -1, 100] + ([math.nan, math.inf] if changed.dtype.kind == "f" else [])
                changed.flat[entry] = draw(st.sampled_from(strange))
            choices += [changed, old[:-1], old[..., :-1], old.T, old.astype(np.float32), old[None]]
        if isinstance(old, int) and not isinstance(old, bool):
            choices += [old + 1, old - 1, -old]
        state = replaced(state, path, draw(st.sampled_from(choices)))
        if not isinstance(state, tuple):
            state = (state,)
            break
    return make, state


@settings(max_examples=600, deadline=None)
@given(mangled())
def test_a_mangled_record_is_refused_or_makes_a_whole_result(case):
    make, state = case
    try:
        result = make(*state)
    except (gf.GraspForceError, TypeError, ValueError, OverflowError):
        return
    if not isinstance(make, type):  # a constructor's arguments are tested as such
        for name, array in use(result).items():
            status = getattr(result, "status", None)
            solved = array if status is None or len(status) != len(array) else array[status == 0]
            unknown = name == "slip_margin" or (name == "epsilon" and isinstance(result, gf.PlanSet))
            assert unknown or np.isfinite(solved).all(), name


def state_of(result):
    make, state = result.__reduce__()
    return make, list(state)


def test_records_that_contradict_themselves_are_refused():
    make, state = state_of(SPATIAL.quality("max"))
    rho, lower, upper = state[6]
    for field, value in [
        (6, (rho, upper + 1, upper)), (6, (math.nan, lower, upper)), (6, (-rho, lower, upper)),
        (6, (rho, rho, -math.inf)), (7, (True, "none", 3)), (7, (True, "closed", 3)),
        (8, [1.0]), (8, [math.nan] * 6), (8, [0.0] * 6), (9, [0.0] * 5), (9, [1e3] * 6),
    ]:  # fmt: skip
        with pytest.raises(gf.InvalidInputError):
            make(*state[:field], value, *state[field + 1 :])
    make, state = state_of(SPATIAL.minkowski_sum())
    starts, ends, contacts, edges = (np.array(array) for array in state[1])
    for indices in [
        (starts, ends, contacts + 1, edges), (starts, ends, contacts, edges + 90),
        (starts, ends, contacts, -edges), (starts[:-1], ends, contacts, edges),
        (starts + 1, ends, contacts, edges), (starts, ends + 1, contacts, edges),
        (ends, starts, contacts, edges), (starts, ends, contacts[:-1], edges),
    ]:  # fmt: skip
        with pytest.raises(gf.InvalidInputError):
            make(state[0], indices, *state[2:])
    for offsets, rows in (([], 3), ([1, 3], 9), ([5, 2, 1], 9), (state[2], 1), (state[2], 2**40)):
        with pytest.raises(gf.InvalidInputError):
            make(state[0], state[1], offsets, rows)
    make, state = state_of(gf.ForceDistributor(PLANAR).solve_many([[0, -1, 0], [math.nan] * 3]))
    forces, largest, sums, rest, held, lengths, gaps, status = state
    for changed in [
        (forces[:1], *state[1:]), (forces, largest[:1], *state[2:]), (*state[:7], 1 - status),
        (*state[:7], status + 4), (*state[:4], ~held, *state[5:]), (*state[:5], -lengths[:1], gaps, status),
        (*state[:6], gaps[:1], status),
        (forces * math.nan, *state[1:]), (forces[:, :, :1], *state[1:]),
        (forces, largest, sums, rest[:, :2], *state[4:]),
    ]:  # fmt: skip
        with pytest.raises(gf.InvalidInputError):
            make(*changed)
    make, ((good, bad), *records) = gf.quality_many(
        [PLANAR.positions] * 2, [PLANAR.normals, [(0, 0)] * 2]
    ).__reduce__()
    for rows in [
        [(good[0], good[2] + 1, good[2], *good[3:])], [(*good[:3], -2, *good[4:])], [(*good[:4], 1, None)],
        [(*good[:5], "why")], [(*bad[:5], None)], [(0.0, *bad[1:])],
    ]:  # fmt: skip
        with pytest.raises(gf.InvalidInputError):
            make(rows, *records)


def test_records_of_plans_that_contradict_themselves_are_refused():
    kinds = {type(result): result for result in RESULTS}
    plan, plans, optimum = kinds[gf.Plan], kinds[gf.PlanSet], kinds[gf.GlobalOptimum]
    for result, changes in [
        (plan, {"history": ()}), (plan, {"history": None}), (plan, {"blocks": ((0, 1),)}),
        (plan, {"grasp": SPATIAL}), (plan, {"quality": plan.grasp}), (plan, {"criterion": "sum"}),
        (plan, {"params": plan.params[:2]}), (plan, {"counts": 3}), (plan, {"stopped": "tired"}),
        (plans, {"plans": ()}), (plans, {"plans": (plan,)}), (plans, {"epsilon": plans.epsilon[:1]}),
        (plans, {"failures": {7: "why"}}), (plans, {"failures": None}), (plans, {"seconds": math.nan}),
        (optimum, {"epsilon_upper": optimum.quality.epsilon - 1}), (optimum, {"gap": optimum.gap + 1}),
        (optimum, {"boxes": -1}), (optimum, {"proven": 1}), (optimum, {"quality": None}),
    ]:  # fmt: skip
        make, (kind, fields) = result.__reduce__()
        assert repr(make(kind, fields)) == repr(result)
        with pytest.raises(gf.InvalidInputError):
            make(kind, fields | changes)
    make = plan.__reduce__()[0]
    for kind in (dict, "Plan", None):
        with pytest.raises(gf.InvalidInputError):
            make(kind, {})


def test_a_restored_result_does_not_share_arrays_with_the_record():
    make, state = state_of(SPATIAL.minkowski_sum())
    contacts = np.array(state[1][2])
    points = make(state[0], (*state[1][:2], contacts, state[1][3]), *state[2:])
    contacts[:] = 10**6
    points.to_scipy()
    with pytest.raises(ValueError, match="WRITEABLE"):
        points.contacts.flags.writeable = True
