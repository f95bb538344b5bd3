"""The surface of a hand in a pose, as triangles for pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_array, finite_vector
from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

from .hand_model import Shape
from .poses import matrix_of, rotation_of, rotations, turned_to

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from .hand_data import HandData

    Array = NDArray[np.float64]


_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = 2, 3, 4, 5, 6, 7  # mjtGeom


def hand_surface(
    hand: HandData, palm: ArrayLike, joints: ArrayLike, *, forearm: bool
) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (V, 3) in m and triangles (F, 3) of all visible shapes; see `Hand.surface`."""
    bodies = body_poses(hand, palm, joints)
    behind = set() if forearm else _behind_the_wrist(hand, bodies, palm)
    vertices, faces, start = [], [], 0
    for body, (points, numbers) in body_surfaces(hand).items():
        if body in behind:
            continue
        vertices.append(points @ bodies[body][:3, :3].T + bodies[body][:3, 3])
        faces.append(numbers + start)
        start += len(points)
    return np.vstack(vertices), np.vstack(faces)


def body_surfaces(hand: HandData) -> dict[int, tuple[Array, NDArray[np.int64]]]:
    """Vertices (V, 3) in m, in the frame of its body, and triangles (F, 3) of each body that is visible."""
    model = hand._model  # noqa: SLF001
    # A body that has meshes to be seen hides the shapes that it collides by.
    seen = {shape.body for shape in model.shapes if not shape.collides and shape.kind == _MESH}
    parts: dict[int, tuple[Array, NDArray[np.int64]]] = {}
    for shape in (*model.shapes, *_given_tips(hand, seen)):
        made = None if shape.collides and shape.body in seen else _triangles(shape)
        if made is None:
            continue
        place = matrix_of(shape.position, rotations(shape.quaternion))
        points, numbers = made[0] @ place[:3, :3].T + place[:3, 3], made[1].astype(np.int64)
        if shape.body in parts:
            before, known = parts[shape.body]
            points, numbers = np.vstack([before, points]), np.vstack([known, numbers + len(before)])
        parts[shape.body] = points, numbers
    return parts


def _given_tips(hand: HandData, seen: set[int]) -> list[Shape]:
    """Return the tips that are given by numbers, on bodies without meshes to be seen."""
    shapes = []
    for tip in hand.fingertips:
        if tip.shape is None and tip.body not in seen:
            kind, size = (
                (_CAPSULE if tip.half_length else _SPHERE),
                np.array([tip.radius, tip.half_length, 0]),
            )
            turn = turned_to(tip.axis)
            shapes.append(Shape(tip.name, tip.body, kind, size, tip.position, turn, True))
    return shapes


def _behind_the_wrist(hand: HandData, bodies: list[Array], palm: ArrayLike) -> set[int]:
    """Return the bodies above that to which the palm is fixed."""
    parents = [part.parent for part in hand._model.bodies]  # noqa: SLF001
    # The palm's body has the palm's pose.
    body = next((k for k, pose in enumerate(bodies) if np.allclose(pose, palm, atol=1e-6)), 0)
    above = []
    while (body := parents[body]) >= 0:
        above.append(body)
    return set(above[1:])


def body_poses(hand: HandData, palm: ArrayLike, joints: ArrayLike) -> list[Array]:
    """Poses (4, 4) of all bodies of the hand."""
    base = finite_array("palm", palm)
    if base.shape != (4, 4):
        raise InvalidInputError(f"palm: shape {base.shape}, expected (4, 4)")
    joints = finite_vector("joints", joints, len(hand.joints))
    model = hand._model  # noqa: SLF001
    poses: list[Array] = []
    for number, part in enumerate(model.bodies):
        above = base if part.parent < 0 else poses[part.parent]
        pose = above @ matrix_of(part.position, rotations(part.quaternion))
        for j, joint in enumerate(model.joints):
            if joint.body != number:
                continue
            moved = joints[j] - joint.reference
            turn = rotation_of(joint.axis * moved) if joint.hinge else np.eye(3)
            # A hinge turns about its own point of the body.
            shift = joint.position - turn @ joint.position if joint.hinge else joint.axis * moved
            pose = pose @ matrix_of(shift, turn)
        poses.append(pose)
    return poses


def _triangles(shape: Shape) -> tuple[Array, NDArray[Any]] | None:
    if shape.vertices is not None and shape.faces is not None:
        return shape.vertices, shape.faces
    creation = optional("trimesh", "hands").creation
    size = shape.size
    if shape.kind == _BOX:
        mesh = creation.box(2 * size)
    elif shape.kind in (_SPHERE, _ELLIPSOID):
        mesh = creation.icosphere(2, 1.0)
        mesh.apply_scale(size if shape.kind == _ELLIPSOID else float(size[0]))
    elif shape.kind in (_CAPSULE, _CYLINDER):
        make = creation.capsule if shape.kind == _CAPSULE else creation.cylinder
        mesh = make(height=2 * float(size[1]), radius=float(size[0]))
        mesh.vertices -= (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    else:
        return None
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces)
