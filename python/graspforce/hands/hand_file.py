"""Hand files: a model and what planning needs to know beside it, in YAML or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspforce.errors import InvalidFileError, InvalidInputError
from graspforce.files.hand_schema import HandFileModel
from graspforce.files.yaml_document import read_document

from .hand import Hand
from .model_file import spec_from_file

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["hand_from_file"]

_ALONE = ("model", "package_dirs", "fingertips")


def hand_from_file(path: Path) -> Hand:
    """Read a hand file; what is wrong with it names the line and the field."""
    document = read_document(path)
    fields = document.parsed(HandFileModel)
    folder = path.parent
    model = folder / fields.model
    try:
        spec = spec_from_file(model, [folder / name for name in fields.package_dirs])
    except InvalidFileError as error:
        raise document.error(("model",), str(error)) from None
    tips = [tip.model_dump(exclude_none=True) for tip in fields.fingertips]
    options: dict[str, Any] = fields.model_dump(exclude=set(_ALONE), exclude_none=True)
    options.setdefault("name", path.stem)
    try:
        hand = Hand(spec, tips, **options)
    except InvalidInputError as error:
        argument = str(error).partition(":")[0].partition(",")[0]
        field = (argument,) if argument in HandFileModel.model_fields else ()
        message = str(error).partition(": ")[2] if field else str(error)
        raise document.error(field, message) from None
    hand.source = {"file": str(path.resolve())}
    return hand
