"""Least contact forces: Table 1, the spatial reference cases, and HiGHS on generated grasps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.oracles import grasp_arguments, least_max, least_sum, outside_cones, primitive_wrenches
from support.reference_answers import SPATIAL

import graspforce as gf
from graspforce.paper import RACKET, RACKET_WRENCH, TABLE_1
from graspforce.paper.racket import grasp_at

OBJECTIVES = ["sum", "max"]
METHODS = ["implicit", "enumerated"]
ENUMERABLE = [case for case in SPATIAL if (case["edges"] + 1) ** len(case["positions"]) < 20_000]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("letter", TABLE_1)
def test_table_1_is_met(racket, letter, method):
    row, computed = TABLE_1[letter], racket["table1"]["rows"][letter]["computed"]
    grasp = grasp_at(RACKET[row.problem], row.params)
    least_sum_ = gf.ForceDistributor(grasp, "sum", method=method).solve(RACKET_WRENCH)
    least_max_ = gf.ForceDistributor(grasp, "max", method=method).solve(RACKET_WRENCH)
    assert least_sum_.sigma_sum == pytest.approx(computed[1], rel=1e-9)
    assert least_max_.sigma_max == pytest.approx(computed[2], rel=1e-9)
    assert least_max_.sigma_sum == pytest.approx(computed[3], rel=1e-9)


@pytest.mark.parametrize("letter", ["d", "e"])
def test_the_rows_that_follow_from_print_are_met_in_full(racket, letter):
    row, computed = TABLE_1[letter], racket["table1"]["rows"][letter]["computed"]
    grasp = grasp_at(RACKET[row.problem], row.params)
    solutions = [gf.ForceDistributor(grasp, objective).solve(RACKET_WRENCH) for objective in OBJECTIVES]
    found = [x for s in solutions for x in (s.sigma_max, s.sigma_sum)]
    assert found == pytest.approx(computed, rel=1e-9)
    assert found == pytest.approx([*row.least_sum[:2], *row.least_max[:2]], rel=2e-4)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_every_spatial_reference_wrench_is_balanced_with_the_least_forces(spatial_case, objective):
    check_reference(spatial_case, objective, "implicit")


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("case", ENUMERABLE, ids=lambda case: case["name"])
def test_the_papers_own_method_finds_the_same_least_forces(case, objective):
    check_reference(case, objective, "enumerated")


def check_reference(case, objective, method):
    grasp = gf.Grasp(**grasp_arguments(case))
    distributor = gf.ForceDistributor(grasp, objective, method=method)
    for row in case["wrenches"]:
        expected = row[f"sigma_{objective}"]
        if expected is None:
            with pytest.raises(gf.InfeasibleWrenchError) as caught:
                distributor.solve(row["external"])
            check_separation(caught.value.direction, grasp.primitive_wrenches, row["external"])
        else:
            solution = distributor.solve(row["external"])
            found = solution.sigma_sum if objective == "sum" else solution.sigma_max
            assert found == pytest.approx(expected, rel=1e-9)


def check_separation(direction, wrenches, external):
    scale = np.linalg.norm(wrenches, axis=1).max()
    assert (wrenches @ direction).max() <= 1e-9 * scale
    assert -np.dot(external, direction) > 0


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(3, 6), dim=st.sampled_from([2, 3]))
def test_highs_finds_no_smaller_forces_and_no_others(seed, count, dim):
    rng = np.random.default_rng(seed)
    outward = rng.normal(size=(count, dim))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    contacts = {"positions": outward, "normals": -outward + 0.2 * rng.normal(size=(count, dim))}
    contacts |= {"friction": rng.uniform(0.3, 1.0, count), "max_normal_force": rng.uniform(1, 10, count)}
    if dim == 3:
        contacts |= {"tangents": rng.normal(size=(count, dim)), "edges": 6}
    grasp, wrenches = gf.Grasp(**contacts), primitive_wrenches(**contacts)
    external = rng.normal(size=3 if dim == 2 else 6)
    for objective, oracle in (("sum", least_sum), ("max", least_max)):
        expected = oracle(wrenches, external)
        distributor = gf.ForceDistributor(grasp, objective)
        if expected is None:
            with pytest.raises(gf.InfeasibleWrenchError):
                distributor.solve(external)
            continue
        solution = distributor.solve(external)
        found = solution.sigma_sum if objective == "sum" else solution.sigma_max
        assert found == pytest.approx(expected, rel=1e-8)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), objective=st.sampled_from(OBJECTIVES))
def test_the_forces_balance_the_wrench_inside_their_cones(seed, objective):
    rng = np.random.default_rng(seed)
    outward = rng.normal(size=(5, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    grasp = gf.Grasp(outward, -outward, friction=0.8, max_normal_force=rng.uniform(1, 10, 5), edges=8)
    external = rng.normal(size=6)
    try:
        solution = gf.ForceDistributor(grasp, objective).solve(external)
    except gf.InfeasibleWrenchError as error:
        check_separation(error.direction, grasp.primitive_wrenches, external)
        return
    np.testing.assert_allclose(grasp.grasp_matrix @ solution.forces.ravel(), -external, atol=1e-9)
    assert (solution.forces[:, 0] >= -1e-12).all()
    assert (outside_cones(solution.forces, 0.8, 8) <= 1e-9).all()


def disc():
    return gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)


@pytest.mark.parametrize("edges", [8, None])
def test_forces_that_are_not_c_contiguous_and_writable_are_refused_untouched(edges):
    points = np.array([[1, 0, 0], [-0.5, 0.8, 0.2], [-0.5, -0.8, 0.3], [0.1, 0.2, -1]])
    distributor = gf.ForceDistributor(gf.Grasp(points, -points, friction=0.7, edges=edges), rtol=1e-6)
    wrench = np.array([0.1, 0, -1, 0, 0, 0.02])
    frozen = np.full((4, 3), 7.0)
    frozen.setflags(write=False)
    for forces in (np.full((4, 3), 7.0, order="F"), np.full((8, 3), 7.0)[::2], frozen):
        with pytest.raises(gf.InvalidInputError, match="forces"):
            distributor.solve_into(wrench, forces)
        assert (forces == 7).all()
    expected, forces = distributor.solve(wrench).forces, np.empty((4, 3))
    # The wrench may be a view of what is written.
    aliased = forces.reshape(-1)[:6]
    aliased[:] = wrench
    distributor.solve_into(aliased, forces)
    assert forces == pytest.approx(expected, abs=1e-5)


def test_an_empty_batch_has_no_rows():
    distributor = gf.ForceDistributor(disc())
    for parallel in (False, True):
        assert distributor.solve_many(np.empty((0, 3)), parallel=parallel).forces.shape == (0, 2, 2)
    assert distributor.solve([0, -1, 0]).sigma_max == pytest.approx(0.25)


def test_shares_are_what_the_maximum_and_the_sum_are_of():
    forces = [[[5, 1], [5, -1]]] * 2
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], extreme_forces=forces)
    general = gf.ForceDistributor(grasp).solve([0, -1, 0])
    assert general.shares == pytest.approx([0.5, 0.5])
    usual = gf.ForceDistributor(disc()).solve([0.3, -1, 0.1])
    assert usual.shares == pytest.approx(usual.forces[:, 0] / 4)
    for solution in (general, usual):
        assert solution.shares.max() == pytest.approx(solution.sigma_max)
        assert solution.shares.sum() == pytest.approx(solution.sigma_sum)
        assert solution.to_dict()["shares"] == solution.shares.tolist()


def test_one_lower_bound_holds_for_as_many_contacts_as_a_grasp_has():
    distributor = gf.ForceDistributor(disc(), min_normal=0.25)
    angles = 2 * np.pi * np.arange(3) / 3
    three = np.column_stack([np.cos(angles), np.sin(angles)])
    distributor.update(gf.Grasp(three, -three))
    assert distributor.min_normal.tolist() == [0.25] * 3
    assert distributor.solve([0, 0, 0]).shares == pytest.approx([0.25] * 3)


def test_a_bad_sample_is_named_by_its_row_and_samples_only_go_with_reduced():
    for sample in ([0, 0, 0], [0, np.nan, 0]):
        with pytest.raises(gf.InvalidInputError, match="samples, row 1"):
            gf.ForceDistributor(disc(), method="reduced", samples=[[0, -1, 0], sample])
    with pytest.raises(gf.InvalidInputError, match="samples: only"):
        gf.ForceDistributor(disc(), samples=[[0, -1, 0]])


def test_torque_limits_name_the_option_that_is_wrong():
    for edges in (-1, 2, 257):
        with pytest.raises(gf.InvalidInputError, match="edges"):
            gf.torque_limited_forces([[0.1], [0], [0]], [0.5], edges=edges)
    with pytest.raises(gf.InvalidInputError, match="max_normal_force"):
        gf.torque_limited_forces([[0.1], [0], [0]], [0.5], max_normal_force=0)


def test_a_grasp_tells_its_torsion_margin_and_tangents():
    points, tangents = np.eye(3), np.roll(np.eye(3), 1, axis=1)
    grasp = gf.Grasp(points, -points, torsion=0.2, tangents=tangents, friction_margin=1.5)
    assert grasp.torsion.tolist() == [0.2] * 3
    assert grasp.friction_margin == 1.5
    assert grasp.tangents == pytest.approx(tangents)
    assert disc().tangents is None
    assert disc().torsion.tolist() == [0, 0]


@pytest.mark.parametrize("options", [{}, {"min_normal": 0.1}, {"objective": "sum"}, {"weight": 0.1}])
def test_answers_are_balanced_and_a_record_whose_residual_is_not_rounding_is_not(options):
    grasp = gf.Grasp([(-1, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 0, 0), (-1, 0, 0), (0, -1, 0)], friction=0.8)
    distributor = gf.ForceDistributor(grasp, **options)
    for wrench in ([0, 0, -1, 0, 0, 0], [0, 0, 0, 0, 0, 0], [1e-9, 0, 0, 0, 0, 1e-9], [1e3, 0, 5, 2, 0, 0]):
        solution = distributor.solve(wrench)
        assert solution.balanced
        assert solution.to_dict()["balanced"]
        make, state = solution.__reduce__()
        assert make(*state).balanced
        dual, residual = state[3]
        size = max(np.abs(wrench).max(), 1e-3)
        with pytest.raises(gf.InvalidInputError, match="residual"):
            make(*state[:3], [dual, [1e-6 * size + x for x in residual]], *state[4:])
