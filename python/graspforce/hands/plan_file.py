"""Plans of hands as JSON files."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp
from graspforce._internal.vectors import read_only
from graspforce.errors import GraspForceError, InvalidFileError, InvalidInputError
from graspforce.files.hand_schema import HandPlanModel
from graspforce.files.yaml_document import read_document

from .hand import Hand
from .known_hands import preset

if TYPE_CHECKING:
    from graspforce.files.yaml_document import Document


_NUMBERS = (
    "preload", "contact_error", "penetration", "self_penetration", "pad_angle", "pregrasp_clearance", "onset",
)  # fmt: skip
_ARRAYS = ("palm", "joints", "pregrasp", "resting_forces", "external_wrench", "jacobians")


def save_plan(
    plan: Any, path: str | os.PathLike[str], mesh: str | os.PathLike[str] | None, unit: str
) -> None:
    """Write a `HandPlan`; the hand is named by its preset or file, the mesh by its place beside the plan."""
    path = Path(path)
    hand = plan.hand
    if hand.source is None:
        raise InvalidInputError(
            "hand: neither a preset nor read from a hand file, so that no file can name it"
        )
    source = dict(hand.source)
    if "file" in source:
        source["file"] = _relative(Path(source["file"]), path)
    content: dict[str, Any] = {
        "kind": "hand plan",
        "hand": source,
        "joint_names": list(hand.joints),
        "object": None if mesh is None else {"file": _relative(Path(mesh), path), "unit": unit},
        "fingers": list(plan.fingers),
        **{name: getattr(plan, name).tolist() for name in _ARRAYS},
        "grasp": plan.grasp.to_dict(),
        "criterion": plan.quality.criterion,
        **{name: getattr(plan, name) for name in _NUMBERS},
    }
    try:
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidFileError(path, error.strerror or str(error)) from None


def load_plan(
    path: str | os.PathLike[str], hand: Hand | None
) -> tuple[dict[str, Any], tuple[Path, str] | None]:
    """Read the fields of a `HandPlan`, and file and unit of its object's mesh."""
    document = read_document(Path(path))
    if not isinstance(document.data, dict) or "kind" not in document.data:
        raise document.error(
            (), "not a plan of a hand; `graspforce plan-hand --out` and HandPlan.save write them"
        )
    saved = document.parsed(HandPlanModel)
    hand = hand or _hand(document, saved)
    if list(hand.joints) != saved.joint_names:
        raise document.error(
            ("joint_names",), f"not those of the hand {hand.name!r}: {', '.join(hand.joints)}"
        )
    try:
        grasp = Grasp.from_dict(saved.grasp.model_dump(exclude_none=True, exclude={"name"}))
    except GraspForceError as error:
        raise document.error(("grasp",), str(error)) from None
    arrays: dict[str, Any] = {}
    for name in _ARRAYS:
        try:
            arrays[name] = read_only(np.array(getattr(saved, name), dtype=np.float64))
        except ValueError:
            raise document.error((name,), "rows of different lengths") from None
    quality = grasp.quality(saved.criterion, 1e-4)
    numbers = {name: getattr(saved, name) for name in _NUMBERS}
    fields = {
        "hand": hand, "fingers": tuple(saved.fingers), "grasp": grasp, "quality": quality, **arrays,
        **numbers,
    }  # fmt: skip
    if saved.object is None:
        return fields, None
    return fields, (document.path.parent / saved.object.file, saved.object.unit)


def _hand(document: Document, saved: HandPlanModel) -> Hand:
    source = saved.hand
    if source is not None and source.preset is not None:
        try:
            return preset(source.preset)
        except InvalidInputError as error:
            raise document.error(("hand", "preset"), str(error)) from None
    if source is not None and source.file is not None:
        return Hand.load(document.path.parent / source.file)
    raise document.error(("hand",), "names neither a preset nor a hand file; pass the hand")


def _relative(target: Path, path: Path) -> str:
    try:
        return Path(os.path.relpath(target.resolve(), path.resolve().parent)).as_posix()
    except ValueError:  # Another drive of Windows.
        return target.resolve().as_posix()
