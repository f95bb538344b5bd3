"""Time of a quality against contacts and edges: ``python benches/growth.py``.

Runs ``cargo bench --bench quality -- growth``, prints its table, and writes ``docs/growth.md`` and
``docs/growth.png`` from it.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).parents[1]
HEADER = """# Time of a quality against contacts and edges

`python benches/growth.py` writes this page. It measures random force-closure grasps on an ellipsoid, with a
relative tolerance of 1e-9, on one core. Times and calls of the support oracle are medians over 40 grasps.
Compare the growth: times depend on the machine.

![Median time over contacts and edges](growth.png)

"""


def rows_of(table: str) -> np.ndarray:
    lines = [line for line in table.splitlines() if line.startswith("| ") and line[2].isdigit()]
    return np.array([[float(cell) for cell in line.strip("| ").split("|")] for line in lines])


def draw(rows: np.ndarray, path: Path) -> None:
    figure, axes = plt.subplots(1, 2, figsize=(9.6, 4.2), sharey=True, layout="constrained")
    names = {2: "rho_max (Minkowski sum)", 4: "rho_sum (union)"}
    for ax, variable, other, label in ((axes[0], 0, 1, "contacts"), (axes[1], 1, 0, "edges of each cone")):
        shown = np.unique(rows[:, other])[[0, -1]]
        for column, colour in ((2, "#1f5fa8"), (4, "#c8742c")):
            for value, style in zip(shown, ("--", "-"), strict=True):
                part = rows[rows[:, other] == value]
                unit = "edges" if other == 1 else "contacts"
                text = f"{names[column]}, {value:.0f} {unit}"
                ax.loglog(
                    part[:, variable], part[:, column], style, color=colour, marker="o", ms=3.5, label=text
                )
        ticks = np.unique(rows[:, variable])
        ax.set_xticks(ticks, [f"{tick:.0f}" for tick in ticks])
        ax.set_xticks([], minor=True)
        ax.set_xlabel(label)
        ax.grid(which="both", color="#e6e6e6", lw=0.6)
        ax.set_ylim(top=2e4)
        ax.legend(fontsize=7.5, frameon=False, loc="upper left", handlelength=3.5)
        ax.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel("median time (µs)")
    figure.savefig(path, dpi=110)


def main() -> None:
    command = ["cargo", "bench", "--quiet", "--bench", "quality", "--", "growth"]
    table = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    print(table)
    (ROOT / "docs" / "growth.md").write_text(HEADER + table, encoding="utf-8")
    draw(rows_of(table), ROOT / "docs" / "growth.png")


if __name__ == "__main__":
    main()
