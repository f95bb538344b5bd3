"""Poses with what is known of them: contacts, clearances, and whether they are usable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspforce._core import quality_many

from .kinematics import Poses
from .snap import facing_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .distances import Distances
    from .grasp_problem import GraspProblem

    Array = NDArray[np.float64]


GAP = 3e-4
"""Largest gap in m of a tip that touches."""
OVERLAP = 4e-4
"""Largest penetration in m of links, and of fingers among each other."""

_SHARP = 25.0  # degrees between contact normal and face: beyond this a tip sits on an edge
_PER_DEGREE = 0.3 / 60  # what a degree more costs, in units of quality


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """B poses and their contacts."""

    poses: Poses
    points: Array
    """(B, m, 3) contacts on the object."""
    normals: Array
    """(B, m, 3) into the object."""
    gap: Array
    """(B,) largest distance in m of a tip from the surface."""
    overlap: Array
    """(B,) deepest penetration of links into the object, in m."""
    own_overlap: Array
    """(B,) deepest penetration of fingers among each other, in m."""
    facing: Array
    """(B,) least cosine between a pad and the way into the object."""
    sharpness: Array
    """(B,) sum over the tips of the degrees by which they sit on edges."""
    score: Array
    """(B,) quality less what sharpness costs; -inf where not measured."""

    def __len__(self) -> int:
        return len(self.gap)

    def __getitem__(self, rows: NDArray[np.int64]) -> Candidates:
        return Candidates(self.poses[rows], *(getattr(self, name)[rows] for name in _COLUMNS))

    def usable(self, pad: float | None) -> NDArray[np.bool_]:
        """(B,) whether all tips touch, nothing meets, and the pads face the object."""
        good = (self.gap < GAP) & (self.overlap < OVERLAP) & (self.own_overlap < OVERLAP)
        return good if pad is None else good & (self.facing > pad)

    @staticmethod
    def joined(parts: list[Candidates]) -> Candidates:
        """Join several sets."""
        columns = (np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS)
        return Candidates(Poses.joined([part.poses for part in parts]), *columns)


_COLUMNS = ("points", "normals", "gap", "overlap", "own_overlap", "facing", "sharpness", "score")


def measured(distances: Distances, problem: GraspProblem, poses: Poses, pad: float | None) -> Candidates:
    """Measure poses, and the quality of those that are usable."""
    places, touches, near = distances.measure(poses, 5e-4)
    count = len(poses)
    normals = -touches.outward
    found = Candidates(
        poses, touches.points, normals, np.abs(touches.gaps).max(axis=1), near.deepest(count, own=False),
        near.deepest(count, own=True), facing_of(distances, places, touches).min(axis=1),
        np.zeros(count), np.full(count, -np.inf),
    )  # fmt: skip
    rows = np.flatnonzero(found.usable(pad))
    if len(rows):
        grasped = problem.grasped
        faces = grasped.face_normals(touches.points[rows].reshape(-1, 3)).reshape(len(rows), -1, 3)
        cosines = np.clip(-(faces * normals[rows]).sum(axis=2), -1, 1)
        found.sharpness[rows] = np.maximum(np.degrees(np.arccos(cosines)) - _SHARP, 0).sum(axis=1)
        wrench = problem.external_wrench if problem.external_wrench.any() else None
        batch = quality_many(
            touches.points[rows], normals[rows], criterion=problem.criterion, rtol=0.02, edges=6,
            max_normal_force=1.0, external_wrench=wrench, **problem.contacts,
        )  # fmt: skip
        found.score[rows] = np.nan_to_num(batch.epsilon, nan=-1.0) - _PER_DEGREE * found.sharpness[rows]
    return found
