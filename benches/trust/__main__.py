"""Print the table of docs/trust.md: `python -m benches.trust [share]`."""

from __future__ import annotations

import sys

from benches.trust import nearly_degenerate, origin_contacts, tumbles

MODULES = (nearly_degenerate, origin_contacts, tumbles)


def main() -> None:
    """Run every family, at a share of its cases, and print its rows."""
    share = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    print("| family | cases | oracle | missed | wrong |")
    print("|---|---|---|---|---|")
    for module in MODULES:
        for row in module.rows(share):
            print(f"| {row.family} | {row.cases} | {row.oracle} | {row.missed} | {row.wrong} |", flush=True)


if __name__ == "__main__":
    main()
