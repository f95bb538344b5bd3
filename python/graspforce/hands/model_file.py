"""MuJoCo specifications from MJCF and URDF files, with the files that a URDF names by ``package://``."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidFileError

if TYPE_CHECKING:
    from collections.abc import Sequence


_MAX_BYTES = 16 * 1024 * 1024
_ENTITY = re.compile(r"<!(DOCTYPE|ENTITY)", re.IGNORECASE)


def spec_from_file(path: Path, package_dirs: Sequence[Path] = ()) -> Any:
    """Read an MJCF or URDF file as a `mujoco.MjSpec`.

    A file of a URDF that begins with ``package://NAME/`` is looked for in each folder of `package_dirs`, then
    in the folders above the URDF itself: as ``NAME/...`` in the folder, or as ``...`` in a folder that is
    called NAME. Other names are relative to the URDF.

    Raises
    ------
    InvalidFileError
        The file cannot be read, is no model, or names a file that is not there.
    """
    mujoco = optional("mujoco", "hands")
    root = _parsed(path)
    try:
        if root.tag == "mujoco":
            return mujoco.MjSpec.from_file(str(path))
        return mujoco.MjSpec.from_string(_urdf_for_mujoco(path, root, package_dirs))
    except InvalidFileError:
        raise
    except (ValueError, RuntimeError) as error:
        raise InvalidFileError(path, f"MuJoCo cannot read the model: {error}") from None


def _parsed(path: Path) -> ET.Element:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InvalidFileError(path, f"larger than {_MAX_BYTES} bytes")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InvalidFileError(path, error.strerror or str(error)) from None
    except UnicodeDecodeError as error:
        raise InvalidFileError(path, f"not UTF-8 text: {error.reason}") from None
    if _ENTITY.search(text):
        raise InvalidFileError(path, "declares a document type or entities, which are not read")
    try:
        root = ET.fromstring(text)  # noqa: S314 - entities are refused above
    except ET.ParseError as error:
        raise InvalidFileError(path, f"not XML: {error}") from None
    if root.tag not in ("mujoco", "robot"):
        raise InvalidFileError(path, f"neither MJCF (<mujoco>) nor URDF (<robot>), but <{root.tag}>")
    return root


def _urdf_for_mujoco(path: Path, root: ET.Element, package_dirs: Sequence[Path]) -> str:
    """Text of a URDF whose meshes are named by absolute paths, with the options MuJoCo needs."""
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(_located(path, mesh.get("filename", ""), package_dirs)))
    for old in root.findall("mujoco"):
        root.remove(old)
    options = ET.SubElement(root, "mujoco")
    # Links without joints keep their names, and visual meshes are what pictures show.
    ET.SubElement(
        options, "compiler", balanceinertia="true", fusestatic="false", discardvisual="false",
        strippath="false",
    )  # fmt: skip
    return ET.tostring(root, encoding="unicode")


def _located(path: Path, name: str, package_dirs: Sequence[Path]) -> Path:
    folder = path.resolve().parent
    if not name.startswith("package://"):
        plain = Path(name.removeprefix("file://"))
        found = plain if plain.is_absolute() else folder / plain
        if not found.is_file():
            raise InvalidFileError(path, f"mesh {name!r}: no such file {found}")
        return found
    package, _, rest = name.removeprefix("package://").partition("/")
    tried = []
    for base in (*package_dirs, folder, *folder.parents):
        for place in (base / package / rest, *([base / rest] if base.name == package else [])):
            if place.is_file():
                return place.resolve()
            tried.append(place)
    raise InvalidFileError(
        path, f"mesh {name!r}: no package {package!r} holds it; pass package_dirs, the folders that "
        f"hold {package}; tried {', '.join(map(str, tried[:3]))} and the folders above"
    )  # fmt: skip
