"""What a hand is made of, read from a compiled MuJoCo model: bodies, joints and geoms below its wrist."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.optional_imports import optional
from graspforce._internal.to_dict import ReadOnly
from graspforce.errors import InvalidInputError

from .model_relations import model_relations
from .poses import inverse, matrix_of, quaternion_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class BodyPart(ReadOnly):
    """A rigid body; the first of a hand is its palm or what the palm is fixed to."""

    name: str
    parent: int
    position: Array
    quaternion: Array
    mass: float
    inertia_position: Array
    inertia_quaternion: Array
    inertia: Array


@dataclass(frozen=True, slots=True, eq=False)
class Joint(ReadOnly):
    """A hinge or slide joint; `range` is None without limits."""

    name: str
    body: int
    hinge: bool
    position: Array
    axis: Array
    reference: float
    range: tuple[float, float] | None
    torque_limit: float | None
    stiffness: float | None
    damping: float
    armature: float


@dataclass(frozen=True, slots=True, eq=False)
class Shape(ReadOnly):
    """A geom in the frame of its body; `kind` is MuJoCo's type, a mesh has its own vertices and faces."""

    name: str
    body: int
    kind: int
    size: Array
    position: Array
    quaternion: Array
    collides: bool
    vertices: Array | None = None
    faces: NDArray[np.int32] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class HandModel(ReadOnly):
    """The bodies, joints and shapes of a hand, in the order of MuJoCo."""

    bodies: tuple[BodyPart, ...]
    joints: tuple[Joint, ...]
    shapes: tuple[Shape, ...]
    sites: tuple[tuple[str, int, Array, float], ...]
    """Name, body, position (3,) in m and size in m of each site."""
    relations: tuple[tuple[str, str, float, float], ...]
    """Dependent joint, driving joint, ratio and offset, from tendons and equality constraints."""


def named(argument: str, name: str, candidates: Sequence[str], what: str) -> int:
    """Index of a name, or an error that lists the candidates."""
    if name in candidates:
        return list(candidates).index(name)
    near = difflib.get_close_matches(name, [c for c in candidates if c], 3, 0.5)
    listed = ", ".join(dict.fromkeys([*near, *(c for c in candidates if c)]))
    raise InvalidInputError(f"{argument}: {name!r} is no {what} of the model; there are {listed}")


def read_hand(model: Any, palm: str | None, root: str | None) -> HandModel:
    """Read the hand below `root` from a `mujoco.MjModel`, in the frame of its `palm`.

    Joints between root and palm are fixed where they are in the model. Geoms of the world and bodies outside
    the root are left out.
    """
    mujoco = optional("mujoco", "hands")
    names = [model.body(b).name for b in range(model.nbody)]
    hand = _default_palm(model) if palm is None else named("palm", palm, names, "body")
    top = hand if root is None else named("root", root, names, "body")
    above = _ancestors(model, hand)
    if top not in above:
        raise InvalidInputError(f"root: {root!r} is not {names[hand]!r} or a body above it")
    fixed = set(above[: above.index(top) + 1])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    kept = [b for b in range(1, model.nbody) if top in _ancestors(model, b)]
    index = {b: i for i, b in enumerate(kept)}
    to_palm = inverse(_pose(data, hand))
    bodies, joints = [], []
    for b in kept:
        parent = -1 if b == top else index[int(model.body_parentid[b])]
        if parent < 0:
            place = to_palm @ _pose(data, top)
            position, quaternion = place[:3, 3], quaternion_of(place[:3, :3])
        else:
            position, quaternion = model.body_pos[b].copy(), model.body_quat[b].copy()
            if b in fixed:
                place = inverse(_pose(data, int(model.body_parentid[b]))) @ _pose(data, b)
                position, quaternion = place[:3, 3], quaternion_of(place[:3, :3])
        bodies.append(
            BodyPart(
                names[b], parent, position, quaternion, float(model.body_mass[b]), model.body_ipos[b].copy(),
                model.body_iquat[b].copy(), model.body_inertia[b].copy(),
            )
        )  # fmt: skip
        if b not in fixed:
            first = int(model.body_jntadr[b])
            count = int(model.body_jntnum[b])
            joints += [_joint(mujoco, model, j, index[b]) for j in range(first, first + count)]
    if not joints:
        raise InvalidInputError(
            f"palm: no joint is below {names[hand]!r}; name the body that holds the fingers"
        )
    shapes = tuple(
        _shape(mujoco, model, g, index) for g in range(model.ngeom) if model.geom_bodyid[g] in index
    )
    sites = tuple(
        (
            model.site(s).name, index[int(model.site_bodyid[s])], model.site_pos[s].copy(),
            float(model.site_size[s][0]),
        )
        for s in range(model.nsite)
        if int(model.site_bodyid[s]) in index
    )  # fmt: skip
    moving = {joint.name for joint in joints}
    relations = tuple(r for r in model_relations(model) if r[0] in moving and r[1] in moving)
    return HandModel(tuple(bodies), tuple(joints), shapes, sites, relations)


def _default_palm(model: Any) -> int:
    """Return the deepest body above all joints but free ones, which is where the fingers begin."""
    jointed = [
        b for b in range(1, model.nbody) if model.body_jntnum[b] and model.jnt_type[model.body_jntadr[b]] > 1
    ]
    if not jointed:
        raise InvalidInputError("palm: the model has no hinge or slide joints")
    common = _ancestors(model, int(model.body_parentid[jointed[0]]))
    for b in jointed[1:]:
        above = set(_ancestors(model, int(model.body_parentid[b])))
        common = [c for c in common if c in above]
    if not common or common[0] == 0:
        raise InvalidInputError(
            "palm: the joints have no body in common; name the body that holds the fingers"
        )
    return common[0]


def _ancestors(model: Any, body: int) -> list[int]:
    """Return the body itself, then what is above it, without the world."""
    found = []
    while body > 0:
        found.append(body)
        body = int(model.body_parentid[body])
    return found


def _pose(data: Any, body: int) -> Array:
    return matrix_of(data.xpos[body], data.xmat[body].reshape(3, 3))


def _joint(mujoco: Any, model: Any, j: int, body: int) -> Joint:
    kind, name = int(model.jnt_type[j]), model.joint(j).name
    hinge, slide = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
    if kind not in (hinge, slide):
        raise InvalidInputError(f"joints: {name!r} is neither a hinge nor a slide, and lies below the palm")
    if not name:
        raise InvalidInputError(f"joints: joint {j} of the model has no name")
    dof = int(model.jnt_dofadr[j])
    limit = float(np.abs(model.jnt_actfrcrange[j]).min()) if model.jnt_actfrclimited[j] else None
    stiffness = None
    for a in range(model.nu):
        if (
            int(model.actuator_trntype[a]) == int(mujoco.mjtTrn.mjTRN_JOINT)
            and model.actuator_trnid[a][0] == j
        ):
            gear = abs(float(model.actuator_gear[a][0]))
            if model.actuator_forcelimited[a]:
                own = float(np.abs(model.actuator_forcerange[a]).min()) * gear
                limit = own if limit is None else min(limit, own)
            if model.actuator_biasprm[a][1] < 0:
                stiffness = -float(model.actuator_biasprm[a][1]) * gear**2
    bounds = model.jnt_range[j]
    return Joint(
        name, body, kind == hinge, model.jnt_pos[j].copy(), model.jnt_axis[j].copy(),
        float(model.qpos0[model.jnt_qposadr[j]]),
        (float(bounds[0]), float(bounds[1])) if model.jnt_limited[j] else None, limit, stiffness,
        float(np.ravel(model.dof_damping[dof])[0]), float(model.dof_armature[dof]),
    )  # fmt: skip


def _shape(mujoco: Any, model: Any, g: int, index: dict[int, int]) -> Shape:
    vertices = faces = None
    if int(model.geom_type[g]) == int(mujoco.mjtGeom.mjGEOM_MESH):
        k = int(model.geom_dataid[g])
        first, count = int(model.mesh_vertadr[k]), int(model.mesh_vertnum[k])
        vertices = np.asarray(model.mesh_vert[first : first + count], dtype=np.float64)
        first, count = int(model.mesh_faceadr[k]), int(model.mesh_facenum[k])
        faces = np.array(model.mesh_face[first : first + count], dtype=np.int32)
    return Shape(
        model.geom(g).name, index[int(model.geom_bodyid[g])], int(model.geom_type[g]),
        model.geom_size[g].copy(), model.geom_pos[g].copy(), model.geom_quat[g].copy(),
        bool(model.geom_contype[g] or model.geom_conaffinity[g]), vertices, faces,
    )  # fmt: skip
