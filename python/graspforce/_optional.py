"""Optional packages, imported where they are used."""

from __future__ import annotations

import importlib
from typing import Any

from .errors import GraspForceError

__all__ = ["optional"]


def optional(module: str, purpose: str, extra: str) -> Any:
    """Import an optional module, or say which extra brings it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        message = f"{purpose} needs {package}, which is not installed: pip install 'graspforce[{extra}]'"
        raise GraspForceError(message) from error
