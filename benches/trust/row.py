"""One row of the table of docs/trust.md."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A family of cases, how many of them, what they were compared with, and how often the library failed.

    `missed` counts cases without an answer where the oracle has one, `wrong` answers that differ from the
    oracle's.
    """

    family: str
    cases: int
    oracle: str
    missed: int
    wrong: int
