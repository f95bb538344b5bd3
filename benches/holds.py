"""Which number predicts what a hand holds? Planned, perturbed and random grasps of 30 objects, both hands.

``python benches/holds.py`` prints the tables of docs/holds.md from ``benches/holding/results.jsonl``.
``--run`` first measures what that file lacks; it can be interrupted and goes on where it was. ``--write``
puts the tables into the page.
"""

import argparse
import json
import re
import time
import warnings
from pathlib import Path

from holding import agreement, measure
from holding.grasps import GraspMaker
from holding.objects import numbers, random_mesh

import graspforce as gf
from graspforce.hands import preset

RESULTS = Path(__file__).parent / "holding/results.jsonl"
PAGE = Path(__file__).parents[1] / "docs/holds.md"
HANDS = ("allegro-right", "shadow")
OBJECTS, SIZE, SEED = 30, 0.08, 3
PERTURBED, RANDOM = 2, 3


def measured():
    """Rows of the file, without those of an object that was interrupted."""
    rows = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.exists() else []
    done = {(row["hand"], row["object"]) for row in rows if row["kind"] == "counts"}
    return [row for row in rows if (row["hand"], row["object"]) in done], done


def rows_of(hand, name, number):
    """Grasps of one object by one hand: numbers and trials, and how many poses were no grasps."""
    mesh = random_mesh(number, SIZE)
    maker = GraspMaker(hand, mesh, number)
    plan = maker.planned()
    kinds = {
        "planned": [] if plan is None else [plan],
        "perturbed": [] if plan is None else maker.near(plan, PERTURBED),
        "random": maker.random(RANDOM),
    }
    for kind, plans in kinds.items():
        for k, one in enumerate(plans):
            yield {
                "hand": name, "object": number, "kind": kind, "number": k, "preload": one.preload,
                "numbers": measure.numbers(one), "pushes": measure.resistances(one),
                "held": measure.held(one, mesh),
            }  # fmt: skip
    yield {"hand": name, "object": number, "kind": "counts", **maker.counts}


def rounded(value):
    """Return a row with its numbers to five digits."""
    if isinstance(value, dict):
        return {name: rounded(one) for name, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def run():
    """Measure object by object, and add each to the file once it is whole."""
    kept, done = measured()
    RESULTS.write_text("".join(json.dumps(row) + "\n" for row in kept))
    hands = {name: preset(name) for name in HANDS}
    for number in numbers(OBJECTS, SEED):
        for name, hand in hands.items():
            if (name, number) in done:
                continue
            began = time.process_time()
            rows = list(rows_of(hand, name, number))
            with RESULTS.open("a") as file:
                file.writelines(json.dumps(rounded(row)) + "\n" for row in rows)
            print(f"{name}, object {number:03d}: {len(rows) - 1} grasps, {time.process_time() - began:.0f} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", action="store_true", help="measure what the results lack")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/holds.md")
    given = parser.parse_args()
    warnings.simplefilter("ignore", gf.GraspWarning)
    if given.run:
        run()
    for name, text in agreement.tables([row for row in measured()[0] if row["kind"] != "counts"]).items():
        print(f"{name}:\n{text}\n")
        if given.write:
            begin, end = f"<!-- {name} -->\n", "\n<!-- end -->"
            page = re.sub(
                f"({begin}).*?({end})", lambda m, t=text: m[1] + t + m[2], PAGE.read_text(), flags=re.DOTALL
            )
            PAGE.write_text(page)


if __name__ == "__main__":
    main()
