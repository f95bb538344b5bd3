"""Optional packages, imported where they are used."""

from __future__ import annotations

import importlib
from typing import Any

from graspforce.errors import MissingExtraError


def optional(module: str, extra: str) -> Any:
    """Import an optional module, or say which extra brings it."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingExtraError(extra, error) from error
