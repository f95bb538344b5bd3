"""Whether a document is a grasp or a plan, by its contacts: someone who mixes them up is told so at once."""

from __future__ import annotations

from typing import Any

__all__ = ["is_grasp", "is_plan"]


def is_grasp(data: Any) -> bool:
    """Whether the contacts have places."""
    return _some_contact_has(data, {"position", "point", "face"})


def is_plan(data: Any) -> bool:
    """Whether the contacts are a number, or have somewhere to be searched for."""
    number = isinstance(data, dict) and isinstance(data.get("contacts"), int)
    return number or _some_contact_has(data, {"curve", "surface"})


def _some_contact_has(data: Any, fields: set[str]) -> bool:
    contacts = data.get("contacts") if isinstance(data, dict) else None
    return isinstance(contacts, list) and any(isinstance(c, dict) and fields & set(c) for c in contacts)
