"""Ask where a body may stand: the support polygon, and how robust a stance is."""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING

import numpy as np

import graspforce as gf

from . import centroidal
from .asking import Answers, Question, Run
from .problems import Contacts, random_numbers
from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Array = np.ndarray

WEIGHT = 9.80665
GAP = 1e-6
EDGES = 8


def questions(run: Run) -> Iterator[Question]:
    yield Question(
        "Where may the centre of mass be?",
        f"Four feet on uneven ground, friction 0.6, {EDGES} edges, no limits: the support polygon to an "
        f"area gap of {GAP:g}, answered by its area. HiGHS gets one linear program a direction, by the same "
        "method of Bretl and Lall. The robustness of hpp-centroidal-dynamics is the largest force that all "
        "generators of its pyramids can exert at once. This library's is the margin of the polygon.",
        standing(run),
    )


def stances(number: int) -> list[Contacts]:
    """Four feet with heights within 5 cm and normals within some 20 degrees."""
    numbers = random_numbers(29)
    corners = np.array([(0.2, 0.1, 0.0), (-0.2, 0.1, 0.0), (-0.2, -0.1, 0.0), (0.2, -0.1, 0.0)])
    found = []
    for _ in range(number):
        draws = np.array([2 * next(numbers) - 1 for _ in range(24)]).reshape(2, 4, 3)
        found.append(
            Contacts(corners + 0.05 * draws[0], [0, 0, 1] + 0.3 * draws[1], {"friction": 0.6, "edges": EDGES})
        )
    return found


def standing(run: Run) -> Iterator[Answers]:
    feet = stances(run.number(200))

    def region(contacts: Contacts) -> gf.SupportRegion:
        return gf.support_region(contacts.grasp, WEIGHT, limits=False, gap=GAP)

    own = Call("support_region", "graspforce", lambda: lambda c: region(c).inner_area, GAP, reference=True)
    calls = [own, Call("HiGHS, cold, the polygon", "scipy", lambda: polygon_area, 2 * GAP)]
    yield run.ask("support polygon of four feet", calls, feet, headline=True)
    start = np.zeros(3)
    margin = Call(
        "support_region, margin", "graspforce", lambda: lambda c: region(c).margin(start[:2]), 1e-6,
        reference=True,
    )  # fmt: skip
    answers = run.ask("robustness of a stance", [margin, *centroidal.robustness_calls(start)], feet)
    answers.note = "The answers are other measures: a distance in m, and a force in N."
    yield answers


def polygon_area(contacts: Contacts) -> float:
    """Grow the polygon by linear programs, across the edge with the largest area beyond it."""
    furthest = _program(contacts)
    directions = [np.array(d, float) for d in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    places = [furthest(d) for d in directions]
    waiting: list[tuple[float, int, tuple[Array, ...]]] = []
    between, inside, number = 0.0, _area(places), 0

    def push(a: Array, p: Array, b: Array, q: Array) -> float:
        nonlocal number
        corner = np.linalg.lstsq(np.array([a, b]), np.array([a @ p, b @ q]), rcond=None)[0]
        area = 0.5 * abs(_turn(p, corner, q))
        number += 1
        heapq.heappush(waiting, (-area, number, (a, p, b, q)))
        return area

    for at in range(4):
        between += push(directions[at], places[at], directions[(at + 1) % 4], places[(at + 1) % 4])
    while between > GAP * (inside + between):
        area, _, (a, p, b, q) = heapq.heappop(waiting)
        between += area
        edge = q - p
        across = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
        place = furthest(across)
        if across @ (place - p) < 1e-9:
            continue
        inside += 0.5 * abs(_turn(p, place, q))
        between += push(a, p, across, place) + push(across, place, b, q)
    return inside


def _program(contacts: Contacts) -> Callable[[Array], Array]:
    from scipy.optimize import linprog  # noqa: PLC0415

    grasp = contacts.grasp
    wrenches = np.asarray(contacts.union).T
    moving = np.zeros((6, 2))
    moving[3, 1], moving[4, 0] = -WEIGHT, WEIGHT
    balance = np.hstack([wrenches, moving])
    right = np.array([0, 0, WEIGHT, 0, 0, 0])
    count = len(grasp.extreme_forces)
    bounds = [(0, None)] * count + [(None, None)] * 2

    def furthest(direction: Array) -> Array:
        costs = np.r_[np.zeros(count), -direction]
        found = linprog(costs, A_eq=balance, b_eq=right, bounds=bounds, method="highs-ds")
        if found.status != 0:
            raise UnsolvedError
        return found.x[-2:]

    return furthest


def _turn(a: Array, b: Array, c: Array) -> float:
    (x, y), (u, v) = b - a, c - a
    return float(x * v - y * u)


def _area(places: list[Array]) -> float:
    return 0.5 * sum(_turn(places[0], one, other) for one, other in itertools.pairwise(places))
