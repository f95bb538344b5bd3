"""How surrogates rank random and planned grasps, beside epsilon by both criteria."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from scipy.stats import spearmanr

import graspforce as gf

mpl.use("Agg")
import matplotlib.pyplot as plt

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["draw", "evaluate", "random_grasps", "rows", "table"]

OPTIONS = {"friction": 0.7, "length_scale": 0.05}
# Name, function, and whether larger is better.
SURROGATES = {
    "minimum weight": (gf.surrogates.min_weight, 1.0),
    "differentiable force closure": (gf.surrogates.differentiable_force_closure, -1.0),
    "span residual": (gf.surrogates.span_residual, -1.0),
}


def random_grasps(rng: np.random.Generator, count: int, contacts: int) -> tuple[Array, Array]:
    """Return directions (B, m, 3) and semi-axes (B, 1, 3) of contacts on ellipsoids of 3 to 6 cm."""
    outward = rng.normal(size=(count, contacts, 3))
    return outward / np.linalg.norm(outward, axis=-1, keepdims=True), rng.uniform(0.03, 0.06, (count, 1, 3))


def planned(outward: Array, axes: Array, criterion: str, steps: int = 40) -> Array:
    """Return directions after steps along the gradient of epsilon; each grasp keeps its best."""
    best, kept = np.full(len(outward), -np.inf), outward
    for step in range(steps):
        quality = gf.quality_many(
            outward * axes, -outward / axes, criterion=criterion, gradient=True, **OPTIONS
        )
        better = quality.epsilon > best
        best, kept = np.where(better, quality.epsilon, best), np.where(better[:, None, None], outward, kept)
        gradient = quality.gradient
        # By the direction u: the position is axes u, the normal -u / axes, turned without its length.
        length = np.linalg.norm(outward / axes, axis=-1, keepdims=True)
        change = gradient.positions * axes - gradient.normals / axes / length
        change -= outward * (change * outward).sum(-1, keepdims=True)
        size = np.linalg.norm(change, axis=(1, 2), keepdims=True)
        outward = outward + 0.3 * 0.9**step * change / np.maximum(size, 1e-12)
        outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    return kept


def evaluate(outward: Array, axes: Array) -> dict[str, Array]:
    """Return epsilon by both criteria, and every surrogate, of each grasp."""
    contacts = (outward * axes, -outward / axes)
    values = {
        f"epsilon ({criterion})": gf.quality_many(*contacts, criterion=criterion, **OPTIONS).epsilon
        for criterion in ("max", "sum")
    }
    for name, (surrogate, _) in SURROGATES.items():
        values[name] = surrogate(*contacts, **OPTIONS).values
    return values


def rows(count: int = 2000, seed: int = 5) -> dict[str, dict[str, Array]]:
    """Return values of random grasps, and of as many planned ones, half of them by each criterion."""
    rng = np.random.default_rng(seed)
    random = random_grasps(rng, count, 4)
    outward, axes = random_grasps(rng, count, 4)
    half = count // 2
    parts = [
        planned(outward[part], axes[part], criterion)
        for part, criterion in ((slice(half), "max"), (slice(half, None), "sum"))
    ]
    return {"random": evaluate(*random), "planned": evaluate(np.concatenate(parts), axes)}


def correlations(values: dict[str, Array], name: str, chosen: NDArray[np.bool_]) -> Iterator[float]:
    """Yield Spearman's coefficient of a surrogate with epsilon by each criterion, 0 where it is constant."""
    surrogate = SURROGATES[name][1] * values[name][chosen]
    for criterion in ("max", "sum"):
        epsilon = values[f"epsilon ({criterion})"][chosen]
        yield spearmanr(surrogate, epsilon).statistic if np.ptp(surrogate) > 0 else 0.0


def table(found: dict[str, dict[str, Array]]) -> str:
    """Return the table of rank correlations."""
    lines = [
        "| grasps | surrogate | epsilon (max): Spearman | epsilon (sum): Spearman | exactly 0 |",
        "|---|---|---|---|---|",
    ]
    for kind, values in found.items():
        closed = values["epsilon (max)"] > 0
        groups = {f"{kind}, {len(closed):,}": np.ones_like(closed)}
        if not closed.all():
            groups[f"{kind}, force closure alone, {closed.sum():,}"] = closed
        for group, chosen in groups.items():
            for name in SURROGATES:
                by_max, by_sum = correlations(values, name, chosen)
                zeros = (values[name][chosen] == 0).mean()
                lines.append(f"| {group} | {name} | {by_max:.2f} | {by_sum:.2f} | {zeros:.0%} |")
    return "\n".join(lines) + "\n"


def draw(found: dict[str, dict[str, Array]], path: Path) -> None:
    """Draw each surrogate against epsilon by each criterion."""
    figure, axes = plt.subplots(2, 3, figsize=(10, 6), layout="constrained", sharey="row", sharex="col")
    for row, criterion in zip(axes, ("max", "sum"), strict=True):
        for ax, name in zip(row, SURROGATES, strict=True):
            for kind, colour in (("random", "#1f5fa8"), ("planned", "#c8742c")):
                values = found[kind]
                ax.plot(
                    values[name],
                    values[f"epsilon ({criterion})"],
                    ".",
                    color=colour,
                    ms=2,
                    alpha=0.5,
                    label=kind,
                )
            ax.grid(color="#e6e6e6", lw=0.6)
            ax.spines[["top", "right"]].set_visible(False)
        row[0].set_ylabel(f"epsilon by the {criterion} (N)")
    for ax, label in zip(
        axes[1], ("minimum weight (larger is better)", "closure residual (N, smaller is better)",
                  "span residual (N, smaller is better)"), strict=True
    ):  # fmt: skip
        ax.set_xlabel(label)
        ax.locator_params(axis="x", nbins=4)
    axes[0, 0].legend(loc="lower right", markerscale=5, frameon=False)
    figure.savefig(path, dpi=110)
