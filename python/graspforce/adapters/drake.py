"""Point contacts of a Drake multibody plant."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np

from graspforce._core import unwarned_grasp
from graspforce._internal.checks import instance, known_options
from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError, NoContactError

from .contact_reading import ContactReading, ReadingOptions


def from_drake(
    plant: Any,
    context: Any,
    body: str | int,
    **options: Unpack[ReadingOptions],
) -> ContactReading:
    """Read the point contacts on a body of a Drake `MultibodyPlant`.

    The friction of a pair is Drake's own combination, ``2 mu_1 mu_2 / (mu_1 + mu_2)``, of the static
    coefficients. Hydroelastic surfaces are no points and are left out.

    The plant and its context belong to one thread while they are read.

    Parameters
    ----------
    plant : pydrake.multibody.plant.MultibodyPlant
        The plant, connected to a scene graph.
    context : pydrake.systems.framework.Context
        The plant's own context in a diagram's. Both are only read.
    body : str or int
        Name or index of the body.
    **options
        As for `graspforce.from_mujoco`.

    Returns
    -------
    ContactReading
        The grasp, and Drake's own contact forces on the body.

    Raises
    ------
    InvalidInputError
        There is no such body.
    NoContactError
        Nothing touches it at a point.
    MissingExtraError
        Drake is not installed.

    Examples
    --------
    A ball of 2 kg pressed into the floor a little.

    >>> from pydrake.geometry import Box, Sphere
    >>> from pydrake.math import RigidTransform
    >>> from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
    >>> from pydrake.multibody.tree import SpatialInertia
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> import graspforce as gf
    >>> builder = DiagramBuilder()
    >>> plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    >>> ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(mass=2.0, radius=0.1))
    >>> here, beneath = RigidTransform(), RigidTransform([0, 0, -0.5])
    >>> friction = CoulombFriction(0.5, 0.5)
    >>> _ = plant.RegisterCollisionGeometry(ball, here, Sphere(0.1), "ball", friction)
    >>> _ = plant.RegisterCollisionGeometry(plant.world_body(), beneath, Box(2, 2, 1), "floor", friction)
    >>> plant.Finalize()
    >>> diagram = builder.Build()
    >>> whole = diagram.CreateDefaultContext()
    >>> context = plant.GetMyMutableContextFromRoot(whole)
    >>> plant.SetFreeBodyPose(context, ball, RigidTransform([0, 0, 0.0999]))
    >>> reading = gf.from_drake(plant, context, "ball", max_normal_force=100.0)
    >>> reading.grasp.normals.tolist(), reading.grasp.friction.tolist()
    ([[0.0, 0.0, 1.0]], [0.5])
    """
    known_options(options, ReadingOptions.__annotations__)
    multibody = optional("pydrake.multibody.plant", "drake")
    combined_friction = multibody.CalcContactFrictionFromSurfaceProperties
    instance("plant", plant, multibody.MultibodyPlant)
    instance("context", context, optional("pydrake.systems.framework", "drake").Context)
    index = optional("pydrake.multibody.tree", "drake").BodyIndex
    try:
        ours = plant.GetBodyByName(body) if isinstance(body, str) else plant.get_body(index(body))
    except (RuntimeError, IndexError, TypeError) as error:
        raise InvalidInputError(f"body: {body!r}: {error}") from None
    inspector = plant.get_geometry_query_input_port().Eval(context).inspector()
    results = plant.get_contact_results_output_port().Eval(context)
    rows, ids = [], []
    for i in range(results.num_point_pair_contacts()):
        info = results.point_pair_contact_info(i)
        if ours.index() not in (info.bodyA_index(), info.bodyB_index()):
            continue
        pair = info.point_pair()
        # Drake's normal points from B into A, and its force acts on B.
        sign = 1 if ours.index() == info.bodyA_index() else -1
        surfaces = (
            inspector.GetProximityProperties(geometry).GetProperty("material", "coulomb_friction")
            for geometry in (pair.id_A, pair.id_B)
        )
        mu = combined_friction(*surfaces).static_friction()
        rows.append((info.contact_point(), sign * pair.nhat_BA_W, mu, -sign * info.contact_force()))
        ids.append(i)
    if not rows:
        raise NoContactError(f"body: nothing touches {body!r} at a point")
    positions, normals, friction, world_forces = (np.array(column) for column in zip(*rows, strict=True))
    centre = ours.EvalPoseInWorld(context) @ ours.CalcCenterOfMassInBodyFrame(context)
    given: dict[str, Any] = {"origin": centre, **options}
    grasp = unwarned_grasp(positions, normals, friction, **given)
    forces = np.einsum("iab,ib->ia", grasp.frames, world_forces)
    return ContactReading(grasp, forces, tuple(ids))
