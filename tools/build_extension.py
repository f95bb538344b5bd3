"""Run maturin so that the extension module it builds holds no path of this machine.

    python tools/build_extension.py build --release --out dist

Panics carry the path of their source file, which for crates lies in the home folder of whoever builds them.
`--remap-path-prefix` replaces such folders by names. All arguments are maturin's.
"""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SEPARATOR = "\x1f"


def main() -> int:
    """Run maturin with the arguments of this command."""
    environment = {**os.environ, "CARGO_ENCODED_RUSTFLAGS": SEPARATOR.join(rust_flags(os.environ))}
    return subprocess.run([maturin(), *sys.argv[1:]], env=environment, check=False).returncode


def maturin() -> str:
    """Return the maturin beside this interpreter, or else the one on the path."""
    beside = Path(sys.executable).with_name("maturin.exe" if os.name == "nt" else "maturin")
    return str(beside) if beside.exists() else "maturin"


def rust_flags(environment: Mapping[str, str]) -> list[str]:
    """Return the caller's flags and those that replace the folders of this machine in file names."""
    if environment.get("CARGO_ENCODED_RUSTFLAGS"):
        given = environment["CARGO_ENCODED_RUSTFLAGS"].split(SEPARATOR)
    else:
        given = environment.get("RUSTFLAGS", "").split()
    home = Path.home()
    cargo = Path(environment.get("CARGO_HOME") or home / ".cargo")
    shown = ["rustc", "--print", "sysroot"]
    sysroot = subprocess.run(shown, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    # Of several prefixes that match, the last one counts.
    named = [(home, "home"), (sysroot, "rust"), (cargo, "cargo"), (cargo / "registry" / "src", "registry")]
    return given + [f"--remap-path-prefix={folder}={name}" for folder, name in [*named, (ROOT, "graspforce")]]


if __name__ == "__main__":
    sys.exit(main())
