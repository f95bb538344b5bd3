"""Arguments of any shape, type and size: each call answers with finite numbers, or refuses by name.

HOSTILE_EXAMPLES sets how many inputs each entry point is given.
"""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.hostile_values import HOSTILE, NUMBERS, arrays, counts, scalars, words

import graspforce as gf
from graspforce._core import BoxBound, CandidateSearch, TriangleTree

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")  # contacts are drawn at random

# What a caller may expect to catch; OverflowError is Python's own for whole numbers out of range.
REFUSALS = (gf.GraspForceError, TypeError, ValueError, OverflowError)


def refused_by_name(error):
    assert str(error), repr(error)
    assert type(error).__name__ != "PanicException"


def answer(call, *arguments, **options):
    """Return what the call answers, None where it refuses; whatever else it raises fails the test."""
    try:
        return call(*arguments, **options)
    except REFUSALS as error:
        refused_by_name(error)
        return None


def assert_finite(*values):
    for value in values:
        assert np.isfinite(np.asarray(value, dtype=float)).all(), value


@st.composite
def grasp_options(draw, count, dim):
    options = {}
    optional = {
        "friction": st.one_of(scalars(), arrays(count)),
        "max_normal_force": st.one_of(scalars(), arrays(count)),
        "edges": st.one_of(counts(), st.lists(st.integers(2, 9), min_size=count, max_size=count)),
        "torsion": st.one_of(scalars(), arrays(count)),
        "tangents": arrays(count, dim),
        "origin": arrays(dim),
        "length_scale": scalars(),
        "friction_margin": scalars(),
        "extreme_forces": st.lists(arrays(3, dim), min_size=count, max_size=count),
    }
    for name, values in optional.items():
        if draw(st.integers(0, 4)) == 0:
            options[name] = draw(values)
    return options


@st.composite
def grasps(draw):
    count, dim = draw(st.integers(1, 5)), draw(st.integers(2, 3))
    contacts = draw(arrays(count, dim)), draw(arrays(count, dim))
    return answer(gf.Grasp, *contacts, **draw(grasp_options(count, dim)))


def ordinary_grasps():
    """Mostly closed grasps, so that queries have something to answer."""
    square = [(1, 0), (0, 1), (-1, 0), (0, -1)]
    flat = gf.Grasp(square, -np.array(square), friction=0.5)
    faces = np.vstack([np.eye(3), -np.eye(3)])[[0, 1, 3, 4]]
    hard = gf.Grasp(faces, -faces, friction=0.6, edges=5)
    soft = gf.Grasp(faces, -faces, friction=0.6, edges=None, torsion=0.1)
    return st.sampled_from([flat, hard, soft])


ANY_GRASP = st.one_of(ordinary_grasps(), ordinary_grasps(), grasps())


@HOSTILE
@given(grasps(), words("max", "sum"), scalars(), st.data())
def test_a_grasp_answers_or_refuses(grasp, criterion, rtol, data):
    if grasp is None:
        return
    d = grasp.wrench_dim
    assert_finite(grasp.positions, grasp.normals, grasp.frames, grasp.grasp_matrix)
    forces = answer(lambda: grasp.primitive_wrenches)
    if forces is not None:
        assert_finite(forces)
    assert isinstance(answer(lambda: grasp.is_force_closure), bool | None)
    again = pickle.loads(pickle.dumps(grasp))
    np.testing.assert_array_equal(again.grasp_matrix, grasp.grasp_matrix)
    answer(grasp.to_dict)
    answer(grasp._repr_html_)
    found = answer(grasp.measures)
    if found is not None:
        assert np.isfinite(found.isotropy)
    # Converging on true cones takes a second; a wide bracket is an answer, too.
    rtol = 1e-2 if isinstance(rtol, float) and rtol < 1e-2 else rtol
    options = {"rtol": rtol}
    if data.draw(st.booleans()):
        options["external_wrench"] = data.draw(arrays(d))
    if data.draw(st.integers(0, 3)) == 0:
        options["metric"] = data.draw(arrays(d, d))
    quality = answer(grasp.quality, criterion, **options)
    if quality is not None:
        assert quality.lower <= quality.rho <= quality.upper
        assert_finite(quality.rho, quality.lower, quality.upper, quality.direction, quality.wrench)
        gradient = answer(lambda: quality.gradient)
        if gradient is not None:
            assert_finite(gradient.positions, gradient.normals, gradient.spins)
        assert pickle.loads(pickle.dumps(quality)).rho == quality.rho
    answer(grasp.minkowski_sum, max_points=data.draw(st.sampled_from([0, 1, 1000, -1, 2**200, "x", 1.5])))


@HOSTILE
@given(ANY_GRASP, st.data())
def test_resistance_is_a_multiple_or_refused(grasp, data):
    if grasp is None:
        return
    rows = data.draw(st.integers(0, 3))
    found = answer(
        grasp.resistance, data.draw(arrays(rows, grasp.wrench_dim)), data.draw(words("max", "sum"))
    )
    if found is not None:
        assert (np.asarray(found) >= 0).all()


@HOSTILE
@given(ANY_GRASP, words("max", "sum"), words("implicit", "enumerated", "reduced"), st.data())
def test_forces_balance_or_are_refused(grasp, objective, method, data):
    if grasp is None:
        return
    d, m = grasp.wrench_dim, grasp.num_contacts
    options = {"objective": objective}
    for name, values in {
        "method": st.just(method),
        "weight": scalars(),
        "min_normal": st.one_of(scalars(), arrays(m)),
        "samples": arrays(2, d),
        "rtol": scalars(),
    }.items():
        if data.draw(st.integers(0, 3)) == 0:
            options[name] = data.draw(values)
    if method != "implicit" and grasp.num_edges.max() > 9:
        return  # its points are listed, up to 200 MB of them
    distributor = answer(gf.ForceDistributor, grasp, **options)
    if distributor is None:
        return
    pickle.loads(pickle.dumps(distributor))
    wrench = data.draw(arrays(d))
    solution = answer(distributor.solve, wrench)
    forces = np.full((m, grasp.force_dim), 7.0)
    sigma = answer(distributor.solve_into, wrench, forces)
    assert (solution is None) == (sigma is None)
    if solution is not None:
        assert_finite(solution.forces, solution.sigma_max, solution.sigma_sum, solution.gap, solution.dual)
        assert_finite(forces, sigma)
        np.testing.assert_allclose(forces, solution.forces, rtol=1e-5, atol=1e-9 * np.abs(forces).max())
    else:
        assert (forces == 7).all()
    answer(distributor.solve_into, wrench, data.draw(arrays(m, grasp.force_dim)))
    batch = answer(distributor.solve_many, data.draw(arrays(3, d)), parallel=data.draw(st.booleans()))
    if batch is not None:
        solved = batch.status == 0
        assert_finite(batch.forces[solved], batch.sigma_max[solved])
        assert np.isnan(batch.forces[~solved]).all()
    answer(
        list,
        answer(distributor.solve_iter, data.draw(st.one_of(arrays(2, d), st.none(), st.just([wrench]))))
        or (),
    )


@HOSTILE
@given(st.integers(0, 3), st.integers(1, 4), st.integers(2, 3), words("max", "sum"), st.data())
def test_a_batch_answers_row_by_row(rows, count, dim, criterion, data):
    contacts = data.draw(arrays(rows, count, dim)), data.draw(arrays(rows, count, dim))
    options = {**data.draw(grasp_options(count, dim)), "criterion": criterion, "rtol": 1e-2}
    batch = answer(gf.quality_many, *contacts, **options, gradient=data.draw(st.booleans()))
    if batch is not None:
        good = batch.status != 2
        if batch.gradient is not None:
            assert_finite(batch.gradient.positions[good], batch.gradient.friction[good])
        assert_finite(batch.rho[good])
        assert (batch.lower[good] <= batch.upper[good]).all()
        assert sorted(batch.errors) == np.flatnonzero(~good).tolist()
        assert len(pickle.loads(pickle.dumps(batch))) == len(batch)
    search = answer(CandidateSearch, dim, criterion, rtol=1e-2, prune=data.draw(st.booleans()))
    if search is not None:
        answer(search.best, *contacts, center_index=data.draw(st.integers(-1, 5)), edges=4)
    bound = answer(BoxBound, data.draw(counts()), criterion)
    if bound is not None:
        axes = (
            {"axes": data.draw(counts()), "safety": data.draw(scalars())} if data.draw(st.booleans()) else {}
        )
        answer(bound.over, data.draw(arrays(rows)), *contacts, edges=4, enough=data.draw(NUMBERS), **axes)


@HOSTILE
@given(st.data())
def test_joint_torques_and_meshes_answer_or_refuse(data):
    joints = data.draw(st.integers(0, 4))
    forces = answer(
        gf.torque_limited_forces,
        data.draw(arrays(3, joints)),
        data.draw(st.one_of(arrays(joints), arrays(2, joints))),
        friction=data.draw(scalars()),
        max_normal_force=data.draw(scalars()),
        edges=data.draw(st.sampled_from([3, 8, 0, -1, 2**40, "8"])),
    )
    if forces is not None:
        assert_finite(forces)
    faces = data.draw(st.one_of(arrays(2, 3), st.just([[0, 1, 2], [0, 2, 3]])))
    tree = answer(TriangleTree, data.draw(arrays(4, 3)), faces)
    if tree is not None:
        found = answer(tree.closest, data.draw(arrays(2, 3)))
        if found is not None:
            assert (found[1] >= 0).all()


def disc(angles):
    outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return outward, -outward


@HOSTILE
@given(
    st.sampled_from([gf.plan, gf.plan_multistart, gf.plan_global, gf.refine]), words("max", "sum"), st.data()
)
def test_planning_answers_or_refuses(planner, criterion, data):
    # One value of many is replaced by a hostile one: all at once would mostly be refused for the first.
    good = {
        gf.plan: {"initial": [0.0, 2.0], "step": 0.5, "tolerance": 0.1},
        gf.plan_multistart: {"step": 0.5, "tolerance": 0.1, "starts": 2},
        gf.plan_global: {"gap": 0.5},
        gf.refine: {"params": [0.0, 2.0], "max_iterations": 2},
    }[planner] | {"bounds": [(0, 1), (1, 4)], "criterion": "max"}
    replaced = data.draw(st.sampled_from(sorted(good)))
    hostile = {
        "initial": arrays(2),
        "params": arrays(2),
        "step": st.one_of(scalars(), arrays(2)),
        "tolerance": st.one_of(st.sampled_from([0.0, -1.0, np.nan, np.inf, 1e-3, None, "x"]), arrays(2)),
        "bounds": arrays(2, 2),
        "starts": st.one_of(st.sampled_from([0, -1, 2.5, None, "x", True]), arrays(2, 2)),
        "gap": st.sampled_from([0.0, -1.0, 1.0, np.nan, 0.9, None, "x"]),
        "max_iterations": st.sampled_from([0, -1, None, 2.5, "x"]),
        "criterion": st.just(criterion),
    }
    options = {"friction": data.draw(scalars())} if data.draw(st.integers(0, 3)) == 0 else {}
    options |= good | {replaced: data.draw(hostile[replaced])}
    if planner is gf.plan_global:
        options["max_boxes"] = 200
    elif planner is not gf.refine:
        options["time_limit"] = 0.5
    surface = disc
    if data.draw(st.integers(0, 2)) == 0:
        returned = data.draw(arrays(1, 2, 2))
        surface = data.draw(
            st.sampled_from(
                [lambda _: returned, lambda p: (returned, returned)[: len(p) + 1], lambda _: None]
            )
        )
    found = answer(planner, surface, **options)
    if found is not None:
        best = found.best if planner is gf.plan_multistart else found
        assert_finite(best.params, best.quality.rho)


@HOSTILE
@given(
    scalars(),
    scalars(),
    st.sampled_from([1, 3, 0, -1, 2.5, None, "x"]),
    words("mean", "percentile_5"),
    st.data(),
)
def test_placement_answers_or_refuses(position, normal, samples, statistic, data):
    noise = answer(
        gf.PlacementNoise, position_std=position, normal_std=normal, samples=samples, statistic=statistic
    )
    if noise is not None:
        found = answer(noise.quality, data.draw(arrays(2, 3, 2)), data.draw(arrays(2, 3, 2)))
        if found is not None:
            assert_finite(found.epsilon)


@pytest.mark.parametrize("raised", [KeyboardInterrupt, SystemExit])
def test_what_ends_a_program_is_never_mistaken_for_a_bad_argument(raised):
    class Impatient:
        def __array__(self, *_args, **_options):
            raise raised

        def __iter__(self):
            raise raised

    pair = [(-1, 0), (1, 0)]
    with pytest.raises(raised):
        gf.Grasp(pair, Impatient())
    grasp = gf.Grasp(pair, [(1, 0), (-1, 0)])
    with pytest.raises(raised):
        gf.ForceDistributor(grasp).solve(Impatient())
    assert grasp.quality().closure == "force"
