"""Where the search begins: palms around the object, or contacts on it that the tips can reach."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import quality_many

from .kinematics import Poses
from .poses import quaternion_of, rotations

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .distances import Distances
    from .grasp_problem import GraspProblem

    Array = NDArray[np.float64]


_SHAPES = 48
_JITTER = 0.25  # rad, of joints about the hand's posture in the first round
_NEARLY = 0.1  # rad, of joints about those at which earlier poses ended near the surface
_REACH = 0.04  # m: a tip that is further from the surface is not brought there
_MEASURED = 400  # of the samples that come nearest
_PER_GAP = 2.0  # 1/m: what a gap costs, in units of quality
_PER_FACING = 0.5
_FAR_PAIR = 1.2  # of the hand's opening: contacts further apart are not tried


def palm_seeds(
    distances: Distances, problem: GraspProblem, rng: np.random.Generator, samples: int, keep: int,
    spread: float = 1.0, nearly: Array | None = None,
) -> Poses:  # fmt: skip
    """Return the best of random palms about the object in preshaped hands.

    The middle of the tips is placed near the object's centre. A palm is judged by the quality of the contacts
    nearest to its tips, by the largest gap there, and by how its pads face them. `spread` widens the choice
    of preshaped hands; three quarters are near the driven joints `nearly` (N, k), where given.
    """
    kinematics, grasped = distances.kinematics, problem.grasped
    driven, tips, pads, links = _shapes(distances, rng, spread, nearly)
    chosen = rng.integers(len(driven), size=samples)
    quaternions = rng.normal(size=(samples, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    R = rotations(quaternions)
    middle = _middles(tips)
    spread = float(np.linalg.norm(tips - middle[:, None], axis=2).max())
    held = middle[chosen] + rng.normal(size=(samples, 3)) * spread / 3
    positions = grasped.center - np.einsum("nij,nj->ni", R, held)
    inside = grasped.inside((np.einsum("nij,ngj->ngi", R, links[chosen]) + positions[:, None]).reshape(-1, 3))
    free = np.flatnonzero(~inside.reshape(samples, -1).any(axis=1))
    if not len(free):
        free = np.arange(samples)
    T = np.einsum("nij,nkj->nki", R[free], tips[chosen[free]]) + positions[free, None]
    signed, near, outward = (x.reshape(len(free), T.shape[1], -1) for x in grasped.distance(T.reshape(-1, 3)))
    gap = np.abs(signed[..., 0] - kinematics.radii).max(axis=1)
    first = np.argsort(gap, kind="stable")
    first = first[gap[first] < max(_REACH, float(gap[first[0]]))][: max(_MEASURED, keep)]
    if not len(first):
        first = np.argsort(gap, kind="stable")[:keep]
    facing = -(np.einsum("nij,nkj->nki", R[free[first]], pads[chosen[free[first]]]) * outward[first]).sum(
        axis=2
    )
    epsilon = _epsilon(problem, near[first], -outward[first])
    score = epsilon - _PER_GAP * gap[first] + _PER_FACING * np.minimum(facing.min(axis=1), 0.7)
    rows = first[np.argsort(-score, kind="stable")[:keep]]
    best = free[rows]
    return Poses(positions[best], quaternions[best], driven[chosen[best]])


def contact_seeds(
    distances: Distances,
    problem: GraspProblem,
    rng: np.random.Generator,
    samples: int,
    keep: int,
    *,
    reach: bool = True,
) -> Poses:
    """Return poses whose tips come nearest to the best of random contacts on the surface.

    Contacts are judged by their quality and, with `reach`, by how well some preshaped hand fits them.
    """
    kinematics = distances.kinematics
    driven, tips, _, _ = _shapes(distances, rng)
    points, normals = _surface_points(problem, rng, max(200, samples // 5))
    count = len(kinematics.tips)
    sets = np.array([rng.choice(len(points), count, replace=False) for _ in range(samples)])
    opening = float(np.linalg.norm(tips[:, :, None] - tips[:, None], axis=3).max())
    centers = points[sets] - normals[sets] * kinematics.radii[:, None]
    apart = np.linalg.norm(centers[:, :, None] - centers[:, None], axis=3)
    least = np.where(np.eye(count, dtype=bool), np.inf, apart).min(axis=(1, 2))
    fits = (apart.max(axis=(1, 2)) < _FAR_PAIR * opening) & (least > kinematics.radii.max())
    kept = np.flatnonzero(fits) if fits.any() else np.arange(samples)
    sets, centers, apart = sets[kept], centers[kept], apart[kept]
    upper = np.triu_indices(count, 1)
    wanted, known = apart[:, *upper], np.linalg.norm(tips[:, :, None] - tips[:, None], axis=3)[:, *upper]
    misfit = np.abs(wanted[:, None] - known[None]).max(axis=2)
    shape = misfit.argmin(axis=1)
    misfit = misfit.min(axis=1)
    if reach:
        first = np.argsort(misfit, kind="stable")[: max(_MEASURED, keep)]
        score = _epsilon(problem, points[sets[first]], normals[sets[first]]) - 2 * _PER_GAP * misfit[first]
    else:
        first = np.arange(min(len(sets), max(_MEASURED, keep)))
        score = _epsilon(problem, points[sets[first]], normals[sets[first]])
    best = first[np.argsort(-score, kind="stable")[:keep]]
    fitted = [fitted_pose(tips[shape[k]], centers[k]) for k in best]
    return Poses(np.array([t for t, _ in fitted]), np.array([q for _, q in fitted]), driven[shape[best]])


def fitted_pose(tips: Array, centers: Array) -> tuple[Array, Array]:
    """Position and quaternion that carry tips (m, 3) nearest to centres (m, 3) (Kabsch)."""
    a, b = tips.mean(axis=0), centers.mean(axis=0)
    U, _, V = np.linalg.svd((tips - a).T @ (centers - b))
    turn = V.T @ np.diag([1, 1, np.sign(np.linalg.det(V.T @ U.T))]) @ U.T
    return b - turn @ a, quaternion_of(turn)


def _shapes(
    distances: Distances, rng: np.random.Generator, spread: float = 1.0, nearly: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    """Preshaped hands: driven joints, and in the palm's frame tips, pads and the middles of links."""
    kinematics = distances.kinematics
    hand, count = kinematics.hand, _SHAPES
    z = hand.posture[hand.driven] + spread * _JITTER * rng.normal(size=(count, len(hand.driven)))
    if nearly is not None:
        rows = rng.integers(len(nearly), size=3 * count // 4)
        z[: len(rows)] = nearly[rows] + _NEARLY * rng.normal(size=(len(rows), z.shape[1]))
    driven = np.clip(z, *hand.driven_limits.T)
    palms = Poses(np.zeros((count, 3)), np.tile([1.0, 0, 0, 0], (count, 1)), driven)
    places = kinematics.places(palms)
    pads = np.einsum("bmij,mj->bmi", places.tip_rotations, kinematics.pads)
    return driven, places.geoms[:, distances.cores], pads, places.geoms[:, distances.links]


def _middles(tips: Array) -> Array:
    """(S, 3) centres of small balls around the tips (Badoiu and Clarkson)."""
    middle: Array = tips.mean(axis=1)
    for step in range(1, 30):
        far = np.linalg.norm(tips - middle[:, None], axis=2).argmax(axis=1)
        middle = middle + (tips[np.arange(len(tips)), far] - middle) / (step + 1)
    return middle


def _surface_points(problem: GraspProblem, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Points of the surface, uniform by area, and normals into the object."""
    grasped = problem.grasped
    corners = grasped.vertices[grasped.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    face = rng.choice(len(area), count, p=area / area.sum())
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = np.moveaxis(corners[face], 1, 0)
    return a + u * (b - a) + v * (c - a), -grasped.normals[face]


def _epsilon(problem: GraspProblem, points: Array, normals: Array) -> Array:
    """Quality by the sum, which is quicker than the maximum, of contacts (N, m, 3)."""
    options = {**problem.contacts, "edges": 4}
    batch = quality_many(points, normals, criterion="sum", rtol=0.05, max_normal_force=1.0, **options)
    return np.nan_to_num(batch.epsilon, nan=-1.0)
