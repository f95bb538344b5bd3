"""Least squares, nearest forces, limits that change, joint torques: what a controller asks."""

import copy
import pickle

import numpy as np
import pytest
from benches.trust import degenerate_nearest, limited_sums, nearest
from benches.trust.control import hands, hard_squares, rows

import graspforce as gf

FEET = [(0.3, 0.2, 0), (0.3, -0.2, 0), (-0.3, 0.2, 0), (-0.3, -0.2, 0)]


def feet(**changes):
    arguments = {"friction": 0.6, "max_normal_force": 100, "edges": None} | changes
    return gf.Grasp(FEET, [(0, 0, 1)] * 4, **arguments)


def test_a_share_of_the_family_agrees_with_clarabel():
    for row in rows(0.03):
        assert (row.missed, row.wrong) == (0, 0), row


def test_residuals_of_infeasible_wrenches_are_certified_and_clarabels():
    for row in [*nearest.rows(0.06), *limited_sums.rows(0.1)]:
        assert (row.missed, row.wrong) == (0, 0), row


def test_nearest_forces_of_grasps_degenerate_but_for_noise_are_proven():
    for row in degenerate_nearest.rows(0.02):
        assert (row.missed, row.wrong) == (0, 0), row


def test_nearest_forces_have_a_finite_gap_on_a_noisy_ring_and_beside_tiny_wrenches():
    angles = 2 * np.pi * np.arange(3) / 3
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    for noise in 10.0 ** np.arange(-12, -6):
        rng = np.random.default_rng(3)
        grasp = gf.Grasp(
            1e-3 * (ring + noise * rng.normal(size=(3, 3))),
            noise * rng.normal(size=(3, 3)) - ring,
            friction=0.3,
            edges=5,
            max_normal_force=[0.00168, 0.01016, 0.0619],
            length_scale=0.001,
        )
        found = gf.ForceDistributor(grasp, weight=10).nearest([0, 0, 0.00619, 0, 0, 0])
        assert found.gap <= 1e-9
        parallel = gf.Grasp(
            ring + noise * rng.normal(size=(3, 3)), [(0, 0, 1)] * 3, friction=0, max_normal_force=2
        )
        for objective in ("max", "sum", "squares"):
            wrench = -parallel.grasp_matrix @ [1, 0, 0, 2, 0, 0, 1, 0, 0]
            assert gf.ForceDistributor(parallel, objective).nearest(wrench).gap <= 1e-9
            pinch = gf.Grasp([(1, noise, 0), (-1, 0, 0)], [(-1, 0, 0), (1, 0, 0)], friction=0)
            assert gf.ForceDistributor(pinch, objective).nearest([0, 0, 1e-17, 0, 0, 0]).gap <= 1


@pytest.mark.parametrize(
    ("seed", "friction", "limits", "external"),
    [
        (2, [0.4, 0.9, 0.4], [6.9, 3.1, 9.6], [1.3, -0.6, 2.1]),
        (3, [0.1, 1.0, 0.2, 0.7], [7.0, 13.6, 0.7, 18.1], [2.0, 1.0, -1.0]),
    ],
)
@pytest.mark.parametrize("objective", ["max", "sum", "squares"])
def test_limits_far_apart_leave_no_loose_gap(seed, friction, limits, external, objective):
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(len(limits), 2))
    normals = -positions + 0.5 * rng.normal(size=positions.shape)
    grasp = gf.Grasp(positions, normals, friction=friction, max_normal_force=limits)
    distributor = gf.ForceDistributor(grasp, objective)
    for size in (0.1, 1.0, 10.0, 1e3):
        assert distributor.nearest(np.array(external) * size).gap < 1e-8


def test_an_infeasible_wrench_has_a_witness():
    infeasible = 0
    for rng, grasp in hands(30, 1):
        distributor = gf.ForceDistributor(grasp, "squares", limits=True)
        external = rng.normal(size=6)
        if distributor.solve_many([external]).status[0] == gf.Status.INFEASIBLE:
            with pytest.raises(gf.InfeasibleWrenchError) as refused:
                distributor.solve(external)
            assert -external @ refused.value.direction > 0
            infeasible += 1
    assert infeasible > 10


def test_a_price_of_the_residual_answers_every_wrench():
    for rng, grasp in hands(40, 2, contacts=3):
        distributor = gf.ForceDistributor(grasp, "squares", limits=True, slack=7.0)
        external = rng.normal(size=6) * 3
        ours = distributor.solve(external)
        value = (ours.forces**2).sum() / 2 + 7 * (ours.residual**2).sum() / 2
        theirs = hard_squares(grasp, external, limits=True, price=7.0)
        assert theirs is None or value == pytest.approx(theirs, rel=1e-6)
        assert ours.gap < 1e-9
        assert (ours.shares <= 1 + 1e-12).all()


@pytest.mark.parametrize("objective", ["max", "sum", "squares"])
def test_nearest_forces_come_as_near_as_clarabels(objective):
    for rng, grasp in hands(25, 3):
        distributor = gf.ForceDistributor(grasp, objective, rtol=1e-6)
        external = rng.normal(size=6) * 2
        found = distributor.nearest(external)
        theirs = hard_squares(grasp, external, limits=True, price=1.0, weight=1e-7)
        if theirs is not None:
            assert found.distance <= np.sqrt(2 * theirs) + 1e-5
        assert np.linalg.norm(found.residual) == pytest.approx(found.distance, rel=1e-6, abs=1e-12)
        forces = np.empty((4, 3))
        assert distributor.nearest_into(external, forces) == pytest.approx(
            found.distance, rel=1e-6, abs=1e-12
        )
        assert (found.shares <= 1 + 2e-6).all()


def test_a_batch_gives_the_nearest_forces_of_each_row():
    distributor = gf.ForceDistributor(feet())
    wrenches = np.array([[0, 0, -100, 0, 0, 0], [0, 0, -500, 0, 0, 0], [0, 0, 10, 0, 0, 0]])
    batch = distributor.solve_many(wrenches, infeasible="nearest")
    assert batch.status.tolist() == [gf.Status.SOLVED] * 3
    np.testing.assert_allclose(np.linalg.norm(batch.residual, axis=1), [0, 100, 10], atol=1e-5)
    assert distributor.solve_many(wrenches).status.tolist() == [0, 0, gf.Status.INFEASIBLE]
    with pytest.raises(gf.InvalidInputError, match=r"infeasible: .no. is neither"):
        distributor.solve_many(wrenches, infeasible="no")


def test_a_metric_decides_what_is_nearest():
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    distributor = gf.ForceDistributor(grasp)
    external = [1.0, -5, 0]
    for weights in ([1, 1, 1], [1, 100, 1]):
        metric = np.diag(np.array(weights, float))
        found = distributor.nearest(external, metric=metric)
        assert found.distance == pytest.approx(np.sqrt(found.residual @ metric @ found.residual), rel=1e-9)
    assert distributor.nearest(external, limits=False).distance < 1e-9


def test_limits_survive_copies_and_pickles():
    distributor = gf.ForceDistributor(feet(), "squares", limits=True, weights=[1, 2, 3, 4], slack=np.eye(6))
    distributor.set_limits([100, 100, 100, 0])
    expected = distributor.solve([0, 0, -100, 0, 0, 0])
    assert not expected.forces[3].any()
    for other in (copy.copy(distributor), pickle.loads(pickle.dumps(distributor))):
        assert other.max_normal_force.tolist() == [100, 100, 100, 0]
        np.testing.assert_allclose(other.solve([0, 0, -100, 0, 0, 0]).forces, expected.forces, atol=1e-9)
    restored = pickle.loads(pickle.dumps(expected))
    assert restored.distance == expected.distance
    distributor.update(feet())
    assert distributor.max_normal_force.tolist() == [100] * 4
    assert distributor.to_dict()["weights"] == [1, 2, 3, 4]


def test_a_grasp_with_more_or_fewer_contacts_goes_on():
    distributor = gf.ForceDistributor(feet(), "squares")
    distributor.solve([0, 0, -100, 0, 0, 0])
    fewer = gf.Grasp(FEET[:3], [(0, 0, 1)] * 3, friction=0.6, edges=None)
    distributor.update(fewer)
    external = [0, 0, -100, -6.7, 10, 0]
    np.testing.assert_allclose(
        distributor.solve(external).forces,
        gf.ForceDistributor(fewer, "squares").solve(external).forces,
        atol=1e-8,
    )


def test_joint_torques_exert_the_forces():
    rng = np.random.default_rng(5)
    solution = gf.ForceDistributor(feet(torsion=0.02), "squares").solve([10, 0, -150, 0, 4, 1])
    jacobians = [rng.normal(size=(6, 7)) for _ in FEET]
    normals = solution.grasp.normals
    load = np.hstack([solution.world_forces, normals * solution.forces[:, 3:]])
    expected = sum(jacobian.T @ row for jacobian, row in zip(jacobians, load, strict=True))
    np.testing.assert_allclose(solution.joint_torques(jacobians), expected)
    coupling = rng.normal(size=(7, 2))
    np.testing.assert_allclose(solution.joint_torques(jacobians, coupling), coupling.T @ expected)
    pairs = zip(solution.grasp.frames, jacobians, strict=True)
    turned = [np.vstack([frame @ jacobian[:3], frame @ jacobian[3:]]) for frame, jacobian in pairs]
    np.testing.assert_allclose(solution.joint_torques(turned, frame="contact"), expected)
    with pytest.raises(gf.InvalidInputError, match=r"contact 0: shape \(3, 7\), but .* torsion of"):
        solution.joint_torques([j[:3] for j in jacobians])
    broken = jacobians[0].copy()
    broken[2, 3] = np.nan
    for bad, message in (
        (jacobians[:3], "3 matrices for 4 contacts"),
        ("text", "not a list"),
        ([jacobians[0], "text", *jacobians[2:]], "jacobians, contact 1"),
        ([*jacobians[:3], broken], r"contact 3, entry \(2, 3\): NaN is not finite"),
    ):
        with pytest.raises(gf.InvalidInputError, match=message):
            solution.joint_torques(bad)
    with pytest.raises(gf.InvalidInputError, match=r"coupling, entry \(0, 0\): inf is not finite"):
        solution.joint_torques(jacobians, np.full((7, 2), np.inf))


def test_rounding_of_torsion_needs_no_jacobian_of_six_rows():
    solution = gf.ForceDistributor(feet(torsion=0.02), "squares").solve([0, 0, -150, 3, 4, 0])
    solution.joint_torques([np.eye(3, 12, 3 * i) for i in range(4)])


def test_a_reference_that_changes_gives_the_forces_of_a_new_distributor():
    rng = np.random.default_rng(11)
    external = [0, 0, -150, 0, 4, 0]
    distributor = gf.ForceDistributor(feet(), "squares", limits=True)
    distributor.set_limits([100, 100, 100, 50])
    for _ in range(5):
        reference = rng.normal(size=(4, 3)) * 20
        distributor.set_reference(reference)
        anew = gf.ForceDistributor(feet(), "squares", limits=True, reference=reference)
        anew.set_limits([100, 100, 100, 50])
        expected = anew.solve(external).forces
        for one in (distributor, copy.copy(distributor), pickle.loads(pickle.dumps(distributor))):
            np.testing.assert_allclose(one.solve(external).forces, expected, atol=1e-7)
            assert one.reference.tolist() == reference.tolist()
    distributor.set_reference(None)
    assert distributor.reference is None
    with pytest.raises(gf.InvalidInputError, match="reference: only the objective"):
        gf.ForceDistributor(feet()).set_reference(reference)


def test_results_tell_the_objective_the_limits_and_what_is_left():
    soft = gf.ForceDistributor(feet(), "squares", limits=True, slack=10.0)
    found = soft.solve([0, 0, -500, 0, 0, 0])
    assert found.distance == pytest.approx(100)
    assert found.value == pytest.approx((found.forces**2).sum() / 2 + 10 * 100**2 / 2)
    assert "value=" in repr(found)
    assert "distance=100" in repr(found)
    soft.set_limits([100, 100, 100, 0])
    assert soft.solve([0, 0, -100, 0, 0, 0]).max_normal_force.tolist() == [100, 100, 100, 0]
    wrenches = [[0, 0, -100, 0, 0, 0], [0, 0, -500, 0, 0, 0]]
    batch = gf.ForceDistributor(feet()).solve_many(wrenches, infeasible="nearest")
    assert batch.balanced.tolist() == [True, False]
    np.testing.assert_allclose(batch.distance, [0, 100], atol=1e-5)
    assert repr(batch).endswith("2 solved, 1 not balanced)")
    assert pickle.loads(pickle.dumps(batch)).balanced.tolist() == [True, False]


def test_an_infeasible_wrench_names_contacts_that_are_off():
    distributor = gf.ForceDistributor(feet())
    distributor.set_limits([100, 100, 0, 0])
    for call in (distributor.solve, lambda w: distributor.solve_into(w, np.empty((4, 3)))):
        with pytest.raises(gf.InfeasibleWrenchError, match=r"set_limits switched off contacts 2, 3$"):
            call(np.array([0, 0, -100.0, 0, 0, 0]))
    with pytest.raises(gf.InvalidInputError, match=r"grasp: planar .wrenches of 3., the distributor's is"):
        distributor.update(gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"objective": "max", "reference": np.zeros((4, 3))},
            'reference: only the objective "squares" takes it',
        ),
        ({"objective": "sum", "limits": True}, 'limits: only the objective "squares" takes it'),
        ({"objective": "squares", "weight": 0.1}, 'weight: the objective "squares" does not take it'),
        (
            {"objective": "squares", "reference": np.zeros((3, 3))},
            r"reference: shape \(3, 3\), expected \(4, 3\)",
        ),
        ({"objective": "squares", "weights": [1, 2, 3, -4]}, "weights, contact 3: -4 must be positive"),
        ({"objective": "squares", "weights": 1e300}, "weights: 1e300 must be positive, within"),
        ({"objective": "squares", "weights": [1, 2, "a", 4]}, "weights, entry 2: 'a' is not a real"),
        (
            {"objective": "squares", "reference": [[0, 0, 0], [0, 0, np.nan]] + [[0, 0, 0]] * 2},
            "reference, contact 1: component t: NaN is not finite",
        ),
        ({"objective": "squares", "reference": np.full((4, 3), 1e200)}, "contact 0: component n: 1e200 must"),
        ({"objective": "squares", "slack": -1.0}, "slack: -1 must be positive"),
        ({"objective": "squares", "slack": [1, 1, 1, 1, 1, 0]}, "slack, component 5: 0 must be positive"),
        ({"objective": "squares", "slack": np.full((6, 6), np.nan)}, r"slack, entry \(0, 0\): NaN is not"),
        ({"objective": "squares", "slack": np.zeros(5)}, r"slack: shape \(5,\)"),
        ({"objective": "cubes"}, "objective: .cubes. is none of"),
    ],
)
def test_bad_options_are_named(arguments, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.ForceDistributor(feet(), **arguments)


def test_limits_are_checked():
    distributor = gf.ForceDistributor(feet())
    for bad, message in (
        ([1, 2, 3], r": shape \(3,\), expected \(4,\)"),
        ([1, 2, 3, -1], ", contact 3: -1 must"),
        ([1, np.nan, 3, 4], ", contact 1: NaN must"),
        ([1, 2, 1e300, 4], ", contact 2: 1e300 must"),
    ):
        with pytest.raises(gf.InvalidInputError, match="max_normal_force" + message):
            distributor.set_limits(bad)
    assert distributor.max_normal_force.tolist() == [100] * 4


@pytest.mark.parametrize("objective", ["max", "sum", "squares"])
def test_forces_within_torque_limits_need_torques_within_them(objective):
    rng = np.random.default_rng(8)
    options = {"limits": True} if objective == "squares" else {}
    at_limit = 0
    for _, hand in hands(10, 4):
        limits = rng.uniform(0.1, 0.5, 8)
        jacobians = [np.zeros((3, 8)) for _ in range(4)]
        for i, jacobian in enumerate(jacobians):
            jacobian[:, 2 * i : 2 * i + 2] = 0.3 * rng.normal(size=(3, 2))
        forces = [
            gf.torque_limited_forces(jacobian[:, 2 * i : 2 * i + 2], limits[2 * i : 2 * i + 2], 0.6, 3.0)
            for i, jacobian in enumerate(jacobians)
        ]
        grasp = gf.Grasp(
            hand.positions, hand.normals, friction=0.6, max_normal_force=3, extreme_forces=forces
        )
        distributor = gf.ForceDistributor(grasp, objective, **options)
        for size in (0.1, 1.0, 10.0):
            found = distributor.nearest(rng.normal(size=6) * size)
            torques = found.joint_torques(jacobians, frame="contact")
            assert (np.abs(torques) <= limits * (1 + 1e-8)).all()
            assert found.gap <= 1e-9
            normal, tangential = found.forces[:, 0], found.forces[:, 1:3]
            assert (np.linalg.norm(tangential, axis=1) <= 0.6 * normal + 1e-9).all()
            at_limit += int((np.abs(torques) > limits * (1 - 1e-6)).any())
    assert at_limit > 5


@pytest.mark.parametrize("length", [1.0, 1e-3])
def test_the_least_sum_within_limits_is_nearest_where_the_least_sum_alone_breaks_them(length):
    rng = np.random.default_rng(12)
    positions = length * np.array([(1, 0.5, 0), (1, -0.5, 0), (-1, 0.5, 0), (-1, -0.5, 0)])
    normals = [(-1, 0, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0)]
    for _ in range(20):
        limits = 10.0 ** rng.uniform(0, 1, 4)
        options = {"friction": 0.7, "max_normal_force": limits, "edges": 8, "length_scale": length}
        grasp = gf.Grasp(positions, normals, **options)
        forces = np.outer(limits * rng.choice([0.0, 0.5, 1.0], 4), [1, 0, 0])
        forces[:, 1] = 0.35 * forces[:, 0]
        external = -grasp.grasp_matrix @ forces.ravel()
        found = gf.ForceDistributor(grasp, "sum").nearest(external)
        assert found.within_limits
        assert found.distance <= 1e-8 * limits.max()
        assert found.gap <= 1e-9


def test_without_limits_nearest_forces_of_legs_balance_what_legs_can_balance():
    places = np.array([(x, y, 0) for x in (-0.1, 0.1) for y in (-0.1, 0.1)])
    wrench = np.array([0, 0, -1, 0.01, 0.02, 0])
    for noise in (0.0, 1e-12, 1e-10, 1.3e-9, 1e-8, 1e-7):
        for seed in range(5):
            rng = np.random.default_rng(seed)
            up = [(0, 0, 1)] + noise * rng.normal(size=(4, 3))
            legs = gf.Grasp(places + noise * rng.normal(size=(4, 3)), up, friction=0.0)
            for objective in ("max", "sum", "squares"):
                found = gf.ForceDistributor(legs, objective).nearest(wrench, limits=False)
                assert found.distance < 0.5, (noise, seed, objective)
