"""What the command line's exit codes mean."""

from __future__ import annotations

__all__ = ["BAD_FILE", "DONE", "FAILED", "INFEASIBLE", "MEANINGS", "MISUSED"]

DONE, FAILED, MISUSED, BAD_FILE, INFEASIBLE = range(5)

MEANINGS = {
    DONE: "done",
    FAILED: "failed: a value is unusable, a file could not be written, an optional package is missing, "
    "a computation was refused",
    MISUSED: "the command line was not understood",
    BAD_FILE: "an input file is unusable; the message names file, line and field",
    INFEASIBLE: "forces: some wrench cannot be balanced, however hard the fingers press",
}
