"""Kinematics, distances, reach and forces of hands beside independent answers."""

import mujoco
import numpy as np
import pytest
from support.small_hand import TIPS, mjcf

import graspforce as gf
from graspforce.hands.distances import Distances
from graspforce.hands.grasped_object import grasped_object
from graspforce.hands.hand import Hand
from graspforce.hands.kinematics import HandKinematics, Poses
from graspforce.hands.poses import quaternion_of, rotation_of, rotation_vectors, rotations
from graspforce.hands.preload import slip_onset
from graspforce.hands.snap import SnapOptions, snap
from graspforce.surfaces import MeshSurface

trimesh = pytest.importorskip("trimesh")


def box(*sides):
    return trimesh.creation.box(sides)


def random_poses(hand, rng, count, far):
    z = rng.uniform(*hand.driven_limits.T, size=(count, len(hand.driven)))
    q = rng.normal(size=(count, 4))
    return Poses(far * rng.normal(size=(count, 3)), q / np.linalg.norm(q, axis=1, keepdims=True), z)


def test_rotations_and_quaternions_agree():
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(200, 3))
    angles = rng.choice([0, 1e-9, 1e-3, 1.0, 3.14], size=(200, 1))
    vectors = axes / np.linalg.norm(axes, axis=1, keepdims=True) * angles
    for vector, R in zip(vectors, rotation_of(vectors), strict=True):
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(rotations(quaternion_of(R)), R, atol=1e-12)
        np.testing.assert_allclose(rotation_vectors(R), vector, atol=1e-9)
    half = np.diag([1.0, -1, -1])
    np.testing.assert_allclose(rotations(quaternion_of(half)), half, atol=1e-12)


@pytest.mark.parametrize("which", ["small", "allegro", "shadow"])
def test_tips_are_where_the_model_itself_has_them(which, small_hand, request):
    """The hand is taken apart and put together again: MuJoCo moves the original model as an oracle."""
    if which == "small":
        hand, model = small_hand, mujoco.MjSpec.from_string(mjcf()).compile()
    else:
        hand = request.getfixturevalue(which)
        path = gf.hands.known_hands._model_file(hand.source["preset"])
        model = gf.hands.model_file.spec_from_file(path).compile()
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    kinematics = HandKinematics(hand, None, range(hand.num_fingers))
    for row in range(5):
        poses = random_poses(hand, rng, 1, 0.1)
        q = hand.joint_positions(poses.driven[0])
        for name, angle in zip(hand.joints, q, strict=True):
            data.qpos[model.jnt_qposadr[model.joint(name).id]] = angle
        mujoco.mj_kinematics(model, data)
        palm = model.body({"small": "palm", "allegro": "palm_link", "shadow": "robot0:palm"}[which]).id
        R, p = data.xmat[palm].reshape(3, 3), data.xpos[palm]
        tips = kinematics.shapes(poses.driven)[0]
        for k, tip in enumerate(hand.fingertips):
            body = model.body(hand._model.bodies[tip.body].name).id
            there = data.xpos[body] + data.xmat[body].reshape(3, 3) @ tip.position
            np.testing.assert_allclose(tips[k], R.T @ (there - p), atol=1e-9, err_msg=f"{row} {tip.name}")


@pytest.mark.parametrize("which", ["small_hand", "shadow"])
def test_velocities_of_tips_are_derivatives_of_their_places(which, request):
    hand = request.getfixturevalue(which)
    kinematics = HandKinematics(hand, None, range(hand.num_fingers))
    rng = np.random.default_rng(2)
    poses = random_poses(hand, rng, 20, 0.1)
    poses = Poses(
        poses.positions, poses.quaternions, 0.9 * poses.driven + 0.05 * hand.driven_limits.sum(axis=1)
    )
    cores = [kinematics.model.geom(f"core {k}").id for k in range(hand.num_fingers)]
    places = kinematics.places(poses)
    rows = np.arange(20)
    for k, core in enumerate(cores):
        directions = rng.normal(size=(20, 3))
        J = kinematics.along(
            places, rows, np.full(20, kinematics.tip_bodies[k]), places.geoms[:, core], directions
        )
        step = 1e-6 * rng.normal(size=(20, kinematics.size))
        ahead = kinematics.places(poses.moved(step, hand.driven_limits)).geoms[:, core]
        behind = kinematics.places(poses.moved(-step, hand.driven_limits)).geoms[:, core]
        found = ((ahead - behind) / 2 * directions).sum(axis=1)
        np.testing.assert_allclose(found, (J * step).sum(axis=1), atol=1e-11)


def test_gaps_of_tips_are_distances_from_the_mesh(small_hand):
    """Distances of MuJoCo beside those of the triangle tree, outside of an object of several parts."""
    dumbbell = trimesh.boolean.union([box(0.08, 0.02, 0.02), box(0.02, 0.06, 0.03)], engine="manifold")
    grasped = grasped_object(dumbbell)
    distances = Distances(HandKinematics(small_hand, grasped, range(3)))
    poses = random_poses(small_hand, np.random.default_rng(3), 60, 0.06)
    _, touches, _ = distances.measure(poses, 1e-3)
    signed, near, outward = grasped.distance(touches.centers.reshape(-1, 3))
    clear = signed > 1e-3
    assert clear.sum() > 120
    np.testing.assert_allclose(touches.gaps.ravel()[clear], signed[clear] - 0.01, atol=2e-6)
    np.testing.assert_allclose(touches.outward.reshape(-1, 3)[clear], outward[clear], atol=2e-3)
    np.testing.assert_allclose(touches.points.reshape(-1, 3)[clear], near[clear], atol=2e-5)


def test_convex_parts_cover_the_object_and_little_more():
    ring = trimesh.creation.torus(0.04, 0.01)
    mug = trimesh.boolean.difference([
        trimesh.creation.cylinder(0.04, 0.1),
        trimesh.creation.cylinder(0.034, 0.1).apply_translation([0, 0, 0.006]),
    ], engine="manifold")  # fmt: skip
    for mesh, most in ((ring, 0.035), (mug, 0.25)):
        grasped = grasped_object(mesh)
        assert len(grasped.parts) <= 32
        assert -0.01 < grasped.excess < most
        inside, _ = trimesh.sample.sample_surface(mesh, 300, seed=0)[:2]
        assert (grasped.distance(np.asarray(inside))[0] < 1e-6).all()
    fine = grasped_object(trimesh.creation.torus(0.04, 0.01, major_sections=128, minor_sections=64))
    assert -0.01 < fine.excess < 0.035
    assert max(len(faces) for _, faces in fine.parts) < 1500
    assert len(grasped_object(box(0.03, 0.04, 0.05)).parts) == 1
    assert grasped_object(box(0.03, 0.04, 0.05)).width == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (trimesh.Trimesh(box(1, 1, 1).vertices, box(1, 1, 1).faces[1:]), "mesh: not watertight: 3 of"),
        (box(60, 60, 60), "mesh: the mesh would be 60 m long, .*; scale it to m"),
        ("mug.obj", "mug.obj: No such file"),
        (None, "mesh: None has no triangles; give a trimesh.Trimesh"),
        (trimesh.Scene(box(1, 1, 1)), r"has no triangles; give scene.to_mesh\(\)"),
        (trimesh.Trimesh(), "mesh: a Trimesh with 0 vertices and 0 faces has no triangles"),
    ],
)
def test_an_unsound_mesh_is_refused_by_name(small_hand, mesh, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan_hand(small_hand, mesh)


def test_a_path_is_the_mesh_of_the_file(tmp_path):
    box(0.03, 0.04, 0.05).export(tmp_path / "box.stl")
    assert grasped_object(tmp_path / "box.stl").width == pytest.approx(0.03)
    box(30, 40, 50).export(tmp_path / "mm.stl")
    assert grasped_object(MeshSurface(tmp_path / "mm.stl", unit="mm")).width == pytest.approx(0.03)
    with pytest.raises(gf.InvalidInputError, match=r"50 m long, .*; scale it to m, in .*mm\.stl"):
        grasped_object(tmp_path / "mm.stl")


@pytest.mark.parametrize(
    ("options", "message"),
    [({"fingers": 0}, "fingers: 0, expected numbers"), ({"target": -1}, "target: -1.0 must be at least 0")],
)
def test_wrong_options_of_a_plan_are_named(small_hand, options, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.plan_hand(small_hand, box(0.03, 0.04, 0.05), **options)


def test_the_name_of_a_hand_is_no_hand():
    with pytest.raises(gf.InvalidInputError, match=r"hand: 'allegro-right' is a name; give hands.preset"):
        gf.plan_hand("allegro-right", box(0.03, 0.04, 0.05))


def test_a_snapped_pose_touches_with_all_tips_and_overlaps_nothing(small_hand):
    grasped = grasped_object(box(0.05, 0.05, 0.05))
    distances = Distances(HandKinematics(small_hand, grasped, range(3)))
    rng = np.random.default_rng(4)
    z = np.tile(small_hand.posture, (40, 1)) + 0.1 * rng.normal(size=(40, 9))
    q = rng.normal(size=(40, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    palm = np.einsum("bij,j->bi", rotations(q), [0, 0, -0.09])
    found = snap(distances, Poses(palm, q, z), SnapOptions(pad=0.7))
    assert (found.driven >= small_hand.driven_limits[:, 0]).all()
    assert (found.driven <= small_hand.driven_limits[:, 1]).all()
    _, touches, near = distances.measure(found, 1e-3)
    reached = np.abs(touches.gaps).max(axis=1) < 1e-4
    assert reached.mean() > 0.4
    free = (near.deepest(40, own=False) < 1e-4) & (near.deepest(40, own=True) < 1e-4)
    assert free[reached].mean() > 0.9


def contacts_of(hand, rng):
    """Contacts that a random posture of the hand touches, and the pose."""
    kinematics = HandKinematics(hand, None, range(hand.num_fingers))
    z = np.clip(hand.posture[hand.driven] + 0.2 * rng.normal(size=len(hand.driven)), *hand.driven_limits.T)
    R, t = rotation_of(rng.normal(size=3)), rng.normal(size=3)
    tips = kinematics.shapes(z[None])[0]
    inward = tips.mean(axis=0) - tips
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return (tips + inward * kinematics.radii[:, None]) @ R.T + t, inward @ R.T


@pytest.mark.parametrize("seed", range(4))
def test_contacts_that_a_hand_touches_are_reached_again(small_hand, seed):
    positions, normals = contacts_of(small_hand, np.random.default_rng(seed))
    order = np.random.default_rng(seed).permutation(3)
    pose = small_hand.reach(positions[order], normals[order])
    assert pose.position_error < 1e-4
    assert pose.normal_error < 0.01
    assert sorted(pose.fingers) == [0, 1, 2]
    # The original model has the tips there, too.
    model = mujoco.MjSpec.from_string(mjcf()).compile()
    data = mujoco.MjData(model)
    data.qpos[:] = pose.joints
    mujoco.mj_kinematics(model, data)
    back = pose.palm @ np.append(data.geom_xpos - data.body("palm").xpos, np.ones((model.ngeom, 1)), axis=1).T
    for contact, finger in enumerate(pose.fingers):
        center = back[:3, model.geom(TIPS[finger]).id]
        gap = np.linalg.norm(positions[order][contact] - center) - 0.01
        assert abs(gap) == pytest.approx(pose.position_error, abs=pose.position_error + 1e-7)


def test_contacts_out_of_reach_raise_with_the_nearest_pose(small_hand):
    with pytest.raises(gf.NoGraspError, match=r"the nearest misses by \d+ mm") as caught:
        small_hand.reach([(0.3, 0, 0), (-0.3, 0, 0)], [(-1, 0, 0), (1, 0, 0)])
    nearest = caught.value.nearest
    assert nearest.position_error > 0.1
    with pytest.raises(gf.InvalidInputError, match="4 contacts, and the hand has 3 fingertips"):
        small_hand.reach(np.eye(4)[:, :3], np.eye(4)[:, :3])
    with pytest.raises(gf.InvalidInputError, match="normals, contact 1: it has no direction"):
        small_hand.reach(np.eye(2, 3), [(1, 0, 0), (0, 0, 0)])
    with pytest.raises(gf.InvalidInputError, match=r"fingers: \[0, 0\], expected 2 different"):
        small_hand.reach(np.eye(2, 3), np.eye(2, 3), fingers=[0, 0])


def test_a_pose_keeps_clear_of_the_object(small_hand):
    """Contacts on opposite sides of a plate: the palm must not be inside it."""
    plate = box(0.04, 0.3, 0.04)
    positions, normals = [(0.02, 0, 0), (-0.02, 0, 0)], [(-1, 0, 0), (1, 0, 0)]
    pose = small_hand.reach(positions, normals, plate)
    assert pose.clearance > -5e-4
    assert pose.position_error < 1e-3


def within(forces, twist):
    """Whether forces (m, 3) are in cones of friction 0.6, beside torsion of the square `twist`."""
    return (forces[:, 0] >= np.sqrt((forces[:, 1:] ** 2).sum(axis=1) / 0.36 + twist)).all()


@pytest.mark.parametrize("torsion", [None, 0.02])
def test_slip_onset_is_where_a_cone_is_left(torsion):
    """The closed form beside bisection on the sum of springs, for random grasps."""
    rng = np.random.default_rng(5)
    checked = 0
    for _ in range(30):
        m = int(rng.integers(3, 6))
        p = rng.normal(size=(m, 3))
        p *= 0.04 / np.linalg.norm(p, axis=1, keepdims=True)
        grasp = gf.Grasp(p, -p, 0.6, torsion=torsion, origin=0.01 * rng.normal(size=3), length_scale=0.04)
        forces = np.zeros((m, grasp.force_dim))
        forces[:, 0] = rng.uniform(1, 3, size=m)
        forces[:, 1:3] = rng.uniform(-0.3, 0.3, size=(m, 2))
        if torsion:
            forces[:, 3] = rng.uniform(-0.005, 0.005, size=m)
        A = rng.normal(size=(m, 3, 3))
        K = A @ np.swapaxes(A, 1, 2) * 100
        wrenches = rng.normal(size=(5, 6)) * [1, 1, 1, 0.03, 0.03, 0.03]
        onset = slip_onset(grasp, forces, K, wrenches)
        G = grasp.grasp_matrix.reshape(6, m, -1)[:, :, :3]
        G = np.einsum("imj,mjk->mik", G, grasp.frames)
        x = np.linalg.solve(sum(g @ k @ g.T for g, k in zip(G, K, strict=True)), wrenches.T)
        for w in range(5):
            df = np.array([-f @ (k @ g.T @ x[:, w]) for f, k, g in zip(grasp.frames, K, G, strict=True)])
            np.testing.assert_allclose(
                sum(g @ f.T @ d for g, f, d in zip(G, grasp.frames, df, strict=True)), -wrenches[w], atol=1e-9
            )

            twist = (forces[:, 3] / torsion) ** 2 if torsion else 0
            if onset[w] > 1e5:
                assert within(forces[:, :3] + 1e4 * df, twist)
                continue
            assert within(forces[:, :3] + onset[w] * (1 - 1e-7) * df, twist)
            assert not within(forces[:, :3] + onset[w] * (1 + 1e-7) * df, twist)
            checked += 1
    assert checked > 100


def test_a_hand_survives_what_mujoco_specs_do_afterwards():
    spec = mujoco.MjSpec.from_string(mjcf())
    hand = Hand(spec, TIPS)
    spec.delete(spec.body("thumb"))
    assert hand.num_fingers == 3


@pytest.mark.parametrize("root", [None, "arm"])
def test_references_joint_positions_and_arms_above_the_palm_are_taken_over(root):
    """Joints with a reference and off their body's origin, on a palm below joints that become fixed."""
    off = {
        'name="left_bend"': 'name="left_bend" ref="0.3"',
        'name="thumb_base"': 'name="thumb_base" pos=".01 0 .02"',
    }
    arm = '<body name="arm" pos=".1 0 .2" euler=".3 0 0"><joint name="elbow" axis="1 0 0" ref=".4"/>'
    arm += (
        '<geom size=".02"/><body name="palm" euler="0 .5 0"><joint name="slide" type="slide" axis="0 1 0"/>'
    )
    text = mjcf(
        **off, **{'<body name="palm" pos="0 0 1">': arm, "</body></worldbody>": "</body></body></worldbody>"}
    )
    model = mujoco.MjSpec.from_string(text).compile()
    data = mujoco.MjData(model)
    hand = Hand(model, TIPS, palm="palm", root=root)
    assert len(hand.joints) == 9
    kinematics = HandKinematics(hand, None, range(3))
    rng = np.random.default_rng(6)
    for _ in range(5):
        z = rng.uniform(*hand.driven_limits.T)
        for name, angle in zip(hand.joints, z, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = angle
        mujoco.mj_kinematics(model, data)
        R, p = data.body("palm").xmat.reshape(3, 3), data.body("palm").xpos
        there = np.array([R.T @ (data.geom(tip).xpos - p) for tip in TIPS])
        np.testing.assert_allclose(kinematics.shapes(z[None])[0], there, atol=1e-12)
    if root is not None:
        kinematics.set(kinematics.qpos(Poses(np.zeros((1, 3)), np.eye(4)[:1], z[None]))[0])
        arm_there = R.T @ (data.body("arm").xpos - p)
        np.testing.assert_allclose(kinematics.data.body("body 0").xpos, arm_there, atol=1e-12)
