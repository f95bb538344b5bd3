"""The span residual by differentiable solvers of quadratic programs, beside ours and the exact quality.

Each peer gets the primitive wrenches W of a batch; computing and differentiating them is not timed. It
minimises |W x|^2 / 2 over 1 <= x <= limit, and |W x| is differentiated by W.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

import graspforce as gf

from .costs import LIMIT, calls, closed_grasps, least_times
from .ranking import OPTIONS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["table"]

RIDGE = 1e-6
"""What is added to the diagonal: qpth needs a positive definite matrix."""


def by_qpth(count: int) -> Callable[[Any], Any]:
    """Return the solver of a batch of wrenches (B, 6, n) by qpth: its own batched interior point method."""
    import torch  # noqa: PLC0415 - only in an environment that has it
    from qpth.qp import QPFunction  # noqa: PLC0415

    identity = torch.eye(count, dtype=torch.float64)
    bounds = torch.cat([identity, -identity])
    limits = torch.cat([LIMIT * torch.ones(count), -torch.ones(count)]).double()
    none, zero = torch.empty(0, dtype=torch.float64), torch.zeros(count, dtype=torch.float64)
    solver = QPFunction(verbose=-1)
    return lambda columns: solver(
        columns.transpose(1, 2) @ columns + RIDGE * identity, zero, bounds, limits, none, none
    )


def by_proxsuite(count: int) -> Callable[[Any], Any]:
    """Return the same by ProxQP's layer, which solves the programs of a batch on all cores."""
    import torch  # noqa: PLC0415
    from proxsuite.torch.qplayer import QPFunction  # noqa: PLC0415

    identity = torch.eye(count, dtype=torch.float64)
    ones, none = torch.ones(count, dtype=torch.float64), torch.empty(0, dtype=torch.float64)

    def solve(columns: Any) -> Any:
        batch = len(columns)
        each = [part.expand(batch, *part.shape) for part in (0 * ones, identity, ones, LIMIT * ones)]
        squares = columns.transpose(1, 2) @ columns + RIDGE * identity
        return QPFunction(structural_feasibility=True)(squares, each[0], none, none, *each[1:])[0]

    return solve


def by_cvxpylayers(count: int) -> Callable[[Any], Any]:
    """Return the same by a CVXPY problem as a layer, at its default accuracy."""
    import cvxpy as cp  # noqa: PLC0415
    from cvxpylayers.torch import CvxpyLayer  # noqa: PLC0415

    x, columns = cp.Variable(count), cp.Parameter((6, count))
    problem = cp.Problem(cp.Minimize(cp.sum_squares(columns @ x)), [x >= 1, x <= LIMIT])
    layer = CvxpyLayer(problem, parameters=[columns], variables=[x])
    return lambda given: layer(given)[0]


PEERS = {"qpth": by_qpth, "proxsuite": by_proxsuite, "cvxpylayers": by_cvxpylayers}


def wrenches_of(positions: Array, normals: Array) -> Array:
    """Return primitive wrenches (B, 6, n) in the norm of the length scale."""
    scale = np.repeat([1.0, 1.0 / OPTIONS["length_scale"]], 3)
    grasps = (gf.Grasp(p, n, edges=4, **OPTIONS) for p, n in zip(positions, normals, strict=True))
    return np.array([grasp.primitive_wrenches * scale for grasp in grasps]).transpose(0, 2, 1)


def differentiated(solve: Callable[[Any], Any], wrenches: Array, found: dict[str, Any]) -> Callable[[], None]:
    """Return a call that solves forward and backward and keeps the values."""
    import torch  # noqa: PLC0415

    def call() -> None:
        columns = torch.tensor(wrenches, requires_grad=True)
        norm = (columns @ solve(columns).unsqueeze(-1)).squeeze(-1).norm(dim=-1)
        norm.sum().backward()
        found["values"] = norm.detach().numpy()

    return call


def table(seed: int = 6, batch: int = 32, repeats: int = 5) -> str | None:
    """Return times a grasp on the clock and of the processor, or None where no peer is installed."""
    installed = {name: make for name, make in PEERS.items() if find_spec(name) is not None}
    if not installed:
        return None
    import torch  # noqa: PLC0415

    positions, normals = closed_grasps(np.random.default_rng(seed), batch, 12)
    wrenches = wrenches_of(positions, normals)
    ours = gf.surrogates.span_residual(positions, normals, limit=LIMIT, edges=4, **OPTIONS).values
    timed = calls(positions, normals, 4)
    timed = {name: timed[name] for name in ("epsilon (sum)", "epsilon (max)", "span residual")}
    found: dict[str, dict[str, Any]] = {name: {} for name in installed}
    solvers = {name: make(wrenches.shape[2]) for name, make in installed.items()}
    peers = {name: differentiated(solvers[name], wrenches, found[name]) for name in installed}
    least = least_times({**timed, **peers}, repeats)
    exact = least["epsilon (sum)"]
    lines = [
        "| forward and backward | us a grasp | ratio | us of the processor | ratio | off by, N |",
        "|---|---|---|---|---|---|",
    ]
    for name, times in least.items():
        label = f"span residual by {name}" if name in peers else name
        off = f"{np.abs(found[name]['values'] - ours).max():.1g}" if name in peers else ""
        parts = [
            f"{1e6 * time / len(positions):,.1f} | {time / base:,.1f}"
            for time, base in zip(times, exact, strict=True)
        ]
        lines.append(f"| {label} | {parts[0]} | {parts[1]} | {off} |")
    lines.append("")
    if "qpth" in installed:
        threads = torch.get_num_threads()
        for workers in sorted({1, threads}):
            torch.set_num_threads(workers)
            for size in (1, len(positions)):
                one = differentiated(solvers["qpth"], wrenches[:size], {})
                wall, busy = least_times({"qpth": one}, repeats, 10.0)["qpth"]
                lines.append(
                    f"qpth, {workers} thread(s), batches of {size}: {1e3 * wall / size:.2f} ms a grasp, "
                    f"{1e3 * busy / size:.2f} ms of processor time."
                )
        torch.set_num_threads(threads)
    return "\n".join(lines) + "\n"
