"""Force closure, yes or no: HiGHS, SciPy and Klampt."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .general import TIGHT, highs_model
from .programs import cone_planes, nonnegative_combination, spans
from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from .problems import Contacts


def highs_program(contacts: Contacts) -> tuple[Any, bool]:
    rows, right = nonnegative_combination(contacts.union)
    return highs_model(np.ones(rows.shape[1]), rows, right, right), spans(contacts.union)


def highs() -> Callable[[tuple[Any, bool]], bool]:
    import highspy  # noqa: PLC0415

    status = highspy.HighsModelStatus

    def closed(prepared: tuple[Any, bool]) -> bool:
        model, spanning = prepared
        model.run()
        found = model.getModelStatus()
        if found not in {status.kOptimal, status.kInfeasible, status.kUnboundedOrInfeasible}:
            raise UnsolvedError
        return spanning and found == status.kOptimal

    return closed


def scipy_program(contacts: Contacts) -> tuple[np.ndarray, np.ndarray, bool]:
    return *nonnegative_combination(contacts.union), spans(contacts.union)


def scipy_linprog() -> Callable[[tuple[np.ndarray, np.ndarray, bool]], bool]:
    from scipy.optimize import linprog  # noqa: PLC0415

    def closed(prepared: tuple[np.ndarray, np.ndarray, bool]) -> bool:
        rows, right, spanning = prepared
        found = linprog(np.ones(rows.shape[1]), A_eq=rows, b_eq=right, options=TIGHT)
        if found.status not in {0, 2}:
            raise UnsolvedError
        return spanning and found.status == 0

    return closed


def friction_planes(contacts: Contacts) -> tuple[list[list[float]], list[list[float]]]:
    """Positions, and of each contact the planes ``(a, b)`` of its cone, ``a . f <= b``, in one list."""
    grasp = contacts.grasp
    planes = []
    for frame, inside in zip(grasp.frames, cone_planes(grasp), strict=True):
        outward = inside @ frame
        planes.append(np.column_stack([outward, np.zeros(len(outward))]).ravel().tolist())
    return grasp.positions.tolist(), planes


def klampt() -> Callable[[tuple[list[list[float]], list[list[float]]]], bool]:
    from klampt import robotsim  # noqa: PLC0415

    return lambda prepared: robotsim.force_closure(*prepared)


def calls() -> list[Call]:
    return [
        Call("HiGHS", "highspy", highs, 0, highs_program),
        Call("SciPy linprog (HiGHS)", "scipy", scipy_linprog, 0, scipy_program),
        # It reads past a row of its sparse matrix, as a memory checker shows; a whole run ended there.
        Call("Klampt force_closure", "klampt", klampt, 0, friction_planes, apart=True),
    ]
