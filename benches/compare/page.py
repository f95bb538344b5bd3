"""The page ``docs/measured.md`` and the README's headline, both written by one run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from . import machine, table
from .timing import nothing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .asking import Answers
    from .timing import Measured

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "measured.md"
README = ROOT / "README.md"
FEW = 20
BEGIN, END = "<!-- headline of make compare -->", "<!-- end of the headline -->"

INTRODUCTION = """# Speed compared with other software

`make compare` writes this page and the table of the README.

- One run gives every program the same seeded problems, from Python, on one thread each. The programs take
  turns, block by block.
- Set-up that a solver needs only once is not timed.
- "p99" is the time that 1% of the calls exceed.
- "time / `call`" divides the median time by that of a call of this library. Below 1 the peer is faster.
- "Largest relative difference" is that between the peer's answers and this library's. It depends on the
  accuracy that the peer was asked for, because first-order and interior-point methods stop early.
- Where the difference is larger than allowed, NumPy checks a certificate. It proves the peer's answer wrong
  ("refuted"), or the run fails.
- A slow call gets only the first of the problems, and is compared on these.
- "crashed" counts the calls that ended their process.
- Calls that take many problems at once show the mean time of a problem.

"""


def headline(answers: Sequence[Answers]) -> str:
    """Return the marked block: one row a problem, with the slowest of this library's compared calls."""
    lines = [
        "| problem | graspforce: median time | other software: median time / that of graspforce |",
        "|---|---|---|",
    ]
    for one in answers:
        if one.headline:
            own = table.duration(table.slowest(one).median)
            peers = ", ".join(peer(one, *named) for named in table.fastest_peers(one)) or "none"
            lines.append(f"| {one.problem} | {own} | {peers} |")
    return "\n".join([BEGIN, *lines, END])


def peer(answers: Answers, name: str, measured: Measured) -> str:
    text = f"{name} {table.ratio(answers, measured)}"
    failings, asked = ", ".join(table.failings(answers, measured)), len(measured.answers)
    if failings:
        return f"{text} ({failings} of {asked:,})"
    return f"{text} ({asked} problems)" if asked < FEW else text


def where_peers_are_better(answers: Sequence[Answers]) -> str:
    lines = [f"- {line}" for one in answers for line in table.better(one)]
    if not lines:
        lines = ["No peer has a lower median or p99 than the call that it is compared with."]
    lines += ["", "The fastest peer of each problem, and its time over that of this library:", ""]
    for one in answers:
        for name, measured in table.fastest_peers(one)[:1]:
            lines.append(f"- {one.problem}: {name}, {table.ratio(one, measured)}")
    return "## Where a peer is better\n\n" + "\n".join(lines) + "\n"


def write(body: str, answers: Sequence[Answers], share: float) -> None:
    """Write the page and the README's block; ``share`` is the part of a processor that the run had."""
    packages = [measured.call.package for one in answers for measured in one.measured]
    block = headline(answers)
    own = (
        f"Timing adds {table.duration(nothing())} to each call. The run had {100 * share:.0f}% of a\n"
        "processor. Other programs on the machine slow long calls more than short ones.\n\n"
    )
    text = INTRODUCTION + own + machine.description(packages) + "\n\n" + block + "\n\n" + body
    PAGE.write_text(text + "\n" + where_peers_are_better(answers), encoding="utf-8")
    readme = README.read_text(encoding="utf-8")
    marked = re.compile(re.escape(BEGIN) + ".*?" + re.escape(END), re.DOTALL)
    README.write_text(marked.sub(lambda _: block, readme), encoding="utf-8")
