"""What a client of the viewer may say: where its camera is, which contact it drags, what a control is set to.

Everything else that viser's server would obey is dropped: share tunnels, uploads, changes of any other
property, unknown names, numbers that are not finite or out of range.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import msgspec

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

_Vector = tuple[float, float, float]
_Quaternion = tuple[float, float, float, float]
_Pixels = Annotated[int, msgspec.Meta(ge=0, le=1 << 20)]


class _Message(msgspec.Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """A message of viser's; the class has its name, the fields have its fields' names."""


class ViewerCameraMessage(_Message):
    """Where the client looks from."""

    wxyz: _Quaternion
    position: _Vector
    fov: float
    near: float
    far: float
    image_height: _Pixels
    image_width: _Pixels
    look_at: _Vector
    up_direction: _Vector


class TransformControlsUpdateMessage(_Message):
    """Where a contact is dragged to."""

    name: str
    wxyz: _Quaternion
    position: _Vector
    owner: str = ""


class TransformControlsDragStartMessage(_Message):
    """A drag begins."""

    name: str
    owner: str = ""


class TransformControlsDragEndMessage(_Message):
    """A drag ends."""

    name: str
    owner: str = ""


class GuiUpdateMessage(_Message):
    """What a control is set to."""

    uuid: str
    updates: dict[str, bool | int | float | str]


MESSAGES = (
    ViewerCameraMessage,
    TransformControlsUpdateMessage,
    TransformControlsDragStartMessage,
    TransformControlsDragEndMessage,
    GuiUpdateMessage,
)

_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(
    ViewerCameraMessage
    | TransformControlsUpdateMessage
    | TransformControlsDragStartMessage
    | TransformControlsDragEndMessage
    | GuiUpdateMessage
)


class Filter:
    """Which messages are passed on to viser.

    Attributes
    ----------
    handles : set of str
        Names of the scene nodes that may be dragged.
    controls : dict of str to callable
        Of each control that may be set, by its identifier, which values it takes.
    """

    def __init__(self) -> None:
        self.handles: set[str] = set()
        self.controls: dict[str, Callable[[Any], bool]] = {}

    def accepts(self, raw: bytes) -> bool:
        """Whether a message, as it arrived, is passed on."""
        try:
            message = _DECODER.decode(raw)
        except (ValueError, RecursionError):  # msgspec's errors are ValueErrors
            return False
        if isinstance(message, GuiUpdateMessage):
            return self._sets(message.uuid, message.updates)
        if not all(map(_finite, msgspec.structs.astuple(message))):
            return False
        if isinstance(message, ViewerCameraMessage):
            return True
        if isinstance(message, TransformControlsUpdateMessage) and not any(message.wxyz):
            return False
        return message.name in self.handles and message.owner == ""

    def _sets(self, control: str, updates: Mapping[str, Any]) -> bool:
        takes = self.controls.get(control)
        return takes is not None and updates.keys() == {"value"} and takes(updates["value"])


def within(low: float, high: float) -> Callable[[Any], bool]:
    """Return the test whether a value is a number from `low` to `high`."""
    return lambda value: (
        isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high
    )


def one_of(*values: str | bool) -> Callable[[Any], bool]:
    """Return the test whether a value is one of those given, of the same type."""
    return lambda value: any(type(value) is type(known) and value == known for known in values)


def _finite(field: object) -> bool:
    if isinstance(field, tuple):
        return all(map(_finite, field))
    return not isinstance(field, float) or math.isfinite(field)
