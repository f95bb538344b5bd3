"""Grasps from Drake: a ball between two plates."""

import numpy as np
import pytest

import graspforce as gf

pytest.importorskip("pydrake", reason="Drake is not installed: pip install --group simulators")

GRAVITY = 9.81


@pytest.fixture(scope="module")
def resting_ball():
    from pydrake.geometry import HalfSpace, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.multibody.tree import SpatialInertia
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    plant.set_contact_model(ContactModel.kPoint)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(mass=2.0, radius=0.1))
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(0.5, 0.5))
    floor = HalfSpace()
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), floor, "floor", CoulombFriction(1.0, 1.0)
    )
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, ball, RigidTransform([0.3, 0, 0.1]))
    simulator.AdvanceTo(1.0)
    return diagram, simulator, plant, context


def test_a_resting_ball_is_held_by_its_weight(resting_ball):
    *_, plant, context = resting_ball
    reading = gf.from_drake(plant, context, "ball", max_normal_force=100.0)
    np.testing.assert_allclose(reading.grasp.normals, [[0, 0, 1]], atol=1e-9)
    np.testing.assert_allclose(reading.grasp.friction, 2 * 0.5 * 1.0 / 1.5)
    np.testing.assert_allclose(reading.forces, [[2 * GRAVITY, 0, 0]], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(reading.external_wrench[:3], [0, 0, -2 * GRAVITY], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(reading.grasp.origin, [0.3, 0, 0.1], atol=1e-2)


def test_minimax_forces_balance_what_drakes_forces_balance(resting_ball):
    *_, plant, context = resting_ball
    reading = gf.from_drake(plant, context, "ball", max_normal_force=100.0)
    weight = [0, 0, reading.external_wrench[2], 0, 0, 0]
    solution = gf.ForceDistributor(reading.grasp).solve(weight)
    assert solution.sigma_max <= reading.sigma_max * (1 + 1e-9)


def test_the_floor_feels_the_opposite(resting_ball):
    *_, plant, context = resting_ball
    world = gf.from_drake(plant, context, 0, origin=[0.0, 0.0, 0.0])
    np.testing.assert_allclose(world.grasp.normals, [[0, 0, -1]], atol=1e-9)
    assert world.forces[0, 0] > 0


def test_a_body_that_is_not_there_is_named(resting_ball):
    *_, plant, context = resting_ball
    with pytest.raises(gf.InvalidInputError, match="cube"):
        gf.from_drake(plant, context, "cube")
