"""Wrenches that take forces far greater than themselves: balanced to 1e-9, or infeasible, by every method.

The full run is `python -m benches.trust large_forces`.
"""

from __future__ import annotations

import pytest
from benches.trust.large_forces import KINDS, case, verdict


@pytest.mark.parametrize("kind", KINDS)
def test_forces_leave_over_at_most_the_tolerance_or_a_witness_separates(kind):
    count = 12 if kind in ("enumerated", "reduced") else 60
    ends = {seed: verdict(case(kind, seed)) for seed in range(count)}
    assert not {seed: end for seed, end in ends.items() if end[0] != "right"}
