"""The schemas of grasp and plan files: what a field is called, what it may hold, what it means."""

from __future__ import annotations

from typing import Annotated, Literal

from graspforce.errors import MissingExtraError

try:
    from pydantic import BaseModel, ConfigDict, Field
except ModuleNotFoundError as error:
    raise MissingExtraError("cli", error) from error

__all__ = ["ContactModel", "EllipseModel", "GraspModel", "LineModel", "PlanContactModel", "PlanModel"]

_MAX_CONTACTS = 1000

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Vector = Annotated[list[_Number], Field(min_length=2, max_length=3)]
_Planar = Annotated[list[_Number], Field(min_length=2, max_length=2)]
_Edges = Annotated[int, Field(ge=3, le=4096)]


class _Strict(BaseModel):
    # Strict: a coefficient that is the text "0.5", or true, is a mistake, not a number.
    model_config = ConfigDict(extra="forbid", strict=True)


class ContactModel(_Strict):
    """One contact of a grasp file; what it leaves out is taken from the file's own fields."""

    position: _Vector = Field(description="where the contact is, in m")
    normal: _Vector = Field(description="into the object, of any length")
    friction: _NotNegative | None = Field(None, description="Coulomb coefficient")
    max_normal_force: _Positive | None = Field(None, description="upper bound of the normal force, in N")
    torsion: _NotNegative | None = Field(None, description="torsional coefficient in m; soft where positive")
    edges: _Edges | None = Field(None, description="edges of the linearised friction cone")
    tangent: Annotated[list[_Number], Field(min_length=3, max_length=3)] | None = Field(
        None, description="direction whose projection is the axis o of the contact frame"
    )
    extreme_forces: list[Annotated[list[_Number], Field(min_length=2, max_length=4)]] | None = Field(
        None, description="forces in the contact frame, in N, whose hull with zero replaces the friction cone"
    )


class _Shared(_Strict):
    """What holds for all contacts of a file."""

    friction: _NotNegative = Field(0.5, description="Coulomb coefficient of contacts that give none")
    max_normal_force: _Positive = Field(1.0, description="upper bound of contacts that give none, in N")
    length_scale: _Positive = Field(1.0, description="length that makes torques comparable with forces, in m")
    friction_margin: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        1.0, description="divides all friction coefficients"
    )
    origin: _Vector | None = Field(None, description="point about which torques are taken, in m")


class GraspModel(_Shared):
    """A grasp: its contacts, and what they have in common."""

    name: str | None = Field(None, description="title of tables and pictures")
    contacts: list[ContactModel] = Field(min_length=1, max_length=_MAX_CONTACTS)
    edges: _Edges | None = Field(8, description="edges of linearised friction cones; null for true cones")
    torsion: _NotNegative = Field(0.0, description="torsional coefficient of contacts that give none, in m")
    outline: list[_Planar] | None = Field(None, description="corners of a planar object, for pictures, in m")
    mesh: str | None = Field(None, description="file of the object's mesh, for pictures, beside this file")


class EllipseModel(_Strict):
    """An ellipse about the origin; its parameter is the angle in rad."""

    kind: Literal["ellipse"]
    semi_x: _Positive
    semi_y: _Positive
    pressed_from: Literal["outside", "inside"] = "outside"


class LineModel(_Strict):
    """The edge ``start + s direction``; its parameter is s."""

    kind: Literal["line"]
    start: _Planar
    direction: _Planar
    object_side: Literal["left", "right"]


class PlanContactModel(_Strict):
    """One contact of a plan file: the curve it may lie on, and how it is searched."""

    curve: Annotated[EllipseModel | LineModel, Field(discriminator="kind")]
    initial: _Number = Field(description="parameter at which the search starts")
    step: _Positive = Field(description="first step of the search")
    tolerance: _Positive = Field(description="step at which the search ends")
    bounds: _Planar = Field(description="smallest and largest parameter")
    friction: _NotNegative | None = Field(None, description="Coulomb coefficient")
    max_normal_force: _Positive | None = Field(None, description="upper bound of the normal force, in N")


class PlanModel(_Shared):
    """A planning problem in the plane: a curve for each contact."""

    name: str | None = Field(None, description="title of tables and pictures")
    contacts: list[PlanContactModel] = Field(min_length=1, max_length=8)
    outline: list[_Planar] | None = Field(None, description="corners of the object, for pictures, in m")
