"""Why a schema refuses the fields of a file, in words that do not depend on the validator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pydantic_core import ErrorDetails

_MAX_SHOWN = 60

_KINDS = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "float_parsing": "a number",
    "string_type": "text",
    "string_unicode": "text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "fields, `name: value`",
    "model_type": "fields, `name: value`",
    "model_attributes_type": "fields, `name: value`",
}
"""What should have been there, by the validator's type of error."""

_WORDS = {
    "missing": "missing",
    "extra_forbidden": "unknown field",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than_equal": "must be at most {le:g}",
    "too_short": "{actual_length} entries, expected at least {min_length}",
    "too_long": "more than {max_length} entries",
    "string_too_short": "must not be empty",
    "literal_error": "must be {expected}",
    "union_tag_invalid": "its {discriminator} must be {expected_tags}, not {tag!r}",
    "union_tag_not_found": "{discriminator} is missing in it",
}
"""What is wrong, with the values of the error's context."""

_OWN = {"place"}
"""Errors of the schemas themselves, which have their own words."""

_NULLABLE = {"edges": "null for true cones"}


def reasons(data: Any, errors: Sequence[ErrorDetails]) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield each field of the data that is wrong, and why; of alternatives, all that would do."""
    found: dict[tuple[str | int, ...], list[ErrorDetails]] = {}
    for error in errors:
        found.setdefault(_field(data, error), []).append(error)
    parents = {field[:size] for field in found for size in range(len(field))}
    for field, group in found.items():
        kinds = list(dict.fromkeys(_KINDS[e["type"]] for e in group if e["type"] in _KINDS))
        if kinds and field in parents and isinstance(group[0]["input"], list | dict):
            continue  # One of the alternatives; what is wrong within the list or the fields is another error.
        others = [_words(error) for error in group if error["type"] not in _KINDS]
        # A value of the right kind is wrong by itself: what else could stand there is no help.
        if kinds and not others:
            kinds += [_NULLABLE[str(field[-1])]] if field and field[-1] in _NULLABLE else []
            others.append(f"expected {' or '.join(kinds)}")
        yield field, "; ".join(dict.fromkeys(others)) + _given(group[0])


def _field(data: Any, error: ErrorDetails) -> tuple[str | int, ...]:
    """Field of the file, without the names that a validator gives to alternatives."""
    *parts, last = error["loc"] or ("",)
    field: list[str | int] = []
    for part in (*parts, last):
        # A validator may have wrapped what stands in the file into a list.
        rows = range(len(data)) if isinstance(data, list) else ()
        inside = part in (data if isinstance(data, dict) else rows)
        if inside:
            field.append(part)
            data = data[part]
        elif part is last and error["type"] == "missing":
            field.append(part)
    return tuple(field)


def _words(error: ErrorDetails) -> str:
    if error["type"] in _OWN:
        return error["msg"]
    return _WORDS.get(error["type"], "not what this field may hold").format(**error.get("ctx", {}))


def reason(error: ErrorDetails) -> str:
    """Return why a single value is wrong, and the value."""
    if error["type"] == "value_error":
        return str(error["ctx"]["error"]).removesuffix(".")
    words = f"expected {_KINDS[error['type']]}" if error["type"] in _KINDS else _words(error)
    return words + _given(error)


def _given(error: ErrorDetails) -> str:
    shown = error["type"] in ("missing", "extra_forbidden") or isinstance(error["input"], dict | list)
    return "" if shown else f", given {shortened(repr(error['input']))}"


def spelled(field: Sequence[str | int]) -> str:
    """Write a field as the beginning of a message about it."""
    parts = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in field)
    return f"{parts.removeprefix('.')}: " if parts else ""


def shortened(text: str) -> str:
    """Leave out the end of a long text."""
    return text if len(text) <= _MAX_SHOWN else f"{text[: _MAX_SHOWN - 4]} ..."
