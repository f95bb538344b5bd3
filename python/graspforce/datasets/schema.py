"""Columns of a dataset of grasps, and columns that grading adds.

The columns are named as the arguments of `graspforce.Grasp`.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import pyarrow as pa

from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .options import GradeOptions

_VECTORS = "a list of lists of 2 or 3 numbers"
_NUMBERS = "a number, or a list of one for each contact"

_REQUIRED = ("positions", "normals", "friction", "max_normal_force")
GRASP_COLUMNS = {
    "positions": _VECTORS,
    "normals": _VECTORS,
    "friction": _NUMBERS,
    "max_normal_force": _NUMBERS,
    "torsion": _NUMBERS,
    "tangents": _VECTORS,
    "origin": "a list of 2 or 3 numbers",
    "length_scale": "a number",
}
"""What each column holds; those after the limits may be missing."""

# Levels of lists around the numbers of a column.
_DEPTHS = {
    _VECTORS: (2,),
    _NUMBERS: (0, 1),
    GRASP_COLUMNS["origin"]: (1,),
    GRASP_COLUMNS["length_scale"]: (0,),
}


def check_schema(schema: pa.Schema, options: GradeOptions) -> None:
    """Refuse a dataset whose columns cannot be graded, whatever its rows."""
    check_names(schema.names, options)
    for field in schema:
        check_type(field.name, field.type)


def check_names(names: Sequence[object], options: GradeOptions) -> None:
    """Refuse missing columns, repeated columns, and columns with the name of a grade."""
    for name, count in Counter(names).items():
        if count > 1:
            raise InvalidInputError(f"column {name}: there are {count} of them")
    for name in _REQUIRED:
        if name not in names:
            found = ", ".join(map(str, names)) or "none"
            raise InvalidInputError(f"column {name}: not among the columns, which are {found}")
    if options.length_scale is not None and "length_scale" in names:
        raise InvalidInputError("length_scale: given as an option, but the dataset has a column of this name")
    for field in result_fields(options):
        if field.name in names:
            raise InvalidInputError(
                f"column {field.name}: grading adds a column of this name; drop or rename the dataset's own"
            )


def check_type(name: str, found: pa.DataType) -> None:
    """Refuse a column of a grasp that has another type than its argument."""
    expected = GRASP_COLUMNS.get(name)
    if expected is not None and not _fits(found, _DEPTHS[expected]):
        raise InvalidInputError(f"column {name}: {found}, expected {expected}{_hint(found)}")


def graded_schema(schema: pa.Schema, options: GradeOptions) -> pa.Schema:
    """Return the schema of the dataset with its grades."""
    for field in result_fields(options):
        schema = schema.append(field)
    return schema


def result_fields(options: GradeOptions) -> list[pa.Field]:
    """Return the columns that grading adds."""
    fields = [
        pa.field("status", pa.string(), nullable=False),
        pa.field("message", pa.string()),
        pa.field("closure", pa.string()),
    ]
    for criterion in options.criteria:
        rho = f"rho_{criterion}"
        fields += [pa.field(name, pa.float64()) for name in (rho, f"{rho}_lower", f"{rho}_upper")]
    return fields


def is_list(kind: pa.DataType) -> bool:
    """Return True for Arrow's plain types of lists."""
    kinds = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
    return any(is_kind(kind) for is_kind in kinds)


def _fits(kind: pa.DataType, depths: tuple[int, ...]) -> bool:
    depth = 0
    while is_list(kind):
        kind, depth = kind.value_type, depth + 1
    # A column or list of nulls alone has no type and fits every one.
    if pa.types.is_null(kind):
        return depth <= max(depths)
    return depth in depths and bool(pa.types.is_floating(kind) or pa.types.is_integer(kind))


def _hint(found: pa.DataType) -> str:
    if not (pa.types.is_string(found) or pa.types.is_large_string(found)):
        return ""
    return (
        " (Dask turns lists of pandas columns into text unless its option dataframe.convert-string is False)"
    )
