"""Grasps from MuJoCo: the Shadow hand of gymnasium-robotics on its block, egg and pen."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import graspforce as gf

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install --group simulators")

GRAVITY = 9.81
OBJECTS = ("block", "egg", "pen")


def shadow_hand(name):
    """Return the hand's model; gymnasium-robotics is a folder of models here, and is not imported."""
    package = importlib.util.find_spec("gymnasium_robotics")
    if package is None:
        pytest.skip("gymnasium-robotics is not installed: pip install --group simulators")
    assets = Path(package.submodule_search_locations[0]) / "envs" / "assets" / "hand"
    return mujoco.MjModel.from_xml_path(str(assets / f"manipulate_{name}.xml"))


def close_hand(model, steps=600):
    """Close all fingers; yield the state after every fiftieth step."""
    data = mujoco.MjData(model)
    low, high = model.actuator_ctrlrange.T
    for step in range(1, steps + 1):
        data.ctrl[:] = low + (high - low) * min(1.0, step / 500)
        data.ctrl[:2] = 0
        mujoco.mj_step(model, data)
        if step % 50 == 0:
            # A step leaves contacts of before its move; read and balance those of one moment.
            mujoco.mj_forward(model, data)
            yield data


def readings(name, **options):
    model = shadow_hand(name)
    for data in close_hand(model):
        try:
            yield model, data, gf.from_mujoco(model, data, "object", **options)
        except gf.InvalidInputError:
            assert not any(model.body("object").id in model.geom_bodyid[c.geom] for c in data.contact)


@pytest.mark.parametrize("name", OBJECTS)
def test_the_reading_exerts_the_wrench_that_mujoco_computes(name):
    seen = 0
    for model, data, reading in readings(name):
        body = model.body("object").id
        jacobian = np.zeros((6, model.nv))
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
        dofs = slice(model.body_dofadr[body], model.body_dofadr[body] + 6)
        # Of all constraints only contacts act on a free body, through its six degrees of freedom.
        expected = data.qfrc_constraint[dofs]
        np.testing.assert_allclose(jacobian[:, dofs].T @ -reading.external_wrench, expected, atol=1e-8)
        seen += 1
    assert seen >= 5


@pytest.mark.parametrize("name", OBJECTS)
def test_minimax_forces_are_never_larger_than_the_simulators(name):
    for model, _, reading in readings(name):
        assert model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
        if reading.sigma_max == 0:
            continue
        solution = gf.ForceDistributor(reading.grasp).solve(reading.external_wrench)
        assert solution.sigma_max <= reading.sigma_max * (1 + 1e-6)
        exerted = reading.grasp.grasp_matrix @ solution.forces.ravel()
        scale = np.abs(reading.forces).max()
        np.testing.assert_allclose(exerted, -reading.external_wrench, atol=1e-7 * scale)


@pytest.mark.parametrize("name", OBJECTS)
def test_our_forces_hold_a_free_body_in_mujoco(name):
    held = 0
    for model, data, reading in readings(name, max_normal_force=20.0, length_scale=0.05):
        grasp = reading.grasp
        weight = model.body("object").mass[0] * GRAVITY
        push = np.array([0.3, -0.2, 0.1, 0.002, 0.001, -0.001]) * weight
        try:
            external = push + np.array([0, 0, -weight, 0, 0, 0])
            solution = gf.ForceDistributor(grasp).solve(external)
        except gf.InfeasibleWrenchError:
            continue
        acceleration = free_body_acceleration(model, data, grasp, solution.forces, push)
        assert np.abs(acceleration[:3]).max() < 1e-6 * GRAVITY
        assert np.abs(acceleration[3:]).max() * 0.025 < 1e-6 * GRAVITY
        held += 1
    assert held >= 1


def free_body_acceleration(model, data, grasp, forces, push):
    """Acceleration of the object at rest under gravity, `push` and contact forces, MuJoCo's contacts off."""
    still = mujoco.MjData(model)
    still.qpos[:] = data.qpos
    flags, damping = model.opt.disableflags, model.dof_damping.copy()
    body = model.body("object").id
    try:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        mujoco.mj_forward(model, still)
        for position, frame, force in zip(grasp.positions, grasp.frames, forces, strict=True):
            torque = force[3] * frame[0] if len(force) == 4 else np.zeros(3)
            mujoco.mj_applyFT(model, still, force[:3] @ frame, torque, position, body, still.qfrc_applied)
        mujoco.mj_applyFT(model, still, push[:3], push[3:], grasp.origin, body, still.qfrc_applied)
        mujoco.mj_forward(model, still)
    finally:
        model.opt.disableflags, model.dof_damping[:] = flags, damping
    start = model.body_dofadr[body]
    return still.qacc[start : start + 6]


PAIR = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" friction="0.7 0.01 0.001" condim="{floor}"/>
    <body name="box" pos="0 0 0.049"><freejoint/>
      <geom type="box" size="0.05 0.05 0.05" friction="0.5 0.02 0.001" condim="{box}" mass="1"/>
      <body name="lid" pos="0 0 0.06"><geom type="box" size="0.02 0.02 0.01" mass="0.1"/></body>
    </body>
  </worldbody>
</mujoco>
"""


def box_on_floor(floor, box):
    model = mujoco.MjModel.from_xml_string(PAIR.format(floor=floor, box=box))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize(("condim", "force_dim", "friction"), [(1, 3, 0.0), (3, 3, 0.7), (4, 4, 0.7)])
def test_contact_dimensions_become_friction(condim, force_dim, friction):
    reading = gf.from_mujoco(*box_on_floor(condim, 1), "box")
    assert reading.grasp.force_dim == force_dim
    np.testing.assert_allclose(reading.grasp.friction, friction)
    # MuJoCo takes the larger of the two geoms' coefficients.
    torsion = reading.grasp.to_dict()["torsion"]
    np.testing.assert_allclose(torsion, 0.02 if condim == 4 else 0.0)


def test_normals_point_into_whichever_body_is_asked_for():
    model, data = box_on_floor(3, 3)
    box, floor = gf.from_mujoco(model, data, "box"), gf.from_mujoco(model, data, 0, origin=[0, 0, 0])
    np.testing.assert_allclose(box.grasp.normals, [[0, 0, 1]] * 4, atol=1e-12)
    np.testing.assert_allclose(floor.grasp.normals, [[0, 0, -1]] * 4, atol=1e-12)
    exerted = [(r.forces[:, :, None] * r.grasp.frames).sum(axis=(0, 1)) for r in (box, floor)]
    np.testing.assert_allclose(exerted[0], -exerted[1], atol=1e-9)


def test_welded_bodies_are_one():
    model, data = box_on_floor(3, 3)
    assert gf.from_mujoco(model, data, "lid").contacts == gf.from_mujoco(model, data, "box").contacts


def test_a_body_that_nothing_touches_or_that_is_not_there_is_named():
    model, data = box_on_floor(3, 3)
    data.qpos[2] = 1
    mujoco.mj_forward(model, data)
    with pytest.raises(gf.NoContactError, match="nothing touches 'box'"):
        gf.from_mujoco(model, data, "box")
    with pytest.raises(gf.InvalidInputError, match="sphere"):
        gf.from_mujoco(model, data, "sphere")
    with pytest.raises(gf.InvalidInputError, match="body: None"):
        gf.from_mujoco(model, data, None)
    with pytest.raises(gf.InvalidInputError, match="friction: no such option"):
        gf.from_mujoco(model, data, "box", friction=0.5)
