"""Hand files: a model and what planning needs to know beside it, in YAML or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspforce.errors import InvalidFileError, InvalidInputError
from graspforce.files.hand_schema import HandFileModel
from graspforce.files.yaml_document import read_document

from .model_file import spec_from_file

if TYPE_CHECKING:
    from pathlib import Path

    from graspforce.files.yaml_document import Document


_ALONE = ("model", "package_dirs", "fingertips")


class HandFile:
    """The arguments of `graspforce.hands.Hand` that a hand file states."""

    def __init__(self, document: Document, spec: Any, fields: HandFileModel) -> None:
        self._document = document
        self.spec = spec
        self.fingertips = [tip.model_dump(exclude_none=True) for tip in fields.fingertips]
        self.options: dict[str, Any] = fields.model_dump(exclude=set(_ALONE), exclude_none=True)
        self.options.setdefault("name", document.path.stem)

    def error(self, error: InvalidInputError) -> InvalidFileError:
        """Return the error of an argument as one of the file, with line and field."""
        where, _, message = str(error).partition(": ")
        argument, _, part = where.partition(", ")
        if argument not in HandFileModel.model_fields:
            return self._document.error((), str(error))
        if (argument, part) in self._document.lines:
            return self._document.error((argument, part), message)
        return self._document.error((argument,), f"{part}: {message}" if part else message)


def read_hand_file(path: Path) -> HandFile:
    """Read a hand file and its model; what is wrong with it names the line and the field."""
    document = read_document(path)
    fields = document.parsed(HandFileModel)
    folder = path.parent
    try:
        spec = spec_from_file(folder / fields.model, [folder / name for name in fields.package_dirs])
    except InvalidFileError as error:
        raise document.error(("model",), str(error)) from None
    return HandFile(document, spec, fields)
