"""Time the plans of the paper's tile, and what pruning saves.

Run by ``python benches/tile_plans.py``: medians of interleaved runs from Python, pruned and unpruned in one
process, and a check that both visit the same iterates.
"""

import argparse
import statistics
import time

import graspforce as gf
from graspforce.paper import TILE
from graspforce.paper.tile import INFERRED_FRICTION


def plan(criterion, prune):
    start = time.perf_counter()
    found = gf.plan(
        TILE.surface,
        TILE.initial,
        TILE.step,
        TILE.tolerance,
        TILE.bounds,
        criterion,
        friction=INFERRED_FRICTION,
        max_normal_force=TILE.max_normal_force,
        edges=TILE.edges,
        prune=prune,
    )
    return found, 1e3 * (time.perf_counter() - start)


def main():
    """Print one line for each criterion."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    repeats = parser.parse_args().repeats
    for criterion in ("max", "sum"):
        times = {True: [], False: []}
        for _ in range(repeats):
            for prune in (True, False):
                found, milliseconds = plan(criterion, prune)
                times[prune].append(milliseconds)
                if prune:
                    pruned = found
        same = [(row.params.tolist(), row.rho) for row in pruned.history] == [
            (row.params.tolist(), row.rho) for row in found.history
        ]
        fast, slow = (statistics.median(times[prune]) for prune in (True, False))
        counts = pruned.counts
        print(
            f"rho_{criterion}: {len(pruned.history) - 1} iterations, epsilon {pruned.quality.epsilon:.6f}, "
            f"pruned {fast:.1f} ms (best {min(times[True]):.1f}), unpruned {slow:.1f} ms, ratio "
            f"{slow / fast:.1f}, "
            f"same iterates: {same}; candidates {counts.candidates}, rejected by the pool {counts.rejected}, "
            f"polytopes {counts.polytopes}, converged {counts.converged}"
        )


if __name__ == "__main__":
    main()
