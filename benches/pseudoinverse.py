"""Why Eqs. 27 to 29 are not used, and what section 4.2 keeps: ``python benches/pseudoinverse.py``.

The tile at the printed optimum, friction 0.68, under the wrench of Fig. 6. ``z_b`` is exact here (a certified
simplex solution), so the columns ``P_1`` of Eq. 27 are exactly the points of the wrench set on the supporting
hyperplane ``p.z_b = 1``. Their pseudoinverse balances the wrench, but with negative coefficients, which stand
for contacts that pull.
"""

from __future__ import annotations

import numpy as np

import graspforce as gf
from graspforce.paper import TILE, TILE_WRENCHES
from graspforce.paper.tile import INFERRED_FRICTION, tile_grasp

ON_HYPERPLANE = 1e-9
NEGATIVE = -1e-9


def negative_coefficients(grasp: gf.Grasp, objective: str, external: np.ndarray) -> None:
    """Count the times at which Eq. 28 gives a negative coefficient."""
    points = grasp.minkowski_sum().wrenches if objective == "max" else grasp.primitive_wrenches
    distributor = gf.ForceDistributor(grasp, objective)
    negative, unbalanced, counts, least, gaps = 0, 0.0, [], 0.0, []
    for w in external:
        reach = points @ distributor.solve(w).dual
        assert reach.max() < 1 + ON_HYPERPLANE
        active = points[reach > 1 - ON_HYPERPLANE]
        gaps.append(1 - reach[reach <= 1 - ON_HYPERPLANE].max())
        alpha = np.linalg.pinv(active.T, rcond=1e-10) @ -w
        unbalanced = max(unbalanced, np.abs(active.T @ alpha + w).max())
        counts.append(len(active))
        negative += bool(alpha.min() < NEGATIVE)
        least = min(least, alpha.min() / alpha.sum())
    print(
        f"| {objective} | {negative} of {len(external)} | {least:.2f} | {min(counts)} to {max(counts)} "
        f"| {min(gaps):.0e} | {unbalanced:.0e} |"
    )


def reduced_columns(grasp: gf.Grasp) -> None:
    """Print what the reduced method keeps with the paper's eleven samples, and how often it suffices."""
    wrench = TILE_WRENCHES[6]
    samples = wrench.at(np.arange(1, 11))
    samples = np.vstack([samples, -samples.sum(axis=0)])
    trajectory = wrench.at(np.arange(10_000) / 1000)
    whole, distributor = grasp.minkowski_sum().wrenches, gf.ForceDistributor(grasp, "max")
    on_planes = {
        int(k) for w in samples for k in np.flatnonzero(whole @ distributor.solve(w).dual > 1 - 1e-9)
    }
    print(f"\n{len(on_planes)} of {len(whole)} points lie on the hyperplanes of the paper's eleven samples.")
    print("\n| samples | points kept | wrenches at 1 kHz that asked the whole set |\n|---|---|---|")
    for name, given in (("the paper's eleven", samples), ("none", None)):
        distributor = gf.ForceDistributor(grasp, "max", method="reduced", samples=given)
        fell_back = sum(distributor.solve(w).fell_back for w in trajectory[::10])
        kept = distributor.reduced_points
        assert kept is not None
        print(f"| {name} | {len(kept)} of {len(whole)} | {fell_back} of 1000 |")


def main() -> None:
    grasp = tile_grasp(TILE.published["max"].params, INFERRED_FRICTION)
    times = np.arange(1000) / 100
    print("| objective | times with a negative alpha | smallest alpha / sum | points of P_1 | next below "
          "| unbalanced N, N m |\n|---|---|---|---|---|---|")  # fmt: skip
    for objective in ("max", "sum"):
        negative_coefficients(grasp, objective, TILE_WRENCHES[6].at(times))
    reduced_columns(grasp)


if __name__ == "__main__":
    main()
