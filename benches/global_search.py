"""How far the pattern search lands from the best there is: ``python benches/global_search.py``.

Branch and bound over the parameters of the paper's two examples: the racket to 0.1%, the tile to 1%.
"""

from __future__ import annotations

import numpy as np

import graspforce as gf
from graspforce.paper import RACKET, TILE
from graspforce.paper.tile import INFERRED_FRICTION


def compare(name, problem, criterion, **options):
    found = gf.plan(
        problem.surface,
        problem.initial,
        problem.step,
        problem.tolerance,
        problem.bounds,
        criterion,
        **options,
    )
    stop = {"gap": 1e-2} if "tile" in name else {"gap": 1e-3}
    best = gf.plan_global(problem.surface, problem.bounds, criterion, initial=found.params, **stop, **options)
    below = 100 * (1 - found.quality.epsilon / best.epsilon_upper)
    numbers = f"{found.quality.epsilon:.4f} | {best.quality.epsilon:.4f} | {best.epsilon_upper:.4f}"
    print(f"| {name}, {criterion} | {numbers} | {below:.1f}% | {best.seconds:.1f} s |")


def main():
    print("| problem | pattern search | best found | upper bound | below it by at most | time |")
    print("|---|---|---|---|---|---|")
    for problem in RACKET.values():
        limits = {"friction": problem.friction, "max_normal_force": problem.max_normal_force}
        for criterion in ("max", "sum"):
            compare(f"racket, {problem.name}", problem, criterion, **limits)
    # The default frames switch axes on the tile; first tangents along x make its wrenches smooth.
    tile = {"friction": INFERRED_FRICTION, "max_normal_force": TILE.max_normal_force, "edges": TILE.edges}
    tangents = np.tile([1.0, 0.0, 0.0], (4, 1))
    for criterion in ("max", "sum"):
        compare("tile", TILE, criterion, tangents=tangents, **tile)


if __name__ == "__main__":
    main()
