"""From a hand and an object to grasps that hold."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from graspforce._internal.checks import chosen, real_number, whole_number
from graspforce._internal.checks import instance as instance_of
from graspforce.errors import InvalidInputError, NoGraspError
from graspforce.planning.problem import deadline_after
from graspforce.planning.progress import reporting

from .distances import Distances
from .finishing import Finish
from .grasp_problem import GraspProblem, push_rows
from .grasped_object import grasped_object
from .hand import Hand
from .hand_plan_set import HandPlanSet, SearchEnd
from .kinematics import HandKinematics
from .plan_making import Maker
from .reach_seeds import finger_numbers
from .search import Search

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from graspforce.planning.progress import Report
    from graspforce.typing import Criterion

    from .hand_plan import HandPlan

    Array = NDArray[np.float64]


# Least cosine of pads and steps onto the surface, round by round. Small objects need more steps than large
# ones; pads may look aside only where no plan was found.
_45, _70 = np.cos(np.deg2rad(45.0)), np.cos(np.deg2rad(70.0))
_ROUNDS: tuple[tuple[float | None, int], ...] = (
    (_45, 25), (_45, 40), (_45, 60), (_45, 100), (_45, 100), (_70, 25), (None, 25),
)  # fmt: skip
_LAST_TRIED = 2  # round after which plans are kept though all were lost in simulation
_POOL = 16
_HARD = 4.0  # of the preload
_ROOM = 1.1  # of the hand's opening: a wider object is not tried


def plan_hand(
    hand: Hand,
    mesh: Any,
    fingers: Sequence[int] | None = None,
    criterion: Criterion = "max",
    *,
    friction: float = 0.6,
    torsion: float = 0.02,
    external_wrench: ArrayLike | None = None,
    preload: float = 2.0,
    friction_margin: float = 1.5,
    pushes: ArrayLike | None = None,
    rank: Literal["slip onset", "quality"] = "slip onset",
    seeds: Literal["palms", "contacts", "both"] = "palms",
    starts: int = 60,
    samples: int = 2000,
    refine: bool = True,
    simulate: bool = True,
    best: int = 5,
    target: float = 1.2,
    retreat: float = 0.01,
    time_limit: float | None = None,
    seed: int = 0,
    progress: bool | Report = False,
) -> HandPlanSet:
    """Plan grasps of an object by a hand: palm pose, joints, contacts and how hard to squeeze.

    The search samples palms around the object and puts the tips on its surface. It refines the best poses,
    looks for forces that press all fingers, and ranks by the push at which the first contact slips.

    Safe to call from several threads: the hand and the mesh are only read.

    Parameters
    ----------
    hand : Hand
        The hand.
    mesh : trimesh.Trimesh, tuple or path
        A closed mesh in m: anything with ``vertices`` and ``faces``, a pair of both, or the path of a file.
        ``MeshSurface(path, unit="mm")`` is a mesh in m, too. It is planned on
        convex parts that cover it; they exceed its volume by 3% at most where 32 parts suffice. Of more than
        3000 triangles those are left out that change it by less than a thousandth of its extent.
    fingers : sequence of int, optional
        Numbers of the fingertips that touch; by default all. The others keep clear.
    criterion : {"max", "sum"}
        Quality by which poses are refined.
    friction, torsion : float
        Coefficients of all contacts; torsion in m.
    external_wrench : array_like, optional
        (6,) constant load on the object in N and N m, such as its weight, about its centre of mass.
    preload : float
        Least normal force in N of each finger at rest.
    friction_margin : float
        Divides friction where resting forces are chosen.
    pushes : array_like, optional
        (W, 6) wrenches by which plans are ranked; by default 1 N along the six axes.
    rank : {"slip onset", "quality"}
        What decides among plans: what passive fingers hold before one slips, or what the best forces can
        resist.
    seeds : {"palms", "contacts", "both"}
        Whether the search begins with palms around the object, or with good contacts that a preshaped hand
        fits. The latter is for three fingers.
    starts : int
        Largest number of poses that are put onto the surface.
    samples : int
        Random palms, or sets of contacts, from which the starts are chosen.
    refine : bool
        Whether the best poses are improved by random moves.
    simulate : bool
        Whether the best plans are closed and pushed in simulation, as `graspforce.hands.shake` does it. The
        pushes are those of the ranking. The first plan that holds them all comes first, and lost ones come
        last. Where all are lost the search goes on. Only passive fingers are simulated: not with
        ``rank="quality"``.
    best : int
        Largest number of plans to keep.
    target : float
        Multiple of the pushes at which the search ends. A plan that slips earlier makes it go on for a second
        round.
    retreat : float
        Way in m by which the fingers of the pregrasp are backed off.
    time_limit : float, optional
        Seconds after which the search ends with what it has.
    seed : int
        The same seed gives the same plans.
    progress : bool or callable
        True shows a progress bar (needs rich). A function is called as ``progress(done, total, onset)``.

    Returns
    -------
    HandPlanSet
        Best first. Ctrl-C returns what was found.

    Raises
    ------
    NoGraspError
        No pose is a grasp, or the object is wider than the hand opens. The message counts the reasons.
    InvalidInputError
        An argument is out of its range, or the mesh is not closed.
    MissingExtraError
        A package of the extra ``hands`` is not installed.

    Examples
    --------
    >>> import graspforce as gf
    >>> import trimesh
    >>> hand = gf.hands.preset("allegro-right")
    >>> found = gf.plan_hand(hand, trimesh.creation.box((0.06, 0.06, 0.06)), starts=20, best=1)
    >>> found.best.quality.closure, found.best.contact_error < 5e-4
    ('force', True)
    """
    began, deadline = time.monotonic(), deadline_after(time_limit)
    if isinstance(hand, str | os.PathLike):
        raise InvalidInputError(f"hand: {str(hand)!r} is a name; give hands.preset(name) or Hand.load(path)")
    instance_of("hand", hand, Hand)
    chosen("rank", rank, ("slip onset", "quality"))
    chosen("seeds", seeds, ("palms", "contacts", "both"))
    starts = whole_number("starts", starts, least=1, most=100_000)
    samples = max(whole_number("samples", samples, least=1, most=200_000), starts)
    best, seed = whole_number("best", best, least=1), whole_number("seed", seed, least=0)
    retreat = real_number("retreat", retreat, positive=True)
    target = real_number("target", target, least=0, finite=False)
    chosen_fingers = _fingers(hand, fingers)
    problem = GraspProblem.of(
        grasped_object(mesh), friction=friction, torsion=torsion, criterion=criterion,
        external_wrench=external_wrench, preload=preload, friction_margin=friction_margin,
    )  # fmt: skip
    along = push_rows(pushes)
    kinematics = HandKinematics(hand, problem.grasped, chosen_fingers)
    distances = Distances(kinematics)
    _refuse_wide(kinematics, problem)
    maker = Maker(distances, problem, along, retreat)
    search = Search(distances, problem, seed, deadline)
    tried = simulate and rank == "slip onset"
    finish = Finish(maker, search, problem.grasped, along)
    plans: list[HandPlan] = []

    def ranking(plan: HandPlan) -> float:
        return -plan.quality.epsilon if rank == "quality" else -_worth(plan)

    with reporting(progress, "planning", "slip onset") as report:
        try:
            for attempt, (pad, steps) in enumerate(_ROUNDS):
                poses = search.starts(seeds, samples * (1 + attempt), starts, 1.0 if attempt == 0 else 2.0)
                found = search.usable(poses, pad, steps, refine=refine)
                order = () if found is None else np.argsort(-found.score, kind="stable")[:_POOL]
                for row in order:
                    plan = None if found is None else maker.plan(found, int(row), hand, search.counts)
                    plans += [] if plan is None else [plan]
                    if plans and search.ended:
                        break
                if report is not None:
                    report(attempt + 1, len(_ROUNDS), max((p.onset for p in plans), default=np.nan))
                # Passive fingers with little reserve are worth a second look.
                enough = max((_worth(p) for p in plans), default=-np.inf) >= target or attempt > 0
                plans.sort(key=ranking)
                if search.ended or (plans and enough and not tried):
                    break
                if plans and enough and (finish.some_hold(plans) or attempt >= _LAST_TRIED):
                    break
        except KeyboardInterrupt:
            if not plans:
                raise
            search.interrupted = True
    if not plans:
        raise NoGraspError(search.why())
    stopped: SearchEnd = "interrupted" if search.interrupted else "time" if search.expired else "done"
    # An interrupt within a round leaves its plans at the end.
    plans.sort(key=ranking)
    kept = finish.finished(plans, best)[:best]
    return HandPlanSet(tuple(kept), dict(search.counts), stopped, time.monotonic() - began)


def _fingers(hand: Hand, given: Sequence[int] | None) -> tuple[int, ...]:
    if given is None:
        return tuple(range(hand.num_fingers))
    numbers = finger_numbers(hand, given)
    if len(numbers) < 2 or len(set(numbers)) < len(numbers):
        raise InvalidInputError(f"fingers: {list(numbers)}, expected two or more different fingertips")
    return numbers


def _worth(plan: HandPlan) -> float:
    """Slip onset of a plan; fingers that press harder than needed are scaled down to a limit first."""
    largest = float(plan.resting_forces[:, 0].max())
    return plan.onset / max(1.0, largest / max(_HARD * plan.preload, 1e-9))


def _refuse_wide(kinematics: HandKinematics, problem: GraspProblem) -> None:
    """Refuse an object that does not fit between the tips of the open hand."""
    hand = kinematics.hand
    low, high = hand.driven_limits.T
    shares = np.random.default_rng(0).random((500, len(low)))
    tips = kinematics.shapes(low + shares * (high - low))
    opening = float(np.linalg.norm(tips[:, :, None] - tips[:, None], axis=3).max()) - 2 * float(
        kinematics.radii.min()
    )
    width = problem.grasped.width
    if width > _ROOM * opening:
        raise NoGraspError(
            f"mesh: the object is {width * 1e3:.0f} mm wide where it is narrowest, and the tips of "
            f"{hand.name!r} open {opening * 1e3:.0f} mm; check the unit of the mesh"
        )
