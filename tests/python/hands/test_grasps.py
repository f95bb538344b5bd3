"""Planned grasps: what they promise, checked by statics and in simulation."""

import contextlib
import copy
import json
import pickle
import time

import numpy as np
import pytest

import graspforce as gf
from graspforce.hands import HandPlan, largest_pushes, shake

trimesh = pytest.importorskip("trimesh")

from benches.holding.objects import numbers, random_mesh


def cylinder():
    return trimesh.creation.cylinder(0.028, 0.09, sections=24)


def lump(seed):
    """Return a hull of random points, about 8 cm long."""
    mesh = trimesh.convex.convex_hull(np.random.default_rng(seed).normal(size=(25, 3)))
    mesh.apply_translation(-mesh.center_mass)
    mesh.apply_scale(0.08 / mesh.extents.max())
    return mesh


@pytest.fixture(scope="module")
def found(allegro):
    return gf.plan_hand(allegro, cylinder(), best=3)


def test_contacts_lie_on_the_surface_with_its_normals(found):
    mesh = cylinder()
    assert found.best.onset == pytest.approx(found.best.slip_onset(gf.hands.grasp_problem.PUSHES).min())
    for plan in found:
        _, distance, face = trimesh.proximity.closest_point_naive(mesh, plan.grasp.positions)
        assert distance.max() < 1e-6
        assert (-(mesh.face_normals[face] * plan.grasp.normals).sum(axis=1) > np.cos(np.deg2rad(60))).all()
        assert plan.contact_error < 5e-4
        assert plan.penetration < 5e-4
        assert plan.pad_angle <= np.deg2rad(45.01)
        assert plan.quality.closure == "force"
        assert plan.quality.converged


def test_torques_are_those_of_forces_that_balance_the_load(found, allegro):
    plan = found.best
    for wrench in (None, [0, 0, -0.5, 0, 0, 0], [0.3, 0.1, 0, 0, 0.005, 0]):
        forces = plan.forces(wrench)
        left = plan.grasp.grasp_matrix @ forces.ravel() + (0 if wrench is None else np.array(wrench))
        np.testing.assert_allclose(left, 0, atol=1e-8)
        assert forces[:, 0].min() >= plan.preload * (1 - 1e-9)
        world = np.einsum("mij,mi->mj", plan.grasp.frames, forces[:, :3])
        expected = np.einsum("mij,mi->j", plan.jacobians, world)
        np.testing.assert_allclose(plan.torques(wrench), expected, atol=1e-9)
        sent = plan.joints + expected / allegro.stiffness
        np.testing.assert_allclose(plan.squeeze(wrench), sent, atol=1e-9)
    np.testing.assert_allclose(plan.squeeze(None, 6.0) - plan.joints, (plan.squeeze() - plan.joints) / 2)


def test_forces_beyond_the_joints_name_the_joint(found):
    with pytest.raises(
        gf.InfeasibleWrenchError, match=r"joint joint_\d+\.0 would need .* its limit of 0\.7 N m"
    ):
        found.best.torques([0, 0, -40, 0, 0, 0])


@pytest.mark.parametrize("seed", range(6))
def test_torques_answer_as_long_as_any_forces_fit_and_prove_where_none_does(found, allegro, seed):
    """The largest load along a random wrench by HiGHS, over forces of all contacts at once."""
    linprog = pytest.importorskip("scipy.optimize").linprog
    plan, rng = found[seed % len(found)], np.random.default_rng(seed)
    grasp, limits = plan.grasp, allegro.torque_limits
    contact = np.repeat(np.arange(grasp.num_contacts), grasp.num_edges)
    world = np.einsum("nji,nj->ni", grasp.frames[contact], grasp.extreme_forces[:, :3])
    torques = np.einsum("nij,ni->jn", plan.jacobians[contact], world)
    wrenches, bounds = grasp.primitive_wrenches.T, np.tile(limits, 2)
    wrench = rng.normal(size=6) * [1, 1, 1, 0.03, 0.03, 0.03]

    def most(cost, equal, sides):
        rows = np.hstack(
            [np.vstack([torques, -torques]), np.zeros((2 * len(limits), equal.shape[1] - len(contact)))]
        )
        end = linprog(-cost, rows, bounds, equal, sides)
        assert end.status == 0
        return -end.fun

    columns = np.append(np.zeros(len(contact)), 1.0)
    largest = most(columns, np.hstack([wrenches, wrench[:, None]]), np.zeros(6))
    for share in (0.5, 0.9, 0.999):
        load = share * largest * wrench
        forces = plan.forces(load)
        np.testing.assert_allclose(grasp.grasp_matrix @ forces.ravel(), -load, atol=1e-7)
        assert (np.abs(plan.torques(load)) <= limits * (1 + 1e-7)).all()
        mu, twist = grasp.friction[0], (forces[:, 3] / grasp.torsion) ** 2
        assert (forces[:, 0] + 1e-7 >= np.sqrt((forces[:, 1:3] ** 2).sum(axis=1) / mu**2 + twist)).all()
    load = 1.001 * largest * wrench
    with pytest.raises(gf.InfeasibleWrenchError, match=r"limits 1\.001 times as large would do") as caught:
        plan.torques(load)
    direction = caught.value.direction
    assert np.linalg.norm(direction) == pytest.approx(1)
    reach = most(direction @ wrenches, np.zeros((0, len(contact))), np.zeros(0))
    assert reach < -load @ direction


def test_a_torque_limited_grasp_resists_no_more_than_its_torques(found, allegro):
    plan = found.best
    limited = plan.torque_limited()
    assert limited.quality().closure == "force"
    direction = np.array([0, 0, 1.0, 0, 0, 0])
    size = limited.resistance(direction[None])[0]
    solution = gf.ForceDistributor(limited).solve(size * direction)
    assert solution.sigma_max == pytest.approx(1, abs=1e-6)
    world = np.einsum("mij,mi->mj", limited.frames, solution.forces[:, :3])
    for k in range(len(plan.fingers)):
        torques = np.abs(plan.jacobians[k].T @ world[k])
        assert (torques <= allegro.torque_limits * (1 + 1e-6)).all()


def test_the_pregrasp_is_clear_and_closes_on_the_grasp(found, allegro):
    for plan in found:
        assert 1e-3 < plan.pregrasp_clearance <= 0.01
        assert (plan.pregrasp >= allegro.joint_limits[:, 0] - 1e-9).all()
        assert (plan.pregrasp <= allegro.joint_limits[:, 1] + 1e-9).all()


def test_the_same_seed_gives_the_same_plans(found, allegro):
    again = gf.plan_hand(allegro, cylinder(), best=3)
    assert [p.to_dict() for p in again] == [p.to_dict() for p in found]


def test_plans_survive_files_pickles_and_copies(found, tmp_path):
    plan = found.best
    for again in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert again.to_dict() == found.to_dict()
        assert json.dumps(again.to_dict(), allow_nan=False)
        assert not again.best.palm.flags.writeable
    plan.save(tmp_path / "plan.json")
    loaded = HandPlan.load(tmp_path / "plan.json")
    assert loaded.to_dict() == plan.to_dict()
    text = (tmp_path / "plan.json").read_text()
    for old, new, message in (
        ('"preload": 2.0', '"preload": "2"', "preload: expected a number"),
        ('"criterion": "max"', '"criterion": "mean"', "criterion: must be"),
        ('"allegro-right"', '"allegro"', "hand.preset: .* no preset"),
        ('"joint_0.0",', "", "joint_names: not those of the hand"),
        ('"kind": "hand plan"', '"kind": "plan"', "kind: must be"),
    ):
        assert old in text
        (tmp_path / "bad.json").write_text(text.replace(old, new, 1))
        with pytest.raises(gf.InvalidFileError, match=message):
            HandPlan.load(tmp_path / "bad.json")


def test_a_hand_without_a_source_is_given_when_a_plan_is_loaded(found, small_hand, tmp_path):
    box = trimesh.creation.box((0.05, 0.05, 0.05))
    plan = gf.plan_hand(small_hand, box, starts=20, refine=False, simulate=False, best=1).best
    with pytest.raises(gf.InvalidInputError, match="neither a preset nor read from a hand file"):
        plan.save(tmp_path / "plan.json")
    found.best.save(tmp_path / "plan.json")
    with pytest.raises(gf.InvalidFileError, match="joint_names: not those of the hand 'small'"):
        HandPlan.load(tmp_path / "plan.json", small_hand)


def test_a_random_lump_is_held_by_five_fingers(shadow):
    mesh = lump(1)
    plan = gf.plan_hand(shadow, mesh, best=1).best
    trial = shake(plan, mesh)
    assert trial.success, trial
    assert trial.normal_error < 0.5 * plan.resting_forces[:, 0].max()


@pytest.mark.parametrize("number", numbers(5, seed=1))
def test_five_objects_of_the_benchmark_are_held(number, allegro):
    """Objects of ``benches/hands.py``: pushes along the six axes with ten times the weight."""
    pytest.importorskip("pybullet_data", reason="its meshes are missing: pip install --group objects")
    mesh = random_mesh(number, 0.08)
    plan = gf.plan_hand(allegro, mesh, best=1).best
    assert plan.pad_angle <= np.deg2rad(45.01)
    trial = shake(plan, mesh, seconds=0.5)
    assert trial.success, trial


def test_five_fingers_meet_on_a_small_plate_with_their_pads(shadow):
    """Fingers that nearly reached it tell the next round how to converge."""
    plan = gf.plan_hand(shadow, trimesh.creation.box((0.05, 0.04, 0.014)), simulate=False, best=1).best
    assert plan.pad_angle <= np.deg2rad(45.01)
    assert plan.contact_error < 5e-4


def test_plans_that_are_lost_in_simulation_come_last(small_hand, monkeypatch):
    box, tried = trimesh.creation.box((0.05, 0.05, 0.05)), []
    options = {"starts": 30, "refine": False, "best": 5, "target": 0.0}
    before = gf.plan_hand(small_hand, box, simulate=False, **options)

    def stub(plan, *_, **__):
        tried.append(plan.onset)
        return type("Result", (), {"success": len(tried) == 3})

    monkeypatch.setattr("graspforce.hands.finishing.shake", stub)
    found = gf.plan_hand(small_hand, box, **options)
    onsets = [plan.onset for plan in before]
    assert tried == onsets[:3]
    assert [plan.onset for plan in found][-2:] == onsets[:2]
    assert found.best.onset == onsets[2]
    assert (found.counts["held in simulation"], found.counts["lost in simulation"]) == (1, 2)


def test_a_simulation_that_diverges_loses_the_object_and_writes_no_file(found, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trial = shake(found.best, cylinder(), acceleration=1e14, seconds=0.1)
    assert not trial.held.any()
    assert np.isinf(trial.displacement).all()
    assert not list(tmp_path.iterdir())


def test_a_push_that_is_known_is_held_to_a_larger_size(found):
    pushes = np.array([[0, 0, 1.0, 0, 0, 0]])
    options = {"control": "servo", "pushes": pushes, "most": 16.0, "halvings": 4, "seconds": 0.3}
    known = largest_pushes(found.best, cylinder(), known_pushes=True, **options)
    assert known >= largest_pushes(found.best, cylinder(), **options)


@pytest.mark.parametrize("control", ["squeeze", "servo", "torque"])
def test_a_cylinder_is_held_by_every_control_and_from_the_pregrasp(found, control):
    closing = shake(found.best, cylinder(), control=control, closing=True, seconds=0.5)
    assert closing.success
    assert closing.settled_displacement < 5e-3
    again = shake(found.best, cylinder(), control=control, closing=True, seconds=0.5)
    assert again.to_dict() == closing.to_dict()


def test_a_push_that_is_too_large_is_not_held(found):
    plan = found.best
    assert not shake(plan, cylinder(), acceleration=400.0, seconds=0.5).held.any()
    pushes = np.array([[0, 0, 1.0, 0, 0, 0]])
    most = largest_pushes(plan, cylinder(), pushes=pushes, most=32.0, halvings=5, seconds=0.5)
    assert 1.0 <= most[0] < 31
    trial = shake(plan, cylinder(), mass=0.1, acceleration=10 * float(most[0]), pushes=pushes, seconds=0.5)
    assert trial.success


def test_three_fingers_may_be_chosen_and_contacts_may_come_first(allegro):
    found = gf.plan_hand(allegro, cylinder(), [0, 1, 2], "sum", seeds="contacts", starts=40, best=1)
    assert found.best.fingers == (0, 1, 2)
    assert found.best.quality.criterion == "sum"
    with pytest.raises(gf.InvalidInputError, match=r"fingers, entry 1: 7 must be at most 3"):
        gf.plan_hand(allegro, cylinder(), [0, 7])
    with pytest.raises(gf.InvalidInputError, match="expected two or more different fingertips"):
        gf.plan_hand(allegro, cylinder(), [0, 0])


def test_an_object_wider_than_the_hand_is_refused_with_both_sizes(allegro):
    with pytest.raises(gf.NoGraspError, match=r"the object is 400 mm wide .* open 2\d\d mm"):
        gf.plan_hand(allegro, trimesh.creation.box((0.4, 0.4, 0.4)))


def test_a_failure_counts_its_reasons(allegro):
    weak = gf.hands.preset("allegro-right", torque_limits=1e-3)
    with pytest.raises(gf.NoGraspError, match=r"of \d+ poses .* press less than a quarter .* torque limits"):
        gf.plan_hand(weak, cylinder(), starts=10, samples=200, refine=False)
    with pytest.raises(gf.NoGraspError, match="are not force closure"):
        gf.plan_hand(allegro, cylinder(), [0, 1], starts=10, samples=200, refine=False, torsion=0.0)


def test_time_is_kept_and_an_interrupt_keeps_what_was_found(allegro, monkeypatch):
    began = time.monotonic()
    with contextlib.suppress(gf.NoGraspError):
        assert gf.plan_hand(allegro, cylinder(), starts=1000, time_limit=0.3).stopped == "time"
    assert time.monotonic() - began < 10

    def stop(*_, **__):
        raise KeyboardInterrupt

    kept = gf.plan_hand(allegro, cylinder(), starts=30, progress=stop)
    assert kept.stopped == "interrupted"
    assert len(kept) >= 1
    # Also where the first refinement is interrupted, before there is a plan.
    monkeypatch.setattr("graspforce.hands.search.refined", stop)
    kept = gf.plan_hand(allegro, cylinder(), starts=30)
    assert kept.stopped == "interrupted"
    monkeypatch.setattr("graspforce.hands.search.snap", stop)
    with pytest.raises(KeyboardInterrupt):
        gf.plan_hand(allegro, cylinder(), starts=30)


def test_the_load_is_part_of_the_resting_forces_and_of_the_trial(allegro):
    weight = np.array([0, 0, -1.0, 0, 0, 0])
    plan = gf.plan_hand(allegro, cylinder(), external_wrench=weight, starts=30, best=1).best
    np.testing.assert_allclose(plan.grasp.grasp_matrix @ plan.resting_forces.ravel(), -weight, atol=1e-8)
    for control in ("squeeze", "servo"):
        trial = shake(plan, cylinder(), control=control, seconds=0.5)
        assert trial.success
        assert trial.settled_displacement < 1e-3


def test_a_hand_is_drawn(found):
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    from graspforce.plotting import draw_hand, hand_figure

    mesh = cylinder()
    axes = Figure().add_subplot(projection="3d")
    artists = draw_hand(axes, found.best, (mesh.vertices, mesh.faces), pose="pregrasp", labels=True)
    assert len(artists) == 1 + 2 * len(found.best.fingers)
    for side in ("xlim", "ylim", "zlim"):
        assert np.diff(getattr(axes, f"get_{side}")())[0] > 0.1
    assert len(hand_figure(found.best, (mesh.vertices, mesh.faces), title="cylinder").axes) == 3


def test_the_commands_plan_shake_and_say_what_is_wrong(tmp_path, capsys):
    pytest.importorskip("typer")
    if not gf.hands.presets()["allegro-right"]:
        pytest.skip("the model is not installed: pip install --group simulators")
    from graspforce.cli.app import run

    mesh = cylinder()
    mesh.apply_scale(1000)
    mesh.export(tmp_path / "can.stl")
    (tmp_path / "plans").mkdir()
    out = tmp_path / "plans" / "plan.json"
    given = [str(tmp_path / "can.stl"), "--unit", "mm", "--starts", "30", "--fingers", "0,1,3"]
    assert (
        run(["plan-hand", "allegro-right", *given, "--out", str(out), "--plot", str(tmp_path / "plan.png")])
        == 0
    )
    assert "can.stl: allegro-right" in capsys.readouterr().out
    assert (tmp_path / "plan.png").stat().st_size > 10_000
    assert run(["shake", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["held"] == [True] * 6
    for arguments, code, message in (
        (
            ["plan-hand", "allegro-up", *given],
            3,
            "no such hand file, and no preset; presets are allegro-left",
        ),
        (["plan-hand", "allegro-right", given[0]], 1, "give its unit by --unit"),
        (["plan-hand", "allegro-right", *given[:3], "--fingers", "a"], 1, "--fingers: 'a', expected numbers"),
        (["shake", str(tmp_path / "can.stl")], 3, "can.stl"),
    ):
        assert run(arguments) == code, arguments
        assert message in capsys.readouterr().err
