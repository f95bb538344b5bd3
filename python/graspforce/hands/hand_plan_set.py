"""The plans that a search for grasps of a hand found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

from graspforce._internal.html import table
from graspforce._internal.restored import expect, expect_number, expect_tuple
from graspforce._internal.to_dict import Record

from .hand_plan import HandPlan

if TYPE_CHECKING:
    from collections.abc import Iterator


SearchEnd: TypeAlias = Literal["done", "time", "interrupted"]
"""Why a search ended."""


@dataclass(frozen=True, slots=True, eq=False)
class HandPlanSet(Record):
    """Plans, best first; threads may share it, and it can be indexed, copied and pickled.

    Attributes
    ----------
    plans : tuple of HandPlan
        One or more.
    counts : dict of str to int
        What became of the poses that the search tried: ``tried``, ``unreached`` (some tip did not come to the
        surface), ``colliding``, ``open`` (no closure), ``without preload`` (no forces press all fingers
        within friction), ``beyond torques`` (none within the torque limits), ``usable``. Of the plans tried:
        ``held in simulation`` (every push), ``lost in simulation``.
    stopped : {"done", "time", "interrupted"}
        Why the search ended.
    seconds : float
        Duration in s.
    """

    plans: tuple[HandPlan, ...]
    counts: dict[str, int]
    stopped: SearchEnd
    seconds: float

    def _check(self) -> None:
        expect_tuple("plans", self.plans, HandPlan)
        expect(self.plans, "plans", "one or more")
        expect(all(type(n) is int for n in self.counts.values()), "counts", "whole numbers")
        expect(self.stopped in get_args(SearchEnd), "stopped", "a reason")
        expect_number("seconds", self.seconds, least=0)

    @property
    def best(self) -> HandPlan:
        """The first plan."""
        return self.plans[0]

    def __getitem__(self, k: int) -> HandPlan:
        return self.plans[k]

    def __len__(self) -> int:
        return len(self.plans)

    def __iter__(self) -> Iterator[HandPlan]:
        return iter(self.plans)

    def _repr_html_(self) -> str:
        rows = (
            (str(k), f"{p.onset:.3g}", f"{p.quality.epsilon:.4g}", f"{p.contact_error * 1e3:.2g}",
             f"{p.penetration * 1e3:.2g}")
            for k, p in enumerate(self.plans)
        )  # fmt: skip
        heads = ("plan", "slip onset", "epsilon (N)", "contact error (mm)", "penetration (mm)")
        return table(repr(self), heads, rows)

    def __repr__(self) -> str:
        return (
            f"HandPlanSet({len(self.plans)} plans, best slip onset {self.best.onset:.3g}, "
            f"{self.counts['usable']} of {self.counts['tried']} poses usable, {self.seconds:.1f} s)"
        )
