"""Print every comparison; exit with 1 if an answer disagrees."""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import textwrap
import time
import warnings

# Latency of one thread, for everybody: set before NumPy or a peer starts its pool.
for _pool in ("OMP", "OPENBLAS", "MKL", "RAYON"):
    os.environ[f"{_pool}_NUM_THREADS"] = "1"

from . import force_questions, page, planning, quality_questions, standing, table
from .asking import Run

PEERS = (
    "clarabel", "daqp", "drake", "ecos", "highspy", "hpp-centroidal-dynamics", "klampt", "osqp", "proxsuite",
    "qpsolvers", "scipy",
)  # fmt: skip


def keep_native_prints_out() -> None:
    """Klampt's C++ prints each answer to standard output; ours goes to a copy of it."""
    ours = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    sys.stdout = os.fdopen(ours, "w", buffering=1)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benches.compare", description=__doc__)
    parser.add_argument(
        "--quick", action="store_true", help="a hundredth of the problems: to see that it runs"
    )
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=PEERS, help="packages; all by default")
    parser.add_argument("--write", action="store_true", help="write docs/measured.md and the README's table")
    parser.add_argument("--only", metavar="WORDS", default="", help="questions whose title holds these words")
    options = parser.parse_args()
    if options.write and (options.quick or options.only or options.peers is not PEERS):
        parser.error("--write takes a whole run: neither --quick, --only nor --peers")
    keep_native_prints_out()
    warnings.simplefilter("ignore")  # solvers warn of what they did not solve: the tables count it
    start = time.perf_counter()
    run = Run(options.quick, options.peers)
    all_answers, body, disagreements = [], "", 0
    asking = (quality_questions, force_questions, standing, planning)
    for question in itertools.chain.from_iterable(module.questions(run) for module in asking):
        if options.only.lower() not in question.title.lower():
            continue
        text = f"## {question.title}\n\n{textwrap.fill(question.text, 110)}\n"
        print(text)
        for answers in question.answers:
            lines = [f"**{answers.problem}**", "", *table.rows(answers), ""]
            if answers.note:
                lines += [answers.note, ""]
            print("\n".join(lines))
            text += "\n" + "\n".join(lines)
            all_answers.append(answers)
            disagreements += sum(table.disagreements(answers, one) for one in answers.measured)
        body += text + "\n"
    print(page.where_peers_are_better(all_answers))
    seconds = time.perf_counter() - start
    if options.write:
        page.write(body.rstrip("\n") + "\n", all_answers, time.process_time() / seconds)
    print(f"{seconds:.0f} s; {disagreements} answers disagree")
    return int(disagreements > 0)


if __name__ == "__main__":
    sys.exit(main())
