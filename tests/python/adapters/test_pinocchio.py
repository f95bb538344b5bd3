"""Hands from Pinocchio: the Allegro hand of example-robot-data, limited by its joint torques."""

from pathlib import Path

import numpy as np
import pytest

import graspforce as gf

pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed: pip install --group simulators")

TORQUE = 0.7


@pytest.fixture(scope="module")
def hand():
    # The wheel brings no module, only files beside Pinocchio's own.
    shared = [parent / "share" / "example-robot-data" for parent in Path(pin.__file__).parents]
    folder = next((path for path in shared if path.is_dir()), None)
    if folder is None:
        pytest.skip("example-robot-data is not installed: pip install --group simulators")
    (urdf,) = folder.rglob("allegro_right_hand.urdf")
    model = pin.buildModelFromUrdf(str(urdf))
    model.effortLimit[:] = TORQUE
    return model, tip_frames(model)


def tip_frames(model):
    names = [frame.name for frame in model.frames if "tip" in frame.name and "joint" not in frame.name]
    assert len(names) == 4
    return names


def closed(model):
    middle = (model.lowerPositionLimit + model.upperPositionLimit) / 2
    return 0.5 * (middle + model.upperPositionLimit)


def normals_to_centre(model, q, frames):
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    tips = np.array([data.oMf[model.getFrameId(name)].translation for name in frames])
    return tips.mean(axis=0) - tips


def joint_torques(model, q, frames, world_forces):
    """Torque of every joint under each finger's force, by Pinocchio's own Jacobians."""
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    pairs = zip(frames, world_forces, strict=True)
    return np.array(
        [pin.getFrameJacobian(model, data, model.getFrameId(n), world)[:3].T @ f for n, f in pairs]
    )


@pytest.fixture(scope="module")
def grasp(hand):
    model, frames = hand
    q = closed(model)
    return gf.from_pinocchio(model, q, frames, normals_to_centre(model, q, frames), friction=0.8)


def test_extreme_forces_bring_some_joint_to_its_limit_and_none_past_it(hand, grasp):
    model, frames = hand
    fans = np.split(grasp.extreme_forces, np.cumsum(grasp.num_edges)[:-1])
    for i, (fan, axes) in enumerate(zip(fans, grasp.frames, strict=True)):
        for force in fan[np.abs(fan).max(axis=1) > 1e-9]:
            world = np.zeros((4, 3))
            world[i] = force @ axes
            torques = np.abs(joint_torques(model, closed(model), frames, world))
            assert torques.max() == pytest.approx(TORQUE, rel=1e-6)


def test_forces_stay_within_friction_cones(grasp):
    forces = grasp.extreme_forces
    assert (np.linalg.norm(forces[:, 1:], axis=1) <= 0.8 * forces[:, 0] + 1e-9).all()


def test_twice_the_torque_is_twice_the_quality(hand, grasp):
    model, frames = hand
    q = closed(model)
    strong = pin.Model(model)
    strong.effortLimit[:] = 2 * TORQUE
    normals = normals_to_centre(model, q, frames)
    again = gf.from_pinocchio(strong, q, frames, normals, friction=0.8)
    assert grasp.is_force_closure
    assert again.quality("max").epsilon == pytest.approx(2 * grasp.quality("max").epsilon, rel=1e-6)


def test_distributed_forces_keep_torques_below_their_share(hand, grasp):
    model, frames = hand
    solution = gf.ForceDistributor(grasp).solve([0, 0, -1, 0, 0, 0])
    torques = np.abs(joint_torques(model, closed(model), frames, solution.world_forces))
    assert torques.max() <= solution.sigma_max * TORQUE * (1 + 1e-6)


def test_mistakes_are_named(hand):
    model, frames = hand
    q = closed(model)
    normals = normals_to_centre(model, q, frames)
    weak = pin.Model(model)
    weak.effortLimit[:] = 0
    cases = [
        ((model, q[:3], frames, normals), {}, "configuration"),
        ((model, q, ("thumb",), normals[:1]), {}, "thumb"),
        ((model, q, frames, normals), {"friction": 0.0}, "friction"),
        ((weak, q, frames, normals), {}, "effort limits"),
    ]
    for arguments, options, message in cases:
        with pytest.raises(gf.InvalidInputError, match=message):
            gf.from_pinocchio(*arguments, **options)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"max_normal_force": [5.0]}, r"max_normal_force: \[5.0\] is not a real number"),
        ({"max_normal_force": np.nan}, "max_normal_force: nan"),
        ({"configuration": np.full(16, np.nan)}, "configuration, entry 0: nan"),
    ],
)
def test_numbers_that_are_none_are_refused(hand, change, message):
    model, frames = hand
    q = closed(model)
    given = {"configuration": q, "frames": frames, "normals": normals_to_centre(model, q, frames)}
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.from_pinocchio(model, **{**given, **change})


def test_effort_limits_that_are_no_numbers_are_refused(hand):
    model, frames = hand
    q, lame = closed(model), model.copy()
    lame.effortLimit[3] = np.nan
    with pytest.raises(gf.InvalidInputError, match="effortLimit, entry 3: nan"):
        gf.from_pinocchio(lame, q, frames, normals_to_centre(model, q, frames))
