"""Forces over true cones are those of Clarabel's levels, whatever was solved before."""

from __future__ import annotations

import pytest
from benches.trust import cone_histories


@pytest.mark.parametrize("objective", ["max", "sum"])
def test_forces_over_true_cones_have_the_levels_of_clarabel_from_any_past(objective: str) -> None:
    asked, missed, wrong = cone_histories.compare(120, objective, seed=1)
    assert asked > 80
    assert (missed, wrong) == (0, 0)
