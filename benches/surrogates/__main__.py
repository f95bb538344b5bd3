"""Print how surrogates rank grasps and what they cost; --write puts it into docs/surrogates.md."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from . import costs, peers, ranking

DOCS = Path(__file__).parents[2] / "docs"


def replaced(page: str, name: str, text: str) -> str:
    """Put text between the comments of this name."""
    begin, end = f"<!-- {name} -->\n", "<!-- end -->"
    return re.sub(f"({re.escape(begin)}).*?({end})", lambda m: f"{m[1]}{text}{m[2]}", page, flags=re.DOTALL)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the page and its figure")
    parser.add_argument("--grasps", type=int, default=2000, help="random grasps, and as many planned ones")
    parser.add_argument("--peers", action="store_true", help="print the times of the peers alone")
    options = parser.parse_args()
    if options.peers:
        print(peers.table())
        return
    found = ranking.rows(options.grasps)
    parts = {"ranking": ranking.table(found), "costs": costs.table(), "peers": peers.table()}
    for name, text in parts.items():
        print(f"{name}:\n{text or 'no peer is installed: make surrogates installs them'}\n")
    if options.write:
        page = (DOCS / "surrogates.md").read_text()
        for name, text in parts.items():
            page = page if text is None else replaced(page, name, text)
        (DOCS / "surrogates.md").write_text(page)
        ranking.draw(found, DOCS / "surrogates.png")


if __name__ == "__main__":
    main()
