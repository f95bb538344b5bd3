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

INTRODUCTION = """# Beside other software

`make compare` writes this page and the README's table: one run asks everybody the same seeded problems, from
Python, one thread each, block by block in turn. Set-up that a solver can do once is not timed. "p99" is the
time that one call in a hundred exceeds. Columns headed `/` say how many times longer a call takes than that
call of this library; below 1 it is faster. "Largest difference" is relative to this library's answer, beside
what is allowed: it depends on what the peer was asked for, as first-order and interior-point methods stop
short. Where answers differ by more, a certificate that NumPy checks decides who is wrong: the peer's answer
is "refuted", or the run fails. A call that is slow is asked fewer of the problems, in the same order, and
compared on these. A call that "crashed" ended its process. Calls that take many problems at once show
means over them.

"""


def headline(answers: Sequence[Answers]) -> str:
    """Return the marked block: one row a question, by the slowest call of this library that is compared."""
    lines = ["| question | graspforce | peers, times longer |", "|---|---|---|"]
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
    return f"{text} ({asked} asked)" if asked < FEW else text


def where_peers_are_better(answers: Sequence[Answers]) -> str:
    lines = [f"- {line}" for one in answers for line in table.better(one)]
    if not lines:
        lines = ["No median and no p99 of a peer was below that of the call it is compared with."]
    lines += ["", "Who came closest, by the slowest call of this library that is compared:", ""]
    for one in answers:
        for name, measured in table.fastest_peers(one)[:1]:
            lines.append(f"- {one.problem}: {name}, {table.ratio(one, measured)} times longer")
    return "## Where a peer is better\n\n" + "\n".join(lines) + "\n"


def write(body: str, answers: Sequence[Answers], share: float) -> None:
    """Write the page and the README's block; ``share`` is that of a processor which the run had."""
    packages = [measured.call.package for one in answers for measured in one.measured]
    block = headline(answers)
    own = (
        f"Timing itself adds {table.duration(nothing())} to each call. The run had {100 * share:.0f}% of a\n"
        "processor: what other programs took lengthens long calls more than short ones.\n\n"
    )
    text = INTRODUCTION + own + machine.description(packages) + "\n\n" + block + "\n\n" + body
    PAGE.write_text(text + "\n" + where_peers_are_better(answers), encoding="utf-8")
    readme = README.read_text(encoding="utf-8")
    marked = re.compile(re.escape(BEGIN) + ".*?" + re.escape(END), re.DOTALL)
    README.write_text(marked.sub(lambda _: block, readme), encoding="utf-8")
