"""Print the table of docs/trust.md: ``python -m benches.trust [share]``."""

import sys

from benches.trust import global_bounds, mesh_unions

FAMILIES = (global_bounds, mesh_unions)


def main() -> None:
    share = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    print("| family | cases | oracle | missed | wrong |")
    print("|---|---|---|---|---|")
    for family in FAMILIES:
        for row in family.rows(share):
            print(f"| {row.family} | {row.cases:,} | {row.oracle} | {row.missed} | {row.wrong} |", flush=True)


if __name__ == "__main__":
    main()
