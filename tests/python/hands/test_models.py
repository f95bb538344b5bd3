"""Hands from files: what is read, and what is refused by name."""

import copy
import pickle
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from support.small_hand import PLACES, TIPS, mjcf

import graspforce as gf
from graspforce.hands import Hand, presets

URDF = """<robot name="pincher">
  <link name="palm"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><mesh filename="{mesh}"/></geometry></collision></link>
  {fingers}
</robot>"""
FINGER = """<link name="{n}"><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="{n}_tip"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
  <joint name="{n}_joint" type="revolute"><parent link="palm"/><child link="{n}"/><origin xyz="{x} 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="2" velocity="1"/></joint>
  <joint name="{n}_fixed" type="fixed"><parent link="{n}"/><child link="{n}_tip"/>
    <origin xyz="0 0 0.08"/></joint>"""


def spec(text=None):
    return mujoco.MjSpec.from_string(text or mjcf())


def urdf(folder, mesh):
    trimesh = pytest.importorskip("trimesh")
    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    trimesh.creation.box((0.1, 0.05, 0.02)).export(folder / "meshes" / "palm.stl")
    fingers = "".join(FINGER.format(n=n, x=x) for n, x in (("one", -0.04), ("two", 0.04)))
    (folder / "urdf").mkdir(exist_ok=True)
    path = folder / "urdf" / "hand.urdf"
    path.write_text(URDF.format(mesh=mesh, fingers=fingers))
    return path


def test_a_hand_has_the_joints_limits_and_tips_of_its_model(small_hand):
    assert small_hand.joints == tuple(f"{n}_{j}" for n in PLACES for j in ("base", "bend", "side"))
    np.testing.assert_array_equal(small_hand.joint_limits[:3], [(-1.2, 1.2), (-1.6, 1.6), (-0.6, 0.6)])
    np.testing.assert_array_equal(small_hand.torque_limits, np.full(9, 2.0))
    np.testing.assert_array_equal(small_hand.coupling, np.eye(9))
    assert [tip.radius for tip in small_hand.fingertips] == [0.01] * 3


@pytest.mark.parametrize("names", [TIPS, [f"{n}_end" for n in PLACES], [f"{n}_site" for n in PLACES]])
def test_tips_are_found_by_geom_body_and_site(names):
    tips = Hand(spec(), names).fingertips
    for tip in tips:
        np.testing.assert_allclose(tip.position, [0, 0, 0.045])
        assert tip.radius == 0.01


def test_a_tip_may_be_given_by_numbers():
    given = [
        {"name": f"{n}_end", "radius": 0.012, "position": (0, 0, 0.05), "pad": (1, 0, 0)} for n in PLACES
    ]
    tips = Hand(spec(), given).fingertips
    assert all(tip.radius == 0.012 and tip.position[2] == 0.05 and tip.pad[0] == 1 for tip in tips)


@pytest.mark.parametrize(
    ("tips", "message"),
    [
        (["thumb_tip", "left_top"], r"'left_top' is no body, geom or site of the model; there are left_tip"),
        (["thumb_tip", "thumb_tip"], "is the tip of entry 0 again"),
        (["thumb_tip"], "expected a list of two or more names"),
        ("thumb_tip", "expected a list of two or more names"),
        (["thumb_tip", "palm"], "has no sphere or capsule"),
        (["thumb_tip", {"name": "left_tip", "position": (0, 0, 0)}], "position without radius"),
        (["thumb_tip", {"radius": 0.01}], "has no field `name`"),
        (["thumb_tip", {"name": "left_tip", "colour": 1}], "colour: no such option"),
    ],
)
def test_wrong_tips_are_named_with_the_candidates(tips, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        Hand(spec(), tips)


def test_a_hand_without_limits_is_refused_by_joint():
    with pytest.raises(gf.InvalidInputError, match="joint_limits: the model has none for thumb_side"):
        Hand(spec(mjcf(**{' range="-0.6 0.6"': ""})), TIPS)
    with pytest.raises(gf.InvalidInputError, match="torque_limits: the model has none for thumb_base"):
        Hand(spec(mjcf(**{' actuatorfrcrange="-2 2"': ""})), TIPS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"torque_limits": 0.0}, "torque_limits: 0.0 must be positive"),
        ({"torque_limits": {"thumb_bend": 0.0}}, "torque_limits, thumb_bend: 0.0 must be positive"),
        (
            {"torque_limits": {"thumb_bent": 1.0}},
            "'thumb_bent' is no joint of the model; there are thumb_bend",
        ),
        ({"stiffness": -1}, "stiffness: -1.0 must be positive"),
        ({"joint_limits": {"thumb_bend": (1, 0)}}, "thumb_bend: lower 1.0 is not below upper 0.0"),
        ({"palm": "plam"}, "palm: 'plam' is no body of the model; there are palm"),
        ({"root": "thumb"}, "root: 'thumb' is not 'palm' or a body above it"),
        ({"pads": (0, 0, 0)}, "pads: .* has no direction"),
        ({"pads": {"thum_tip": (1, 0, 0)}}, "'thum_tip' is no fingertip"),
        ({"coupling": np.ones((2, 2))}, r"coupling: shape \(2, 2\)"),
        ({"coupling": {"thumb_bend": {"joint": "thumb_bend"}}}, "follows itself"),
        ({"posture": {"thumb_bend": np.nan}}, "posture, thumb_bend: nan"),
    ],
)
def test_wrong_options_are_named(options, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        Hand(spec(), TIPS, **options)


def test_torque_limits_of_zero_in_the_model_are_refused():
    text = mjcf(**{'<joint name="thumb_base"': '<joint name="thumb_base" damping="1"'})
    model = spec(text).compile()
    model.jnt_actfrcrange[0] = 0
    with pytest.raises(gf.InvalidInputError, match="torque_limits: 0 for thumb_base; they must be positive"):
        Hand(model, TIPS)


def test_joints_without_damping_get_some_unless_zero_is_given():
    np.testing.assert_allclose(Hand(spec(), TIPS).damping, 0.03 * Hand(spec(), TIPS).stiffness)
    assert not Hand(spec(), TIPS, damping=0.0).damping.any()
    damped = mjcf(**{'<joint name="thumb_base"': '<joint name="thumb_base" damping="0.7"'})
    assert Hand(spec(damped), TIPS).damping[0] == 0.7


def test_limits_of_actuators_count_with_their_gear():
    motor = '<actuator><motor joint="thumb_base" gear="3" forcerange="-0.5 0.5"/></actuator>'
    assert Hand(spec(mjcf(motor)), TIPS).torque_limits[0] == 1.5


@pytest.mark.parametrize("kind", ["tendon", "equality", "mapping", "matrix"])
def test_coupled_joints_follow_as_the_model_or_the_caller_says(kind):
    tendon = (
        '<tendon><fixed limited="true" range="-0.002 0.002"><joint joint="left_base" coef="-0.012"/>'
        '<joint joint="left_bend" coef="0.01"/></fixed></tendon>'
    )
    equality = '<equality><joint joint1="left_bend" joint2="left_base" polycoef="-0.2 1.2 0 0 0"/></equality>'
    options = {}
    if kind == "mapping":
        options["coupling"] = {"left_bend": {"joint": "left_base", "ratio": 1.2, "offset": -0.2}}
    if kind == "matrix":
        C = np.delete(np.eye(9), 4, axis=1)
        C[4, 3] = 1.2
        options["coupling"] = C, np.eye(9)[4] * -0.2
    hand = Hand(spec(mjcf({"tendon": tendon, "equality": equality}.get(kind, ""))), TIPS, **options)
    assert hand.coupling.shape == (9, 8)
    assert list(hand.driven) == [0, 1, 2, 3, 5, 6, 7, 8]
    q = hand.joint_positions(np.full(8, 0.5))
    # The tendon's dead band is at the end at which a finger that presses is.
    assert q[4] == pytest.approx(1.2 * 0.5 - 0.2)
    # Both joints are within their limits: (-1.6 + 0.2) / 1.2 is above -1.2.
    np.testing.assert_allclose(hand.driven_limits[3], [-1.4 / 1.2, 1.2])


def test_a_urdf_finds_its_meshes_by_package(tmp_path):
    path = urdf(tmp_path / "ws" / "pincher_description", "package://pincher_description/meshes/palm.stl")
    for folders in ((), [tmp_path / "ws"]):
        hand = Hand.load(path, ["one_tip", "two_tip"], package_dirs=folders)
        assert hand.joints == ("one_joint", "two_joint")
        np.testing.assert_array_equal(hand.torque_limits, [2, 2])
    lost = urdf(tmp_path / "other", "package://pincher_description/meshes/palm.stl")
    with pytest.raises(
        gf.InvalidFileError, match="no package 'pincher_description' holds it; pass package_dirs"
    ):
        Hand.load(lost, ["one_tip", "two_tip"])
    assert Hand.load(lost, ["one_tip", "two_tip"], package_dirs=[tmp_path / "ws"]).num_fingers == 2
    missing = urdf(tmp_path / "third", "../meshes/plam.stl")
    with pytest.raises(gf.InvalidFileError, match="no such file"):
        Hand.load(missing, ["one_tip", "two_tip"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<html></html>", "neither MJCF"),
        ("no XML", "not XML"),
        ("<mujoco><worldbody><body/></worldbody><nonsense/></mujoco>", "MuJoCo cannot read the model"),
        ('<!DOCTYPE x [<!ENTITY a "b">]><mujoco/>', "entities"),
    ],
)
def test_a_file_that_is_no_model_is_refused(tmp_path, text, message):
    path = tmp_path / "hand.xml"
    path.write_text(text)
    with pytest.raises(gf.InvalidFileError, match=message):
        Hand.load(path, ["a", "b"])
    with pytest.raises(gf.InvalidFileError, match="No such file"):
        Hand.load(tmp_path / "none.xml", ["a", "b"])


HAND_FILE = """
model: hand.xml
palm: palm
fingertips: [thumb_tip, {name: left_end, pad: [1, 0, 0.5]}, right_site]
torque_limits: 1.5
joint_limits: {thumb_base: [-1, 1]}
stiffness: {thumb_base: 4}
coupling: {left_bend: {joint: left_base, ratio: 1.2}}
posture: {thumb_base: -0.2}
"""


def test_a_hand_file_says_all_that_the_arguments_say(tmp_path):
    (tmp_path / "hand.xml").write_text(mjcf())
    path = tmp_path / "mine.yaml"
    path.write_text(HAND_FILE)
    hand = Hand.load(path)
    assert (hand.name, hand.source) == ("mine", {"file": str(path)})
    assert hand.coupling.shape == (9, 8)
    assert (hand.torque_limits[0], hand.stiffness[0], tuple(hand.joint_limits[0])) == (1.5, 4, (-1, 1))
    np.testing.assert_allclose(hand.fingertips[1].pad, np.array([1, 0, 0.5]) / np.sqrt(1.25))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("thumb_tip", "thum_tip", r":4: fingertips: .*'thum_tip' is no body"),
        (
            "torque_limits: 1.5",
            "torque_limits: 0",
            r":5: torque_limits: must be greater than 0, given 0$",
        ),
        (
            "torque_limits: 1.5",
            "torque_limits: {thumb_base: -1}",
            r":5: torque_limits.thumb_base: must be greater than 0, given -1$",
        ),
        (
            "{thumb_base: [-1, 1]}",
            "{thumb_base: [1, -1]}",
            r":6: joint_limits.thumb_base: lower 1.0 is not below upper -1.0",
        ),
        ("[1, 0, 0.5]}", "[0, 0, 0]}", r":4: fingertips: entry 1: pad: .* has no direction"),
        ("thumb_base: 4", "thumb: 4", r":7: stiffness: .*'thumb' is no joint"),
        ("palm: palm", "plam: palm", r":3: plam: unknown field"),
        ("hand.xml", "hand.urdf", r":2: model: .*No such file"),
    ],
)
def test_a_wrong_hand_file_names_line_and_field(tmp_path, old, new, message):
    (tmp_path / "hand.xml").write_text(mjcf())
    path = tmp_path / "mine.yaml"
    path.write_text(HAND_FILE.replace(old, new))
    with pytest.raises(gf.InvalidFileError, match=message):
        Hand.load(path)


def test_a_model_without_tips_and_a_hand_file_with_options_are_refused(tmp_path):
    (tmp_path / "hand.xml").write_text(mjcf())
    with pytest.raises(gf.InvalidInputError, match="fingertips: missing"):
        Hand.load(tmp_path / "hand.xml")
    with pytest.raises(gf.InvalidInputError, match="a hand file states them itself"):
        Hand.load(tmp_path / "mine.yaml", ["a", "b"])
    with pytest.raises(gf.InvalidInputError, match=r"spec: 3 is neither a mujoco\.MjSpec"):
        Hand(3, ["a", "b"])


def test_joints_between_root_and_palm_are_fixed(shadow):
    assert not [name for name in shadow.joints if "WRJ" in name]
    assert shadow.coupling.shape == (22, 18)


@pytest.mark.parametrize("name", ["allegro-right", "allegro-left", "shadow"])
def test_a_preset_is_ready_or_says_what_to_install(name, monkeypatch):
    if presets()[name]:
        hand = gf.hands.preset(name)
        assert hand.source == {"preset": name}
        assert (hand.joint_limits[:, 0] <= hand.posture).all()
        assert (hand.posture <= hand.joint_limits[:, 1]).all()
        again = pickle.loads(pickle.dumps(hand))
        assert again.to_dict() == hand.to_dict() == copy.deepcopy(hand).to_dict()
    monkeypatch.setattr("graspforce.hands.known_hands._model_file", lambda _: None)
    with pytest.raises(gf.GraspForceError, match=r"pip install (example-robot-data|gymnasium-robotics)"):
        gf.hands.preset(name)
    with pytest.raises(gf.InvalidInputError, match="'hook' is no preset; there are allegro-left"):
        gf.hands.preset("hook")


def test_importing_hands_needs_numpy_alone():
    code = (
        "import sys; import graspforce as gf; gf.plan_hand, gf.hands.shake; "
        "print([m for m in ('mujoco', 'mink', 'trimesh', 'scipy', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
