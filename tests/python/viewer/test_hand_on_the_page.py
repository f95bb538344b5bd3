"""The plan of a hand in the viewer: its poses, the forces of its fingers, and its file as an argument."""

import numpy as np
import pytest
from typer.testing import CliRunner

import graspforce as gf

pytest.importorskip("viser", reason="viser is not installed: pip install 'graspforce[viewer]'")
pytest.importorskip("mujoco", reason="mujoco is not installed: pip install 'graspforce[hands]'")
trimesh = pytest.importorskip("trimesh")

from graspforce.cli.app import app
from graspforce.viewer import scene, view

BOX = trimesh.creation.box((0.05, 0.05, 0.09))


@pytest.fixture(scope="module")
def plan():
    if not gf.hands.presets()["allegro-right"]:
        pytest.skip("the model of the Allegro hand is not installed: pip install --group simulators")
    return gf.plan_hand(gf.hands.preset("allegro-right"), BOX, starts=30, refine=False, best=1).best


@pytest.fixture(scope="module")
def shown(plan):
    viewer = view(plan, (BOX.vertices, BOX.faces), title="plan.json", port=0)
    yield viewer
    viewer.stop()


def test_the_slider_moves_the_hand_from_pregrasp_over_grasp_to_squeeze(plan, shown):
    between = (plan.pregrasp + plan.joints) / 2
    poses = ((0.0, plan.pregrasp), (1.0, plan.joints), (2.0, plan.squeeze()), (0.5, between))
    for stage, joints in poses:
        shown._controls.stage.value = stage
        shown.update()
        corners = []
        for link in shown._hand._links.values():
            w, x, y, z = link.wxyz
            turn = np.array([
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ])  # fmt: skip
            corners.append(link.vertices @ turn.T + link.position)
        np.testing.assert_allclose(np.vstack(corners), plan.hand.surface(plan.palm, joints)[0], atol=1e-6)


def test_contacts_show_what_the_torque_limits_allow_and_the_forces_at_rest(plan, shown):
    bound = 10 * plan.resting_forces[:, 0].max()
    assert shown.state.grasp == plan.torque_limited(bound)
    assert shown._controls.friction.disabled
    assert "torque limits" in shown._controls.friction.hint
    assert shown._handles == []
    for finger, normal in zip(plan.fingers, plan.resting_forces[:, 0], strict=True):
        name = plan.hand.fingertips[finger].name
        row = shown._controls.contacts.content.partition(name)[2].partition("</tr>")[0]
        assert f">{normal:.3g}<" in row


def test_wrenches_are_balanced_in_place_of_the_forces_at_rest(plan, shown):
    assert "at rest" in shown._controls.numbers.content
    viewer = view(plan, wrenches=[[0, 0, -0.5, 0, 0, 0]], port=0)
    try:
        assert "at rest" not in viewer._controls.numbers.content
        share = viewer.state.forces(0).sigma_max
        assert f"up to {100 * share:.3g} %" in viewer._controls.numbers.content
    finally:
        viewer.stop()


def test_the_command_shows_a_plan_file_with_its_object(plan, tmp_path, monkeypatch):
    BOX.export(tmp_path / "box.obj")
    plan.save(tmp_path / "plan.json", mesh=tmp_path / "box.obj")
    served = []
    monkeypatch.setattr(scene, "serve", lambda viewer, _: (served.append(viewer), viewer.stop()))
    result = CliRunner().invoke(app, ["view", str(tmp_path / "plan.json"), "--port", "0"])
    assert result.exit_code == 0, result.output
    (viewer,) = served
    assert viewer._title == "plan.json"
    np.testing.assert_allclose(np.ptp(viewer.state.mesh[0], axis=0), [0.05, 0.05, 0.09], atol=1e-6)
    assert viewer._hand.stages == ["pregrasp", "grasp", "squeeze"]
    refused = CliRunner().invoke(app, ["view", str(tmp_path / "plan.json"), "--friction", "0.3"])
    assert refused.exit_code == 2
