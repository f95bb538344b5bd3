"""MuJoCo models of a hand with an object: one for planning, with a free palm, and one to simulate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional

from .poses import turned_to

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .fingertips import Fingertip
    from .grasped_object import GraspedObject
    from .hand_data import HandData

    Array = NDArray[np.float64]


CORE = 0.2
"""Radius of a tip's core as a share of the tip's: the way to the object is known also where both touch."""

_SPHERE, _CAPSULE, _MESH = 2, 3, 7  # mjtGeom
_STIFF = [
    0.004,
    1.0,
]  # solref of couplings: with MuJoCo's default a coupled joint yields as much as its servo


def link_shapes(hand: HandData) -> list[int]:
    """Return the shapes that collide and are no tips; a tip given by numbers replaces those of its body."""
    tips = {tip.shape for tip in hand.fingertips}
    replaced = {tip.body for tip in hand.fingertips if tip.shape is None}
    shapes = hand._model.shapes  # noqa: SLF001
    return [k for k, s in enumerate(shapes) if s.collides and k not in tips and s.body not in replaced]


def add_hand(spec: Any, wrist: Any, hand: HandData, *, collides: bool) -> None:
    """Add bodies ``body k``, joints ``joint j``, links ``link k`` and tips ``tip k`` below a body."""
    mujoco = optional("mujoco", "hands")
    model = hand._model  # noqa: SLF001
    bodies: list[Any] = []
    for k, part in enumerate(model.bodies):
        body = (bodies[part.parent] if part.parent >= 0 else wrist).add_body(
            name=f"body {k}", pos=part.position, quat=part.quaternion
        )
        if part.mass > 0:
            body.mass, body.ipos, body.iquat = part.mass, part.inertia_position, part.inertia_quaternion
            body.inertia, body.explicitinertial = part.inertia, True
        bodies.append(body)
    for j, joint in enumerate(model.joints):
        low, high = hand.joint_limits[j]
        made = bodies[joint.body].add_joint(
            name=f"joint {j}", pos=joint.position, axis=joint.axis, range=(low, high),
            type=mujoco.mjtJoint.mjJNT_HINGE if joint.hinge else mujoco.mjtJoint.mjJNT_SLIDE,
        )  # fmt: skip
        made.limited, made.ref = mujoco.mjtLimited.mjLIMITED_TRUE, joint.reference
        made.damping, made.armature = [float(hand.damping[j]), 0, 0], float(hand.armature[j])
    for k in link_shapes(hand):
        shape = model.shapes[k]
        options: dict[str, Any] = {"type": mujoco.mjtGeom(shape.kind), "size": shape.size}
        if shape.vertices is not None and shape.faces is not None:
            _add_mesh(spec, f"mesh {k}", shape.vertices, shape.faces)
            options = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": f"mesh {k}"}
        geom = bodies[shape.body].add_geom(
            name=f"link {k}", pos=shape.position, quat=shape.quaternion, **options
        )
        _colliding(geom, collides)
    for k, tip in enumerate(hand.fingertips):
        geom = bodies[tip.body].add_geom(name=f"tip {k}", **_tip_options(mujoco, tip, 1.0))
        _colliding(geom, collides)


def add_object(spec: Any, body: Any, grasped: GraspedObject, mass: float) -> list[Any]:
    """Add the convex parts ``part k``, whose masses are in proportion to their volumes."""
    mujoco = optional("mujoco", "hands")
    volumes = [float(np.abs(_volume(points[faces]))) for points, faces in grasped.parts]
    geoms = []
    for k, (points, faces) in enumerate(grasped.parts):
        _add_mesh(spec, f"part {k}", points, faces)
        geom = body.add_geom(name=f"part {k}", type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"part {k}")
        geom.mass = mass * volumes[k] / sum(volumes)
        geom.contype, geom.conaffinity = 2, 1
        geoms.append(geom)
    return geoms


def add_couplings(spec: Any, hand: HandData) -> None:
    """Constrain the joints that follow others."""
    mujoco = optional("mujoco", "hands")
    model = hand._model.joints  # noqa: SLF001
    for j in np.setdiff1d(np.arange(len(hand.joints)), hand.driven).tolist():
        k = int(np.flatnonzero(hand.coupling[j])[0])
        driver, ratio = int(hand.driven[k]), float(hand.coupling[j, k])
        made = spec.add_equality(name=f"coupling {j}", type=mujoco.mjtEq.mjEQ_JOINT)
        made.objtype, made.name1, made.name2 = mujoco.mjtObj.mjOBJ_JOINT, f"joint {j}", f"joint {driver}"
        offset = float(hand.coupling_offset[j]) - model[j].reference + ratio * model[driver].reference
        made.data[:5] = [offset, ratio, 0, 0, 0]
        made.solref = _STIFF


def planning_spec(hand: HandData, grasped: GraspedObject | None) -> Any:
    """Specification of a hand on a free palm and of an object at rest at the origin of its own frame.

    The tips have a second, smaller geom ``core k`` of their shape.
    """
    mujoco = optional("mujoco", "hands")
    spec = mujoco.MjSpec()
    spec.memory, spec.compiler.degree = 1 << 20, False
    wrist = spec.worldbody.add_body(name="wrist")
    wrist.add_freejoint(name="wrist")
    add_hand(spec, wrist, hand, collides=False)
    add_couplings(spec, hand)
    for k, tip in enumerate(hand.fingertips):
        geom = spec.body(f"body {tip.body}").add_geom(name=f"core {k}", **_tip_options(mujoco, tip, CORE))
        _colliding(geom, False)
    # A body without mass cannot move; what it weighs does not matter here.
    wrist.mass, wrist.inertia, wrist.explicitinertial = 1.0, [1e-3] * 3, True
    for body in spec.bodies[2:]:
        if not body.explicitinertial:
            body.mass, body.inertia, body.explicitinertial = 1e-3, [1e-6] * 3, True
    if grasped is not None:
        for geom in add_object(spec, spec.worldbody.add_body(name="object"), grasped, 1.0):
            _colliding(geom, False)
    return spec


def _tip_options(mujoco: Any, tip: Fingertip, share: float) -> dict[str, Any]:
    sphere = tip.half_length == 0
    return {
        "type": mujoco.mjtGeom.mjGEOM_SPHERE if sphere else mujoco.mjtGeom.mjGEOM_CAPSULE,
        "size": [share * tip.radius, 0 if sphere else tip.half_length, 0],
        "pos": tip.position,
        "quat": turned_to(tip.axis),
    }


def _colliding(geom: Any, collides: bool) -> None:
    geom.contype, geom.conaffinity, geom.margin = int(collides), 2 * int(collides), 0


def _add_mesh(spec: Any, name: str, vertices: Array, faces: NDArray[Any]) -> None:
    mesh = spec.add_mesh(name=name)
    mesh.uservert, mesh.userface = vertices.ravel().tolist(), faces.ravel().tolist()


def _volume(triangles: Array) -> float:
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)
