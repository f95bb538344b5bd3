"""A million random wrenches on 1,000 random grasps: ``python benches/force_sweep.py [wrenches a grasp]``.

Every answer is certified in NumPy alone: forces balance, stay in their cones and attain the objective,
``p(z)`` and duality prove that no others are better, and a separating direction proves that none exist. Ten
wrenches of each grasp are also given to HiGHS. A status that differs counts as wrong unless a relative change
of 1e-6 in the wrench makes HiGHS change its own mind.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))

from support.certified_forces import sweep


def main() -> None:
    wrenches = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    start = time.perf_counter()
    counts, worst = sweep(seed=2006, grasps=1000, wrenches=wrenches, sample=10)
    print(f"{1000 * wrenches} wrenches on 1,000 grasps, {time.perf_counter() - start:.0f} s\n")
    print("| outcome | count |\n|---|---|")
    for name, count in counts.items():
        print(f"| {name} | {count} |")
    print("\n| largest relative violation of | |\n|---|---|")
    for name, value in worst.items():
        print(f"| {name} | {value:.1e} |")
    assert not counts["wrong status"]


if __name__ == "__main__":
    main()
