"""Searches whose whole course is compared with print."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graspforce.planning import Plan

__all__ = ["completed"]


def completed(found: Plan) -> Plan:
    """Return the plan, or pass on the Ctrl-C that ended it: half a search is no use here."""
    if found.stopped == "interrupted":
        raise KeyboardInterrupt
    return found
