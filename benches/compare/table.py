"""Tables of what was measured, the verdict on every answer, and where a peer is better."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .asking import Answers
    from .timing import Measured


def duration(seconds: float) -> str:
    unit, name = (1.0, "s") if seconds >= 1 else (1e-3, "ms") if seconds >= 1e-3 else (1e-6, "us")
    return f"{seconds / unit:.3g} {name}"


def power(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-") if value else "0"


def times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 10 else f"{ratio:,.0f}"


def is_ours(measured: Measured) -> bool:
    return measured.call.package == "graspforce"


def references(answers: Answers) -> list[Measured]:
    return [measured for measured in answers.measured if measured.call.reference]


def differing(answers: Answers, measured: Measured) -> np.ndarray:
    """Numbers of the problems whose answers differ by more than is allowed."""
    return np.flatnonzero(measured.differences(answers.reference) > measured.call.tolerance)


def disagreements(answers: Answers, measured: Measured) -> int:
    """How many answers differ without being proven wrong."""
    refuted = answers.refuted or (lambda _number, _answer: False)
    return sum(not refuted(int(k), float(measured.answers[k])) for k in differing(answers, measured))


def failings(answers: Answers, measured: Measured) -> list[str]:
    wrong, still_open = len(differing(answers, measured)), disagreements(answers, measured)
    counts = {
        "not solved": measured.unsolved - measured.deaths,
        "refuted": wrong - still_open,
        "**disagree**": still_open,
        "crashed": measured.deaths,
    }
    return [f"{count:,} {name}" for name, count in counts.items() if count]


def agreement(answers: Answers, measured: Measured) -> str:
    if measured.call.tolerance > 0:
        largest = measured.differences(answers.reference).max(initial=0)
        allowed = power(measured.call.tolerance)
        text = f"{power(largest)}, " + (f"allowed {allowed}" if allowed != "inf" else "other cones")
    else:
        text = f"{len(differing(answers, measured))} differ"
    return "; ".join([text, *failings(answers, measured)])


def rows(answers: Answers) -> Iterator[str]:
    base = references(answers)
    ratios = [f"time / `{m.call.name}`" for m in base]
    heads = ["call", "median time", "p99", *ratios, "largest relative difference", "problems"]
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * (5 + len(base)) + "|"
    for measured in answers.measured:
        name = f"`{measured.call.name}`" if is_ours(measured) else measured.call.name
        if measured.failure:
            yield f"| {name} | not run: {measured.failure} |" + " |" * (3 + len(base))
            continue
        ratios = [times(longer(measured, one)) for one in base]
        p99 = "" if np.isnan(measured.p99) else duration(measured.p99)
        cells = [name, duration(measured.median), p99, *ratios, agreement(answers, measured)]
        yield "| " + " | ".join([*cells, f"{len(measured.answers):,}"]) + " |"


def slowest(answers: Answers) -> Measured:
    return max(references(answers), key=lambda measured: measured.median)


def fastest_peers(answers: Answers) -> list[tuple[str, Measured]]:
    """Return the fastest call of each peer, the fastest peer first."""
    peers = [measured for measured in answers.measured if not is_ours(measured) and not measured.failure]
    best: dict[str, Measured] = {}
    for measured in sorted(peers, key=lambda measured: measured.median):
        best.setdefault(measured.call.name.partition(",")[0], measured)
    return list(best.items())


def longer(measured: Measured, base: Measured) -> float:
    """How many times longer a call takes than another, on the problems that both were asked."""
    both = min(len(measured.answers), len(base.answers))
    return measured.first(both).median / base.first(both).median


def ratio(answers: Answers, measured: Measured) -> str:
    return times(longer(measured, slowest(answers)))


def better(answers: Answers) -> Iterator[str]:
    """Every figure in which a peer beats a call of this library that it is compared with."""
    for base in references(answers):
        for measured in answers.measured:
            if is_ours(measured) or measured.failure:
                continue
            same = base.first(len(measured.answers))
            for name, theirs, own in (
                ("median", measured.median, same.median),
                ("p99", measured.p99, same.p99),
            ):
                if theirs < own:
                    figures = f"{duration(theirs)}, `{base.call.name}` {duration(own)}"
                    yield f"{answers.problem}: {name} of {measured.call.name} {figures}"
