"""Meshes of several parts that overlap, nest, touch or stand apart, beside the planes of each part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from benches.trust.row import Row

import graspforce as gf
from graspforce.surfaces import MeshSurface

__all__ = ["KINDS", "Assembly", "assembly", "faults", "rows"]

CASES = 900
KINDS = (
    "overlapping", "nested", "touching", "flush", "disjoint", "duplicate", "edge to edge", "single precision",
    "merged corners",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Assembly:
    """Convex parts, each known by its planes as well as by its triangles."""

    parts: tuple[trimesh.Trimesh, ...]
    merged: bool

    @property
    def mesh(self) -> trimesh.Trimesh:
        """All parts in one list of triangles."""
        joined = trimesh.util.concatenate(list(self.parts))
        if self.merged:
            joined.merge_vertices()
        return joined

    def depth(self, points: np.ndarray, without: int | None = None) -> np.ndarray:
        """(B,) zero on the boundary of the union, negative inside; at most the distance outside."""
        deepest = np.full(len(points), np.inf)
        for number, part in enumerate(self.parts):
            if number != without:
                normals, corners = np.asarray(part.face_normals), np.asarray(part.triangles[:, 0])
                over = points @ normals.T - (normals * corners).sum(axis=1)
                deepest = np.minimum(deepest, over.max(axis=1))
        return deepest


def _shape(random: np.random.Generator, size: float) -> trimesh.Trimesh:
    kind = random.integers(3)
    if kind == 0:
        return trimesh.creation.box(size * random.uniform(0.3, 1.0, 3))
    if kind == 1:
        return trimesh.creation.icosphere(subdivisions=int(random.integers(1, 3)), radius=size / 2)
    sections = int(random.integers(6, 24))
    return trimesh.creation.cylinder(
        size * random.uniform(0.2, 0.5), size * random.uniform(0.3, 1.5), sections=sections
    )


def _moved(mesh: trimesh.Trimesh, by: np.ndarray) -> trimesh.Trimesh:
    other = mesh.copy()
    other.apply_translation(by)
    return other


def _against(part: trimesh.Trimesh, kind: str, random: np.random.Generator, size: float) -> trimesh.Trimesh:
    """Return a box that touches another one: by a face, by an edge, or with two sides in one plane."""
    axis = int(random.integers(3))
    other = (axis + 1) % 3
    box = trimesh.creation.box(size * random.uniform(0.3, 1.0, 3))
    low, high = part.bounds
    middle, half = (low + high) / 2, box.extents / 2
    by = middle + random.uniform(-0.2, 0.2, 3) * size
    by[axis] = high[axis] + half[axis]
    if kind == "flush":
        by[axis] = middle[axis]
        by[other] = high[other] - half[other]
    if kind == "edge to edge":
        by[other] = high[other] + half[other]
        by[3 - axis - other] = middle[3 - axis - other]
    return _moved(box, by)


def assembly(seed: int, kind: str) -> Assembly:
    """Draw two to five parts of about 10 cm that meet in the way that `kind` says, turned at random."""
    random = np.random.default_rng(seed)
    size = 0.1
    parts = [_shape(random, size)]
    count = int(random.integers(1, 5))
    for _ in range(count):
        part = _shape(random, size)
        if kind in ("overlapping", "single precision", "merged corners"):
            parts.append(_moved(part, random.uniform(-0.4, 0.4, 3) * size))
        elif kind == "nested":
            part.apply_scale(0.1)
            parts.append(_moved(part, random.uniform(-0.02, 0.02, 3) * size))
        elif kind == "duplicate":
            parts.append(parts[int(random.integers(len(parts)))].copy())
        elif kind == "disjoint":
            parts.append(_moved(part, np.array([len(parts) * 3 * size, 0, 0])))
        else:
            if len(parts) == 1:
                parts[0] = trimesh.creation.box(size * random.uniform(0.3, 1.0, 3))
            parts.append(_against(parts[-1], kind, random, size))
    if random.random() < 0.7:
        turn = trimesh.transformations.random_rotation_matrix(random.random(3))
        for part in parts:
            part.apply_transform(turn)
    if kind == "single precision":
        for part in parts:
            part.vertices = part.vertices.astype(np.float32).astype(np.float64)
    return Assembly(tuple(parts), merged=kind == "merged corners" or bool(random.random() < 0.3))


def faults(drawn: Assembly, random: np.random.Generator, number: int = 200) -> str | None:
    """Return what is wrong with contacts on the parts together, if anything."""
    surface = MeshSurface(drawn.mesh, normals="face")
    extent = float(np.ptp(surface.bounds, axis=1).max())
    near = 1e-6 * extent
    asked = random.uniform(*surface.bounds.T, (number, 3))
    points, _ = surface.contacts(asked)
    if np.abs(drawn.depth(points)).max() > near:
        return "a contact inside a part, or off the surface"
    vertices, faces = surface.boundary
    places, on = trimesh.sample.sample_surface(
        trimesh.Trimesh(vertices, faces, process=False), number, seed=0
    )
    across = np.cross(*(vertices[faces[on, corner]] - vertices[faces[on, 0]] for corner in (1, 2)))
    outward = across / np.linalg.norm(across, axis=1, keepdims=True)
    inside, outside = (drawn.depth(places + step * near * outward) for step in (-10, 10))
    # But for the one in many that lies within the step of an edge.
    if ((inside > near) | (outside < -near)).sum() > 1:
        return "a wall inside the object, or a face that is turned round"
    for at, part in enumerate(drawn.parts):
        on_part = trimesh.sample.sample_surface(part, number, seed=0)[0]
        seen = on_part[drawn.depth(on_part, without=at) > 10 * near]
        if len(seen):
            found = surface.contacts(seen)[0]
            if np.linalg.norm(found - seen, axis=1).max() > near:
                return f"part {at}: a visible place is not on the surface"
    return None


def rows(share: float) -> list[Row]:
    """Every kind of assembly in turn."""
    cases = max(len(KINDS), round(CASES * share))
    missed = wrong = 0
    for seed in range(cases):
        try:
            wrong += faults(assembly(seed, KINDS[seed % len(KINDS)]), np.random.default_rng(seed)) is not None
        except gf.GraspForceError:
            missed += 1
    return [Row("meshes of several parts", cases, "the planes of each convex part", missed, wrong)]
