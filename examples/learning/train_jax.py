"""Train a network in JAX that places four contacts on an ellipsoid. The loss is minus the quality.

Prints the quality for each of five ellipsoids that the network has not seen, beside that of a search. Draws
the curve of the training. Usage: python train_jax.py [--steps 300] [--plot training.png]
"""

import argparse
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

import graspforce as gf
import graspforce.jax

GRASP = {"friction": 0.7, "length_scale": 0.05}
SMALLEST, LARGEST = 0.03, 0.06  # semi-axes, m
BATCH = 64
RATE = 3e-3


def new_network(
    key: jax.Array, sizes: tuple[int, ...] = (3, 64, 64, 12)
) -> list[tuple[jax.Array, jax.Array]]:
    """Return random layers."""
    keys = jax.random.split(key, 2 * len(sizes))
    return [
        (jax.random.normal(keys[2 * i], (n, m)) / jnp.sqrt(n), 0.5 * jax.random.normal(keys[2 * i + 1], (m,)))
        for i, (n, m) in enumerate(pairwise(sizes))
    ]


def contacts(network: list[tuple[jax.Array, jax.Array]], axes: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return positions and inward normals (B, 4, 3) on ellipsoids of semi-axes (B, 3)."""
    x = (axes - SMALLEST) / (LARGEST - SMALLEST) - 0.5
    for i, (matrix, offset) in enumerate(network):
        x = (jnp.tanh(x) if i else x) @ matrix + offset
    outward = x.reshape(-1, 4, 3)
    outward /= jnp.linalg.norm(outward, axis=-1, keepdims=True)
    return outward * axes[:, None], -outward / axes[:, None]


def loss(network: list[tuple[jax.Array, jax.Array]], axes: jax.Array) -> jax.Array:
    """Return minus the mean quality."""
    return -graspforce.jax.quality(*contacts(network, axes), criterion="sum", **GRASP).mean()


@jax.jit
def step(state: Any, axes: jax.Array, rate: jax.Array) -> tuple[Any, jax.Array]:
    """Take one step of Adam."""
    network, first, second, count = state
    value, gradient = jax.value_and_grad(loss)(network, axes)
    count += 1
    first = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, first, gradient)
    second = jax.tree.map(lambda v, g: 0.999 * v + 0.001 * g * g, second, gradient)

    def moved(x: jax.Array, m: jax.Array, v: jax.Array) -> jax.Array:
        return x - rate * (m / (1 - 0.9**count)) / (jnp.sqrt(v / (1 - 0.999**count)) + 1e-8)

    return (jax.tree.map(moved, network, first, second), first, second, count), value


def train(steps: int, seed: int = 0) -> tuple[list[tuple[jax.Array, jax.Array]], NDArray[np.float64]]:
    """Return the network and the mean quality at each step."""
    key, start = jax.random.split(jax.random.key(seed))
    network = new_network(start)
    zeros = jax.tree.map(jnp.zeros_like, network)
    state, curve = (network, zeros, zeros, 0), []
    for i in range(steps):
        key, now = jax.random.split(key)
        axes = jax.random.uniform(now, (BATCH, 3), minval=SMALLEST, maxval=LARGEST)
        # The rate falls to zero: the best grasps are at kinks of the quality.
        state, value = step(state, axes, RATE * 0.5 * (1 + np.cos(np.pi * i / steps)))
        curve.append(-float(value))
    return state[0], np.array(curve)


def ellipsoid(axes: NDArray[np.float64]) -> Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], ...]]:
    """Return a surface for the search: two angles for each contact."""

    def surface(params: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        polar, turn = params[:, 0::2], params[:, 1::2]
        outward = np.stack(
            [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1
        )
        return outward * axes, -outward / axes

    return surface


def searched(axes: NDArray[np.float64], starts: int) -> float:
    """Return the best quality that a search finds."""
    bounds = [(0.05, np.pi - 0.05), (-np.pi, np.pi)] * 4
    plans = gf.plan_multistart(
        ellipsoid(axes), bounds, step=[0.4] * 8, tolerance=[0.01] * 8, criterion="sum",
        starts=starts, max_candidates=6561, **GRASP,
    )  # fmt: skip
    return plans.best.quality.epsilon


def draw(curve: NDArray[np.float64], rows: list[tuple[str, float, float]], path: Path) -> None:
    """Draw the curve of the training, and the network's grasps beside those of the search."""
    import matplotlib as mpl  # noqa: PLC0415 - only where a picture is asked for

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    left.plot(curve)
    left.axhline(0, color="0.7", linewidth=1)
    left.set(xlabel="training step", ylabel="mean epsilon of a batch (N)", title="Training")
    place = np.arange(len(rows))
    right.bar(place - 0.2, [row[1] for row in rows], 0.4, label="network")
    right.bar(place + 0.2, [row[2] for row in rows], 0.4, label="plan_multistart")
    right.set_xticks(place, [row[0] for row in rows])
    right.set(xlabel="semi-axes (mm)", ylabel="epsilon (N)", title="Ellipsoids not seen in training")
    right.set_ylim(0, 1.25 * max(max(row[1:]) for row in rows))
    right.legend(loc="upper center", ncols=2, frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Train, compare, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--starts", type=int, default=2, help="searches for each ellipsoid")
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    network, curve = train(options.steps)
    every = max(1, options.steps // 5)
    for i in range(0, options.steps, every):
        print(f"step {i:4}: mean epsilon {curve[i : i + 10].mean():7.4f} N")
    tests = np.random.default_rng(7).uniform(SMALLEST, LARGEST, (5, 3)).round(3)
    found = gf.quality_many(*map(np.asarray, contacts(network, jnp.asarray(tests))), criterion="sum", **GRASP)
    rows = []
    print("semi-axes (mm)  network (N)  plan_multistart (N)")
    for axes, epsilon in zip(tests, found.epsilon, strict=True):
        name = " ".join(f"{1e3 * axis:.0f}" for axis in axes)
        rows.append((name, float(epsilon), searched(axes, options.starts)))
        print(f"{name:14}  {epsilon:11.4f}  {rows[-1][2]:19.4f}")
    if options.plot:
        draw(curve, rows, options.plot)


if __name__ == "__main__":
    main()
