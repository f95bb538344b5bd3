"""Areas under ROC curves and rank correlations between numbers and what is held, with bootstrap intervals.

Grasps are compared with those of the same hand only: hands differ in strength. The bootstrap draws objects,
not grasps, since grasps of one object are alike.
"""

import numpy as np
from scipy.stats import rankdata

REPLICATES = 1000
TRIALS = (1.0, 3.0)  # N
PER_PUSH = ("slip onset", "least resistance, sum", "least resistance, max")
PER_PUSH += tuple(f"{name}, torque limits" for name in PER_PUSH[1:])


def agreement(x, least, hands):
    """(numbers, trials + 1): areas under the ROC curves of numbers (grasps, numbers), and Spearman's rho.

    An area is how often the grasp that is held has the larger number, over pairs of one hand. Ranks are those
    among the grasps of a hand.
    """
    won, pairs = np.zeros((len(TRIALS), x.shape[1])), np.zeros((len(TRIALS), 1))
    ranks, shares = np.zeros_like(x), np.zeros_like(least)
    for hand in np.unique(hands):
        rows = np.flatnonzero(hands == hand)
        of, n = rankdata(x[rows], axis=0), len(rows)
        ranks[rows] = (of - (n + 1) / 2) / n
        shares[rows] = (rankdata(least[rows]) - (n + 1) / 2) / n
        for k, push in enumerate(TRIALS):
            good = least[rows] >= push
            count = int(good.sum())
            won[k] += of[good].sum(axis=0) - count * (count + 1) / 2
            pairs[k] += count * (n - count)
    with np.errstate(invalid="ignore"):
        rho = shares @ ranks / np.sqrt((ranks**2).sum(axis=0) * (shares**2).sum())
        return np.vstack([won / pairs, rho]).T


class Sample:
    """Numbers, what was held and the hands of grasps, and how to draw them again."""

    def __init__(self, rows, seed=0):
        self.names = list(rows[0]["numbers"])
        self.x = np.array([[row["numbers"][name] for name in self.names] for row in rows], dtype=float)
        self.hands = np.array([row["hand"] for row in rows])
        self.held = {c: np.array([min(row["held"][c]) for row in rows]) for c in rows[0]["held"]}
        objects = np.array([row["object"] for row in rows])
        each = [np.flatnonzero(objects == number) for number in np.unique(objects)]
        rng = np.random.default_rng(seed)
        draws = rng.integers(len(each), size=(REPLICATES, len(each)))
        self.again = [np.concatenate([each[k] for k in draw]) for draw in draws]

    def replicates(self, control):
        """Return the agreement of all grasps, (numbers, columns), and of the samples drawn again."""
        y = self.held[control]
        every = [agreement(self.x[rows], y[rows], self.hands[rows]) for rows in self.again]
        return agreement(self.x, y, self.hands), np.array(every)


def table(names, value, again):
    """Markdown table of one control, the best rank correlation first."""
    low, high = np.nanpercentile(again, [2.5, 97.5], axis=0)
    trials = " | ".join(f"area, {push:.0f} N" for push in TRIALS)
    lines = [f"| number | {trials} | Spearman's rho |", "|---|" + "---:|" * value.shape[1]]
    for k in np.argsort(-value[:, -1]):
        cells = " | ".join(shown(*row) for row in zip(value[k], low[k], high[k], strict=True))
        lines.append(f"| {names[k]} | {cells} |")
    return "\n".join(lines)


def leads(names, control, value, again):
    """Markdown row: by how much the first number of each pair is ahead in Spearman's rho."""
    cells = []
    for pair in LEADS:
        a, b = (names.index(name) for name in pair)
        low, high = np.percentile(again[:, a, -1] - again[:, b, -1], [2.5, 97.5])
        cells.append(shown(value[a, -1] - value[b, -1], low, high, sign="+"))
    return f"| {control} | {' | '.join(cells)} |"


LEADS = (
    ("rho_max", "rho_sum"),
    ("rho_max, torque limits", "rho_max"),
    ("least resistance, max, torque limits", "rho_max, torque limits"),
    ("slip onset", "rho_max, torque limits"),
)


def shown(value, low, high, sign=""):
    return f"{value:{sign}.2f} ({low:{sign}.2f}, {high:{sign}.2f})"


def per_push(rows):
    """Markdown table: rank correlations over single pushes, within each hand."""
    controls = list(rows[0]["held"])
    hands = np.repeat([row["hand"] for row in rows], 6)
    lines = ["| of each push | " + " | ".join(controls) + " |", "|---|" + "---:|" * len(controls)]
    for name in PER_PUSH:
        x = np.concatenate([row["pushes"][name] for row in rows])
        every = (np.concatenate([row["held"][c] for row in rows]) for c in controls)
        found = [agreement(x[:, None], y, hands)[0, -1] for y in every]
        lines.append(f"| {name} | " + " | ".join(f"{rho:.2f}" for rho in found) + " |")
    return "\n".join(lines)


def grasps(rows):
    """Markdown table: how many grasps there are, and the least push that half of them and most hold."""
    controls = list(rows[0]["held"])
    lines = [
        "| grasps | number | " + " | ".join(f"{c}: 1 N, 3 N, median" for c in controls) + " |",
        "|---|---:|" + "---:|" * len(controls),
    ]
    for hand in dict.fromkeys(row["hand"] for row in rows):
        for kind in dict.fromkeys(row["kind"] for row in rows):
            some = [row for row in rows if row["hand"] == hand and row["kind"] == kind]
            cells = []
            for c in controls:
                least = np.array([min(row["held"][c]) for row in some])
                held = ", ".join(f"{100 * (least >= push).mean():.0f}%" for push in TRIALS)
                cells.append(f"{held}, {np.median(least):.1f} N")
            lines.append(f"| {hand}, {kind} | {len(some)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def tables(rows):
    """All tables by their names in docs/holds.md."""
    sample = Sample(rows)
    found = {"grasps": grasps(rows)}
    agreed = {control: sample.replicates(control) for control in sample.held}
    found |= {control: table(sample.names, *both) for control, both in agreed.items()}
    heads = " | ".join(f"{a} over {b}" for a, b in LEADS)
    each = [leads(sample.names, control, *both) for control, both in agreed.items()]
    found["leads"] = "\n".join([f"| control | {heads} |", "|---|" + "---:|" * len(LEADS), *each])
    found["pushes"] = per_push(rows)
    return found
