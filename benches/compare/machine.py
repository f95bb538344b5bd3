"""What the figures were measured on."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def processor() -> str:
    path = Path("/proc/cpuinfo")
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def description(packages: Iterable[str]) -> str:
    versions = [f"{name} {version(name)}" for name in ("numpy", *sorted(set(packages)))]
    cores = f"{os.cpu_count()} cores"
    return f"{processor()}, {cores}; Python {platform.python_version()}; {', '.join(versions)}."


def version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "(not installed)"
