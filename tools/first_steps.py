"""Time the first commands of docs/getting_started.rst in a fresh clone: ``python tools/first_steps.py``.

The commands are read from the page. Times are those of the clock, and of the processor in brackets.
"""

import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
COMMANDS = re.compile(r"code-block:: sh\n\n((?:   .*\n)+)")


def commands() -> list[str]:
    """Return the commands of the page, without comments."""
    block = COMMANDS.search((ROOT / "docs" / "getting_started.rst").read_text(encoding="utf-8"))
    if block is None:
        raise SystemExit("docs/getting_started.rst: no commands after its first heading")
    return [line.partition("#")[0].strip() for line in block[1].splitlines()]


def main() -> None:
    """Run the commands one after the other in one shell, and print the time of each."""
    with tempfile.TemporaryDirectory() as folder:
        clone = Path(folder) / "graspforce"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
        lines = ["set -e"]
        for command in commands():
            lines += [f"{command} >&2 </dev/null", "echo done", "read"]
        shell = subprocess.Popen(
            ["bash", "-c", "\n".join(lines)], cwd=clone, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        whole = time.monotonic()
        for command in commands():
            begin = time.monotonic()
            if shell.stdout is None or shell.stdin is None or shell.stdout.readline() != "done\n":
                raise SystemExit(f"{command}: failed")
            print(f"{time.monotonic() - begin:7.1f} s  {command}", flush=True)
            shell.stdin.write("\n")
            shell.stdin.flush()
        shell.wait()
        used = os.times()
        picture = clone / "examples" / "egg.png"
        computed = used.children_user + used.children_system
        print(f"{time.monotonic() - whole:7.1f} s  in all, {computed:.0f} s of the processor: {picture.name}")
        if not picture.is_file():
            raise SystemExit("no picture was drawn")


if __name__ == "__main__":
    main()
