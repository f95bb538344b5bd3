"""What a quality, a surrogate and the same surrogate by qpth cost, each with its gradient."""

from __future__ import annotations

import time
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

import graspforce as gf

from .ranking import OPTIONS, random_grasps

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["peer", "table"]

LIMIT = 20.0


def closed_grasps(rng: np.random.Generator, count: int, contacts: int) -> tuple[Array, Array]:
    """Return positions and normals of force-closure grasps."""
    outward, axes = random_grasps(rng, 4 * count if contacts > 4 else 20 * count, contacts)
    positions, normals = outward * axes, -outward / axes
    closed = gf.quality_many(positions, normals, criterion="sum", **OPTIONS).closure == 1
    return positions[closed][:count], normals[closed][:count]


def calls(positions: Array, normals: Array, edges: int) -> dict[str, Callable[[], object]]:
    """Return what is timed."""
    options = {"edges": edges, **OPTIONS}

    def quality(criterion: str) -> object:
        return gf.quality_many(positions, normals, criterion=criterion, gradient=True, **options)

    return {
        "epsilon (sum)": lambda: quality("sum"),
        "epsilon (max)": lambda: quality("max"),
        "minimum weight": lambda: gf.surrogates.min_weight(positions, normals, **options),
        "differentiable force closure": lambda: gf.surrogates.differentiable_force_closure(
            positions, normals, **options
        ),
        "span residual": lambda: gf.surrogates.span_residual(positions, normals, limit=LIMIT, **options),
    }


def least_times(timed: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the least time of each call in s; the calls take turns of at least 0.1 s."""
    least = dict.fromkeys(timed, np.inf)
    for _ in range(repeats):
        for name, call in timed.items():
            end = time.perf_counter() + 0.1
            while (start := time.perf_counter()) < end:
                call()
                least[name] = min(least[name], time.perf_counter() - start)
    return least


def table(seed: int = 6) -> str:
    """Return what each number costs with its gradient."""
    rng = np.random.default_rng(seed)
    few, many = closed_grasps(rng, 1000, 4), closed_grasps(rng, 32, 12)
    times = [
        {name: 1e6 * time / len(grasps[0]) for name, time in least_times(calls(*grasps, edges), 7).items()}
        for grasps, edges in ((few, 8), (many, 4))
    ]
    lines = [
        "| us a grasp, with gradient | 1,000 of 4 contacts, 8 edges | 32 of 12 contacts, 4 edges |",
        "|---|---|---|",
    ]
    lines += [f"| {name} | {times[0][name]:.1f} | {times[1][name]:.1f} |" for name in times[0]]
    return "\n".join(lines) + "\n"


def peer(seed: int = 6) -> str | None:
    """Return the time of the span residual by qpth beside ours, or None where qpth is not installed."""
    if find_spec("qpth") is None:
        return None
    import torch  # noqa: PLC0415 - only in an environment that has it
    from qpth.qp import QPFunction  # noqa: PLC0415

    rng = np.random.default_rng(seed)
    positions, normals = closed_grasps(rng, 32, 12)
    scale = np.repeat([1.0, 1.0 / OPTIONS["length_scale"]], 3)
    # The peer gets the primitive wrenches; computing and differentiating them is not timed.
    wrenches = np.array(
        [
            gf.Grasp(p, n, edges=4, **OPTIONS).primitive_wrenches * scale
            for p, n in zip(positions, normals, strict=True)
        ]
    ).transpose(0, 2, 1)
    count = wrenches.shape[2]
    identity = torch.eye(count, dtype=torch.float64)
    bounds = torch.cat([identity, -identity])
    limits = torch.cat([LIMIT * torch.ones(count), -torch.ones(count)]).double()
    none = torch.empty(0, dtype=torch.float64)
    solver = QPFunction(verbose=-1)
    values = np.zeros(len(positions))
    forward = [np.inf]

    def by_qpth() -> None:
        start = time.perf_counter()
        columns = torch.tensor(wrenches, requires_grad=True)
        # qpth needs a positive definite matrix.
        squares = columns.transpose(1, 2) @ columns + 1e-6 * identity
        x = solver(squares, torch.zeros(count, dtype=torch.float64), bounds, limits, none, none)
        norm = (columns @ x.unsqueeze(-1)).squeeze(-1).norm(dim=-1)
        forward[0] = min(forward[0], time.perf_counter() - start)
        norm.sum().backward()
        values[:] = norm.detach().numpy()

    timed = calls(positions, normals, 4)
    timed = {name: timed[name] for name in ("epsilon (sum)", "epsilon (max)", "span residual")}
    least = least_times({**timed, "span residual by qpth": by_qpth}, 7)
    ours = gf.surrogates.span_residual(positions, normals, limit=LIMIT, edges=4, **OPTIONS).values
    slow = least["span residual by qpth"]
    lines = ["| number with gradient | us a grasp | qpth's time / this time |", "|---|---|---|"]
    lines += [f"| {name} | {1e6 * t / 32:,.1f} | {slow / t:,.0f} |" for name, t in least.items()]
    share = forward[0] / slow
    difference = np.abs(values - ours).max()
    return (
        "\n".join(lines)
        + f"\n\nThe forward part is {share:.0%} of qpth's time. Its residuals differ from ours by at most "
        f"{difference:.1g} N;\nours are {ours.min():.3g} to {ours.max():.3g} N.\n"
    )
