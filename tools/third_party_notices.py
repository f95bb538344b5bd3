"""Write THIRD_PARTY_NOTICES: the crates that the extension module is built from, and the licences they ship.

    python tools/third_party_notices.py           # write the file
    python tools/third_party_notices.py --check   # exit with 1 if the file is not current

The crates are those that `Cargo.lock` pins for a release on any system; what only tests and build scripts
need is left out.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
NOTICES = ROOT / "THIRD_PARTY_NOTICES"
EXTENSION = "graspforce-py"
LICENCE_FILE = re.compile(r"(licen[cs]e|copying|copyright|notice|unlicense)", re.IGNORECASE)
RULE = "=" * 80
INTRODUCTION = """\
Third-party notices
{rule}

The extension module in graspforce's wheels is built from the {count} crates listed
here, and from Rust's standard library (MIT OR Apache-2.0, The Rust Project
contributors). The texts of their licences follow, each once, below the names of
the crates that ship it. Where a crate offers several licences, any one of them
may be chosen.

"""

Crate = dict[str, Any]


def main() -> int:
    """Write the notices, or with `--check` compare them with the file."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE)
    text = notices(linked_crates(json.loads(done.stdout), EXTENSION))
    if sys.argv[1:] != ["--check"]:
        NOTICES.write_text(text, encoding="utf-8")
        return 0
    if NOTICES.exists() and NOTICES.read_text(encoding="utf-8") == text:
        return 0
    sys.stderr.write(f"{NOTICES.name} is not current: run `python tools/third_party_notices.py`\n")
    return 1


def linked_crates(metadata: dict[str, Any], root: str) -> list[Crate]:
    """Return the crates of others that `root` depends on outside its tests and build scripts, by name."""
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    left = [name for name, package in packages.items() if package["name"] == root]
    found: set[str] = set()
    while left:
        crate = left.pop()
        if crate not in found:
            found.add(crate)
            left += [d["pkg"] for d in nodes[crate]["deps"] if any(k["kind"] is None for k in d["dep_kinds"])]
    # Crates without a source are in this repository.
    theirs = [packages[crate] for crate in found if packages[crate]["source"] is not None]
    return sorted(theirs, key=lambda crate: (crate["name"], crate["version"]))


def notices(crates: list[Crate]) -> str:
    """Return the whole text; a ValueError names a crate that states or ships no licence."""
    lines = [INTRODUCTION.format(rule="=" * 19, count=len(crates))]
    lines += [f"{_named(crate)}: {_stated(crate)}\n" for crate in crates]
    texts: dict[str, str] = {}
    users: dict[str, list[str]] = {}
    for crate in crates:
        for text in _shipped(crate):
            # Texts that differ by line ends or indentation alone are one.
            words = " ".join(text.split())
            texts.setdefault(words, text)
            if _named(crate) not in users.setdefault(words, []):
                users[words].append(_named(crate))
    for words, text in texts.items():
        lines.append(f"\n{RULE}\n{_wrapped(users[words])}\n{RULE}\n\n{text}\n")
    return "".join(lines)


def _named(crate: Crate) -> str:
    return f"{crate['name']} {crate['version']}"


def _stated(crate: Crate) -> str:
    if not crate["license"]:
        raise ValueError(f"{_named(crate)}: states no licence")
    return str(crate["license"]).replace(" / ", " OR ").replace("/", " OR ")


def _shipped(crate: Crate) -> Iterator[str]:
    folder = Path(crate["manifest_path"]).parent
    files = sorted(path for path in folder.iterdir() if path.is_file() and LICENCE_FILE.match(path.name))
    if not files:
        raise ValueError(f"{_named(crate)}: ships no text of its licence in {folder}")
    for path in files:
        lines = path.read_text(encoding="utf-8").expandtabs().splitlines()
        yield "\n".join(line.rstrip() for line in lines).strip("\n")


def _wrapped(names: Iterable[str]) -> str:
    lines = [""]
    for name in names:
        separator = ", " if lines[-1] else ""
        if len(lines[-1]) + len(separator) + len(name) > len(RULE) - 1:
            lines[-1] += ","
            lines.append(name)
        else:
            lines[-1] += separator + name
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
