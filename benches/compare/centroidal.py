"""Static equilibrium by hpp-centroidal-dynamics: whether contacts without limits hold a body."""

from __future__ import annotations

import ctypes
import importlib.util
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .timing import Call, UnsolvedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from .problems import Contacts

# What its wheel links to, in the order of need: the wheel does not say where they are.
LIBRARIES = (
    "libcdd.so.0",
    "libCoinUtils.so.3",
    "libClp.so.1",
    "libqpOASES.so.3.2",
    "libhpp-centroidal-dynamics.so",
)
NAME = "hpp-centroidal-dynamics"
GENERATORS = 8


def loaded() -> Any:
    found = importlib.util.find_spec("cmeel")
    if found is None or found.origin is None:
        raise ImportError("cmeel")
    folder = Path(found.origin).parents[1] / "cmeel.prefix" / "lib"
    for name in LIBRARIES:
        ctypes.CDLL(str(folder / name), mode=ctypes.RTLD_GLOBAL)
    import eigenpy  # noqa: F401, PLC0415
    import hpp_centroidal_dynamics  # noqa: PLC0415

    return hpp_centroidal_dynamics


def places(contacts: Contacts) -> tuple[np.ndarray, np.ndarray, float]:
    """Contacts upside down: its bodies hang from gravity along -z, ours carry a force along +z."""
    turn = np.diag([1.0, 1.0, -1.0])
    grasp = contacts.grasp
    return grasp.positions @ turn, grasp.normals @ turn, float(grasp.friction[0])


def equilibrium(algorithm: str) -> Callable[[tuple[np.ndarray, np.ndarray, float]], bool]:
    hpp = loaded()
    body = hpp.Equilibrium("body", 1.0, GENERATORS)
    kind = getattr(hpp.EquilibriumAlgorithm, f"EQUILIBRIUM_ALGORITHM_{algorithm}")
    center = np.zeros(3)
    status = hpp.LP_status
    # Contacts that can press against each other are robust without limit. Its dual program does not tell that
    # from a body that falls.
    primal = algorithm == "LP"

    def held(prepared: tuple[np.ndarray, np.ndarray, float]) -> bool:
        positions, normals, friction = prepared
        body.setNewContacts(positions, normals, friction, kind)
        found, robustness = body.computeEquilibriumRobustness(center)
        if found == status.LP_STATUS_OPTIMAL:
            return bool(robustness >= 0)
        if found == status.LP_STATUS_INFEASIBLE:
            return False
        if found == status.LP_STATUS_UNBOUNDED and primal:
            return True
        raise UnsolvedError

    return held


def held_calls() -> list[Call]:
    # Its frames turn the pyramids about the normals: near the boundary the answers may differ.
    return [
        Call(f"{NAME}, {algorithm}", NAME, partial(equilibrium, algorithm), np.inf, places, apart=True)
        for algorithm in ("LP", "DLP")
    ]


def feet(contacts: Contacts) -> tuple[np.ndarray, np.ndarray, float]:
    """Contacts as they stand."""
    grasp = contacts.grasp
    return grasp.positions, grasp.normals, float(grasp.friction[0])


def asked(measure: Callable[[Any], Any]) -> Callable[[tuple[np.ndarray, np.ndarray, float]], float]:
    """Put feet under a body of 1 kg, and ask for a status and a number."""
    hpp = loaded()
    body = hpp.Equilibrium("body", 1.0, GENERATORS)

    def answer(prepared: tuple[np.ndarray, np.ndarray, float]) -> float:
        body.setNewContacts(*prepared, hpp.EquilibriumAlgorithm.EQUILIBRIUM_ALGORITHM_LP)
        found, number = measure(body)
        if found != hpp.LP_status.LP_STATUS_OPTIMAL:
            raise UnsolvedError
        return float(np.ravel(number)[0])

    return answer


def robustness(center: np.ndarray, body: Any) -> tuple[Any, Any]:
    found: tuple[Any, Any] = body.computeEquilibriumRobustness(center)
    return found


def robustness_calls(center: np.ndarray) -> list[Call]:
    make = partial(asked, partial(robustness, center))
    return [Call(f"{NAME}, LP", NAME, make, np.inf, feet, apart=True)]
