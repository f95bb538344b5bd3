"""Whether contacts hold a weight: HiGHS on the program of the least sum, and Klampt's ``com_equilibrium``."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .closure import friction_planes
from .general import SIMPLEX_AGREEMENT, highs_model
from .table import power
from .timing import Apart, Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .asking import Answers
    from .problems import Contacts

    Planes = tuple[list[list[float]], list[list[float]]]

ORIGIN = (0.0, 0.0, 0.0)


def highs() -> Callable[[Any], float]:
    import highspy  # noqa: PLC0415

    status = highspy.HighsModelStatus

    def least_sum(model: Any) -> float:
        model.run()
        found = model.getModelStatus()
        if found == status.kInfeasible:
            return np.inf
        if found != status.kOptimal:
            raise UnsolvedError
        return float(model.getObjectiveValue())

    return least_sum


def least_sum_calls(external: np.ndarray) -> list[Call]:
    def program(contacts: Contacts) -> Any:
        rows = contacts.union.T
        return highs_model(np.ones(rows.shape[1]), rows, -external, -external)

    return [Call("HiGHS", "highspy", highs, SIMPLEX_AGREEMENT, program)]


def klampt(weight: tuple[float, float, float]) -> Callable[[Planes], Any]:
    from klampt import robotsim  # noqa: PLC0415

    return lambda prepared: robotsim.com_equilibrium(*prepared, weight, ORIGIN)


def held(weight: tuple[float, float, float]) -> Callable[[Planes], bool]:
    forces = klampt(weight)
    return lambda prepared: forces(prepared) is not None


def held_calls(weight: tuple[float, float, float]) -> list[Call]:
    # Apart, as `closure.calls` says: beside other peers it ended a whole run, too.
    name, package = "Klampt com_equilibrium", "klampt"
    return [Call(name, package, partial(held, weight), 0, friction_planes, apart=True)]


def klampt_forces(
    answers: Answers, grasps: Sequence[Contacts], least: np.ndarray, weight: tuple[float, float, float]
) -> str:
    """How Klampt's forces compare with the least: they balance, and nothing else was asked of them."""
    if not any(one.call.package == "klampt" and not one.failure for one in answers.measured):
        return ""
    excess, unbalanced = 1.0, 0.0
    timed = Apart(partial(klampt, weight)).timed([friction_planes(contacts) for contacts in grasps], np.inf)
    for contacts, least_sum, (_, found) in zip(grasps, least, timed, strict=True):
        if found is not None:
            forces = np.array(found)
            moment = np.cross(contacts.positions, forces).sum(axis=0)
            unbalanced = max(unbalanced, np.abs(np.append(forces.sum(axis=0) + weight, moment)).max())
            excess = max(excess, np.sum(contacts.grasp.normals * forces) / least_sum)
    balance = f"Klampt's forces balance to {power(unbalanced)}"
    return f"{balance} and add up to at most {excess:.2f} times the least sum."
