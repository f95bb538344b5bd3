"""Where the search for given contacts begins: preshaped hands fitted by all assignments of fingers."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.checks import whole_number
from graspforce.errors import InvalidInputError

from .kinematics import HandKinematics, Poses
from .poses import quaternion_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from .hand_data import HandData

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]

_SHAPES = 60
_JITTER = 0.3  # rad
_PER_FACING = 0.01  # m: what a pad that looks at the contact is worth, of the misfit of a shape


def finger_numbers(hand: HandData, given: Sequence[int]) -> tuple[int, ...]:
    """Check the numbers of fingertips that an argument `fingers` gives."""
    if not isinstance(given, Iterable):
        raise InvalidInputError(f"fingers: {given!r}, expected numbers of fingertips such as (0, 1)")
    most = hand.num_fingers - 1
    return tuple(whole_number(f"fingers, entry {k}", f, least=0, most=most) for k, f in enumerate(given))


def reach_seeds(
    hand: HandData, p: Array, n: Array, fingers: Sequence[int] | None, tries: int, seed: int
) -> list[tuple[tuple[int, ...], Integers, Poses]]:
    """Poses that fit best, by sets of fingers: the fingers in order, the contact of each, and the poses."""
    count = len(p)
    if fingers is None:
        assignments = list(itertools.permutations(range(hand.num_fingers), count))
    else:
        given = finger_numbers(hand, fingers)
        if len(given) != count or len(set(given)) < count:
            raise InvalidInputError(f"fingers: {list(given)}, expected {count} different fingertips")
        assignments = [given]
    kinematics = HandKinematics(hand, None, range(hand.num_fingers))
    rng = np.random.default_rng(seed)
    z = hand.posture[hand.driven] + _JITTER * rng.normal(size=(_SHAPES, len(hand.driven)))
    driven = np.clip(z, *hand.driven_limits.T)
    palms = Poses(np.zeros((_SHAPES, 3)), np.tile([1.0, 0, 0, 0], (_SHAPES, 1)), driven)
    places = kinematics.places(palms)
    cores = [kinematics.model.geom(f"core {k}").id for k in range(hand.num_fingers)]
    tips, pads = places.geoms[:, cores], np.einsum("bmij,mj->bmi", places.tip_rotations, kinematics.pads)
    order = np.array(assignments)
    centers = p[None] - n[None] * kinematics.radii[order][..., None]
    turn, shift, misfit = _fits(tips[:, order], centers)
    facing = np.einsum("saij,samj,mi->sam", turn, pads[:, order], n).min(axis=2)
    score = misfit - _PER_FACING * np.minimum(facing, 0.7)
    best = np.argsort(score, axis=None, kind="stable")[:tries]
    groups: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for flat in best:
        s, a = np.unravel_index(flat, score.shape)
        groups.setdefault(assignments[a], []).append((int(s), int(a)))
    found = []
    for assignment, pairs in groups.items():
        contact_of = np.argsort(assignment).astype(np.int64)
        poses = Poses(
            np.array([shift[s, a] for s, a in pairs]),
            np.array([quaternion_of(turn[s, a]) for s, a in pairs]),
            driven[[s for s, _ in pairs]],
        )
        found.append((tuple(sorted(assignment)), contact_of, poses))
    return found


def _fits(tips: Array, centers: Array) -> tuple[Array, Array, Array]:
    """Rotations (S, A, 3, 3), shifts (S, A, 3) and misfits (S, A) in m of tips carried to centres."""
    a, b = tips.mean(axis=2), centers.mean(axis=1)
    U, _, V = np.linalg.svd(np.einsum("samj,amk->sajk", tips - a[:, :, None], centers - b[:, None]))
    V = np.swapaxes(V, -1, -2)
    V[..., 2] *= np.sign(np.linalg.det(V) * np.linalg.det(U))[..., None]
    turn = V @ np.swapaxes(U, -1, -2)
    shift = b[None] - np.einsum("saij,saj->sai", turn, a)
    carried = np.einsum("saij,samj->sami", turn, tips) + shift[:, :, None]
    return turn, shift, np.linalg.norm(carried - centers[None], axis=3).max(axis=2)
