"""Check that a search was not interrupted: its iterates are compared with the printed ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graspforce.planning import Plan


def completed(found: Plan) -> Plan:
    """Return the plan of a completed search; raise KeyboardInterrupt if Ctrl-C ended it."""
    if found.stopped == "interrupted":
        raise KeyboardInterrupt
    return found
