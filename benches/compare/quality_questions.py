"""Ask how good a grasp is, and whether it is force closure at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import certificates, closure, hulls, ours
from .asking import Answers, Question, Run
from .problems import any_grasps, closed_grasps, racket, tetrahedron

if TYPE_CHECKING:
    from collections.abc import Iterator


def questions(run: Run) -> Iterator[Question]:
    yield Question(
        "How good is the grasp when the forces share one limit? (`rho_sum`)",
        "The radius of the largest ball around the origin in the hull of the primitive wrenches. Peers "
        "get the primitive wrenches; computing them is not timed. Drake's polyhedron calls Qhull, too.",
        union(run),
    )
    yield Question(
        "How good is the grasp when each force has its own limit? (`rho_max`)",
        "The radius of the largest ball around the origin in the hull of the Minkowski sum. Peers get its "
        "enumerated points; only the hull is timed.",
        minkowski_sum(run),
    )
    yield Question(
        "Is it force closure?",
        "Grasps of two to five contacts with eight edges. HiGHS and SciPy look for a positive "
        "combination of the primitive wrenches that vanishes. Klampt gets the planes of the same cones. "
        "Converting a grasp into a peer's input is not timed.",
        force_closure(run),
    )


def union(run: Run) -> Iterator[Answers]:
    calls = hulls.calls(lambda contacts: contacts.union)
    number = run.number(200)
    shown = "4 contacts, 8 edges"
    families = [
        ("racket in the plane, 8 wrenches", [racket()] * number),
        ("tetrahedron, 8 edges", [tetrahedron(8)] * number),
        (shown, closed_grasps(7, number, 4, 8)),
        ("4 contacts, 10 edges", closed_grasps(7, number, 4, 10)),
        ("8 contacts, 16 edges", closed_grasps(7, number, 8, 16)),
    ]
    for name, grasps in families:
        own = ours.quality_calls("sum", grasps[0].options)
        yield run.ask(f"`rho_sum`, {name}", [*own, *calls], grasps, headline=name == shown)
    yield without_peer(run, "sum", "4 contacts, true cones to 1e-6", 4, None)


def minkowski_sum(run: Run) -> Iterator[Answers]:
    calls = hulls.calls(lambda contacts: contacts.minkowski_sum)
    number = run.number(200)
    shown = "4 contacts, 8 edges, 6,560 points"
    small = [
        ("racket in the plane, 80 points", [racket()] * number),
        ("3 contacts, 4 edges, 124 points", closed_grasps(7, number, 3, 4)),
        ("4 contacts, 4 edges, 624 points", closed_grasps(7, run.number(20), 4, 4)),
    ]
    large = [
        (shown, closed_grasps(7, 3, 4, 8)),
        ("tetrahedron, 8 edges, 6,560 points", [tetrahedron(8)]),
        ("4 contacts, 10 edges, 14,640 points", closed_grasps(7, 1, 4, 10)),
    ]
    for name, grasps in small + ([] if run.quick else large):
        own = ours.quality_calls("max", grasps[0].options)
        warm_up = len(grasps) == number
        problem = f"`rho_max`, {name}"
        yield run.ask(problem, [*own, *calls], grasps, headline=name == shown, warm_up=warm_up)
    yield without_peer(run, "max", "8 contacts, 16 edges, 6,975,757,440 points", 8, 16)
    yield without_peer(run, "max", "4 contacts, true cones to 1e-6", 4, None)


def without_peer(run: Run, criterion: str, name: str, contacts: int, edges: int | None) -> Answers:
    grasps = closed_grasps(7, run.number(200), contacts, edges)
    calls = ours.quality_calls(criterion, grasps[0].options)
    return run.ask(f"`rho_{criterion}`, {name}", calls, grasps, headline=True)


def force_closure(run: Run) -> Iterator[Answers]:
    grasps = any_grasps(19, run.number(1000), 8)
    calls = [*ours.closure_calls(), *closure.calls()]
    answers = run.ask("force closure of 2 to 5 contacts", calls, grasps, headline=True)
    answers.note = f"{int(answers.reference.sum())} of the {len(grasps)} grasps are."
    answers.refuted = lambda number, said: certificates.closure_is(grasps[number], not said)
    yield answers
