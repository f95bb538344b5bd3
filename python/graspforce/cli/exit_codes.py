"""What the command line's exit codes mean."""

from __future__ import annotations

DONE, FAILED, MISUSED, BAD_FILE, INFEASIBLE, PAST_LIMITS = range(6)

MEANINGS = {
    DONE: "done",
    FAILED: "failed: a value is wrong, a file could not be written, a package is missing, "
    "or a computation is too large",
    MISUSED: "the command line is wrong: unknown command or option, or a value out of range",
    BAD_FILE: "an input file is unusable; the message names the file and, in YAML, JSON and CSV files, "
    "line and field",
    INFEASIBLE: "forces: no contact forces balance some wrench, however hard the fingers press",
    PAST_LIMITS: "forces: the least forces against some wrench exceed the limits of the contacts",
}
