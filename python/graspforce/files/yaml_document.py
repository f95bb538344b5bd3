"""YAML and JSON as plain data, with the line of every field.

A file that is not trusted can do no more than be refused: it is limited in size and depth, builds no objects,
and cannot repeat one part of itself many times.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from graspforce._internal.safe_read import limited_bytes
from graspforce.errors import InvalidFileError, MissingExtraError

from .reasons import reasons, shortened, spelled

try:
    import yaml
    from pydantic import BaseModel, ValidationError
except ModuleNotFoundError as error:
    raise MissingExtraError("cli", error) from error

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

MAX_TEXT_BYTES = 1_000_000
"""A grasp of a hundred contacts takes twenty thousand."""

_MAX_DEPTH = 16
_MAX_VALUES = 50_000
_MAX_REPORTED = 5
_SURROGATES = re.compile(r"\\u[dD][89abAB][0-9a-fA-F]{2}\\u[dD][c-fC-F][0-9a-fA-F]{2}")
_Field = tuple[str | int, ...]
_Model = TypeVar("_Model", bound=BaseModel)
_BASE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_BASE):  # type: ignore[misc]
    """The core schema of YAML 1.2; PyYAML's own takes 1e-3 for a string, 010 for eight, 1:30 for ninety."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - PyYAML's way to say so


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:null", re.compile(r"^(~|null|Null|NULL|)$"), ["~", "n", "N", ""]
)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"^(true|True|TRUE|false|False|FALSE)$"), list("tTfF")
)
_Loader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"^[-+]?[0-9]+$"), list("-+0123456789"))
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^([-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))$"
    ),
    list("-+.0123456789"),
)
_Loader.add_constructor("tag:yaml.org,2002:int", lambda loader, node: int(loader.construct_scalar(node)))


@dataclass(frozen=True, slots=True)
class Document:
    """The data of a file, and where each field of it stands.

    `mesh` is the mesh that a user named in place of a file; a mesh that a file names lies beside it.
    """

    path: Path
    data: Any
    lines: dict[_Field, int]
    mesh: Path | None = None

    def error(self, field: Sequence[str | int], message: str) -> InvalidFileError:
        """Return an error that names the line and the field."""
        error = InvalidFileError(self.path, f"{spelled(field)}{message}", self.line_of(field))
        error.field = tuple(field)
        return error

    def line_of(self, field: Sequence[str | int]) -> int | None:
        """Line of a field, or of what should hold it."""
        known: _Field = ()
        for part in field:
            # A validator puts names of variants between those of fields; they have no line of their own.
            known = (*known, part) if (*known, part) in self.lines else known
        return self.lines.get(known)

    def parsed(self, model: type[_Model]) -> _Model:
        """Check the data against a schema."""
        try:
            return model.model_validate(self.data)
        except ValidationError as error:
            found = list(reasons(self.data, error.errors(include_url=False)))
            notes = [str(self.error(field, reason)) for field, reason in found[1:_MAX_REPORTED]]
            left = len(found) - _MAX_REPORTED
            notes += [f"and {left} more"] if left > 0 else []
            field, reason = found[0]
            raise self.error(field, "\n".join([reason, *notes])) from None


def read_document(path: Path) -> Document:
    """Read a YAML or, by its suffix, a JSON file."""
    try:
        text = limited_bytes(path, MAX_TEXT_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidFileError(path, f"not UTF-8 text: {error.reason}") from None
    return document_of(path, text)


def document_of(path: Path, text: str) -> Document:
    """Read the text of a YAML or, by the suffix of its path, a JSON file."""
    if path.suffix.lower() != ".json":
        return _from_yaml(path, text)
    try:
        data = json.loads(text, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise InvalidFileError(path, f"not JSON: {error.msg}", error.lineno) from None
    except (ValueError, RecursionError) as error:
        raise InvalidFileError(path, f"not JSON: {error}") from None
    # JSON is YAML but for its tabs and its pairs of surrogates, so one reader finds the lines of both.
    text = _SURROGATES.sub(lambda pair: json.loads(f'"{pair[0]}"'), text.replace("\t", " "))
    return Document(path, data, _from_yaml(path, text).lines)


def is_grasp(data: Any) -> bool:
    """Whether the contacts have places."""
    by_arguments = isinstance(data, dict) and "positions" in data
    return by_arguments or _some_contact_has(data, {"position", "point", "face"})


def is_plan(data: Any) -> bool:
    """Whether the contacts are a number, or have somewhere to be searched for."""
    number = isinstance(data, dict) and isinstance(data.get("contacts"), int)
    return number or _some_contact_has(data, {"curve", "surface"})


def _some_contact_has(data: Any, fields: set[str]) -> bool:
    contacts = data.get("contacts") if isinstance(data, dict) else None
    return isinstance(contacts, list) and any(isinstance(c, dict) and fields & set(c) for c in contacts)


def _from_yaml(path: Path, text: str) -> Document:
    try:
        _refuse_what_is_not_plain(path, text)
        loader = _Loader(text)
        try:
            root = loader.get_single_node()
            if root is None:
                raise InvalidFileError(path, "empty")
            lines = dict(_lines(path, root))
            return Document(path, loader.construct_document(root), lines)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else None
        problem = str(error.problem or error.context)
        if "nesting" in problem:
            # Newer parsers have a limit of their own.
            raise InvalidFileError(path, f"nested deeper than {_MAX_DEPTH} levels", line) from None
        raise InvalidFileError(path, f"not YAML: {problem}", line) from None
    except (yaml.YAMLError, ValueError) as error:
        if isinstance(error, InvalidFileError):
            raise
        raise InvalidFileError(path, f"not YAML: {error}") from None


def _refuse_what_is_not_plain(path: Path, text: str) -> None:
    depth, values = 0, 0
    for event in yaml.parse(text, Loader=_Loader):
        line = event.start_mark.line + 1 if event.start_mark else None
        if isinstance(event, yaml.AliasEvent):
            raise InvalidFileError(path, "aliases (*name) are not read; write the values out", line)
        tag = getattr(event, "tag", None)
        if tag is not None:
            message = f"tags ({shortened(tag)}) are not read; write plain values"
            raise InvalidFileError(path, message, line)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        values += isinstance(event, yaml.NodeEvent)
        if values > _MAX_VALUES:
            raise InvalidFileError(path, f"more than {_MAX_VALUES} fields, values and lists", line)
        if depth > _MAX_DEPTH:
            raise InvalidFileError(path, f"nested deeper than {_MAX_DEPTH} levels", line)


def _lines(path: Path, node: yaml.Node, field: _Field = ()) -> Iterator[tuple[_Field, int]]:
    line = node.start_mark.line + 1
    yield field, line
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            yield from _lines(path, item, (*field, index))
    elif isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            name, at = str(key.value), key.start_mark.line + 1
            if name in seen:
                raise InvalidFileError(path, f"{spelled((*field, name))}given twice", at)
            seen.add(name)
            yield from _lines(path, value, (*field, name))
            # A value may start below its key; the key is where to look.
            yield (*field, name), at


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number of JSON")
