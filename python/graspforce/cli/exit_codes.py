"""What the command line's exit codes mean."""

from __future__ import annotations

__all__ = ["BAD_FILE", "DONE", "FAILED", "INFEASIBLE", "MEANINGS", "MISUSED"]

DONE, FAILED, MISUSED, BAD_FILE, INFEASIBLE = range(5)

MEANINGS = {
    DONE: "done",
    FAILED: "failed: a value is wrong, a file could not be written, a package is missing, "
    "or a computation is too large",
    MISUSED: "unknown command or option",
    BAD_FILE: "wrong input file; the message names file, line and field",
    INFEASIBLE: "no contact forces balance some wrench (command forces)",
}
