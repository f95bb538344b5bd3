"""Build the C library and lay it out under a prefix, with what CMake and pkg-config need to find it.

    python tools/build_c_library.py                        # into target/capi
    python tools/build_c_library.py --prefix /usr/local    # into include, lib and share of /usr/local

The installed folder may be moved: its files name each other by relative paths. Linux and macOS.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from build_extension import SEPARATOR, rust_flags

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "rust" / "c" / "package"


def main() -> int:
    """Build and install."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--prefix", type=Path, default=ROOT / "target" / "capi", help="where to install")
    parser.add_argument("--debug", action="store_true", help="compiled like the tests of Rust")
    arguments = parser.parse_args()
    if sys.platform not in {"linux", "darwin"}:
        sys.stderr.write(f"build_c_library.py: Linux and macOS only, not {sys.platform}\n")
        return 1
    environment = dict(os.environ)
    command = ["cargo", "build", "--locked", "--lib", "--package", "graspforce-c"]
    if arguments.debug:
        environment["CARGO_INCREMENTAL"] = "0"
        command += ["--tests", "--package", "graspforce"]
    else:
        # The flags of the extension module, so that no file names this machine.
        environment["CARGO_ENCODED_RUSTFLAGS"] = SEPARATOR.join(rust_flags(os.environ))
        command += ["--release"]
    built = subprocess.run(command, cwd=ROOT, env=environment, check=False)
    if built.returncode == 0:
        target = Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target")
        install(target / ("debug" if arguments.debug else "release"), arguments.prefix)
    return built.returncode


def install(built: Path, prefix: Path) -> None:
    """Copy the libraries and the header, and write the files that find them."""
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    major, minor = version.split(".")[:2]
    apple = sys.platform == "darwin"
    names = (
        ["libgraspforce.dylib"]
        if apple
        else [f"libgraspforce.so{end}" for end in (f".{version}", f".{major}.{minor}", "")]
    )
    include, library = prefix / "include", prefix / "lib"
    share = prefix / "share" / "doc" / "graspforce"
    for folder in (include, share, library / "pkgconfig", library / "cmake" / "graspforce"):
        folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / "rust" / "c" / "include" / "graspforce.h", include)
    shutil.copy(built / "libgraspforce.a", library)
    shutil.copy(built / ("libgraspforce.dylib" if apple else "libgraspforce.so"), library / names[0])
    if shutil.which("strip"):
        for name in ("libgraspforce.a", names[0]):
            subprocess.run(["strip", "-S", library / name], check=True)
    for link in names[1:]:
        (library / link).unlink(missing_ok=True)
        (library / link).symlink_to(names[0])
    for notice in ("LICENSE", "THIRD_PARTY_NOTICES"):
        shutil.copy(ROOT / notice, share)
    values = {
        "VERSION": version,
        "MAJOR": major,
        "MINOR": minor,
        "SHARED": names[0],
        "SONAME": f"libgraspforce.so.{major}.{minor}",
        "STATIC_LIBS": "-lm" if apple else "-lpthread -ldl -lm",
    }
    for template, folder in [
        ("graspforce.pc", library / "pkgconfig"),
        ("graspforce-config.cmake", library / "cmake" / "graspforce"),
        ("graspforce-config-version.cmake", library / "cmake" / "graspforce"),
    ]:
        text = (PACKAGE / f"{template}.in").read_text()
        for name, value in values.items():
            text = text.replace(f"@{name}@", value)
        (folder / template).write_text(text)


if __name__ == "__main__":
    sys.exit(main())
