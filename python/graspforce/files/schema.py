"""The schemas of grasp and plan files: what a field is called, what it may hold, what it means."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from graspforce.errors import MissingExtraError

try:
    from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, model_validator
    from pydantic_core import PydanticCustomError
except ModuleNotFoundError as error:
    raise MissingExtraError("cli", error) from error

_MAX_EDGES = 65_536
"""The limit of `graspforce.Grasp`; that of contacts is the size of a file."""

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Vector = Annotated[list[_Number], Field(min_length=2, max_length=3)]
_Planar = Annotated[list[_Number], Field(min_length=2, max_length=2)]
_Spatial = Annotated[list[_Number], Field(min_length=3, max_length=3)]
_Edges = Annotated[int, Field(ge=3, le=_MAX_EDGES)]
_AnyEdges = Annotated[int, Field(ge=0, le=_MAX_EDGES)]
_Force = Annotated[list[_Number], Field(min_length=2, max_length=4)]


class _Strict(BaseModel):
    # Strict: a coefficient that is the text "0.5", or true, is a mistake, not a number.
    model_config = ConfigDict(extra="forbid", strict=True)


class MeshModel(_Strict):
    """The object's surface from a file, checked as `graspforce.surfaces.MeshSurface` does."""

    file: str = Field(min_length=1, description="OBJ, OFF, PLY, STL, GLB, GLTF or 3MF, beside this file")
    unit: Literal["m", "dm", "cm", "mm", "in", "ft"] = Field("m", description="unit of its vertices")
    normals: Literal["interpolated", "face"] = Field(
        "interpolated", description="normals of the corners, or those of the faces"
    )
    max_curvature: _Positive | None = Field(
        None, description="in rad/m; contacts keep a distance of its inverse from sharper edges and corners"
    )
    check_watertight: bool = Field(True, description="refuse a mesh with holes")
    check_normals: bool = Field(True, description="refuse given normals that point out of the mesh")


def _by_name(value: Any) -> Any:
    return {"file": value} if isinstance(value, str) else value


_MESH_SCHEMA = {"anyOf": [{"type": "string"}, MeshModel.model_json_schema()]}
_Mesh = Annotated[MeshModel, BeforeValidator(_by_name), WithJsonSchema(_MESH_SCHEMA)]


class ContactModel(_Strict):
    """One contact of a grasp file. The file's own fields hold for contacts that leave theirs out.

    Its place is a position and a normal. On a mesh it may also be a position without a normal, a point
    that is projected on the mesh, or a face with barycentric coordinates.
    """

    position: _Vector | None = Field(None, description="position of the contact in m")
    normal: _Vector | None = Field(None, description="into the object, of any length; by default the mesh's")
    point: _Spatial | None = Field(None, description="in m; the contact is the nearest point of the mesh")
    face: Annotated[int, Field(ge=0)] | None = Field(
        None, description="number of a face of the mesh, from 0; the contact is on it"
    )
    barycentric: _Spatial | None = Field(None, description="weights of that face's corners, with sum 1")
    friction: _NotNegative | None = Field(None, description="Coulomb coefficient")
    max_normal_force: _Positive | None = Field(None, description="upper bound of the normal force, in N")
    torsion: _NotNegative | None = Field(None, description="torsional coefficient in m; soft where positive")
    edges: _Edges | None = Field(None, description="edges of the linearised friction cone")
    tangent: _Spatial | None = Field(
        None, description="direction whose projection is the axis o of the contact frame"
    )
    extreme_forces: list[_Force] | None = Field(
        None, description="forces in the contact frame, in N, whose hull with zero replaces the friction cone"
    )

    @model_validator(mode="after")
    def _one_place(self) -> ContactModel:
        fields = ("position", "normal", "point", "face", "barycentric")
        given = tuple(name for name in fields if getattr(self, name) is not None)
        if given not in {("position", "normal"), ("position",), ("point",), ("face", "barycentric")}:
            raise PydanticCustomError(
                "place",
                "its place is `position` and `normal`, or on a mesh `position`, `point`, or `face` and "
                "`barycentric`; given is {given}",
                {"given": " and ".join(f"`{name}`" for name in given) or "none of them"},
            )
        return self


class _Shared(_Strict):
    """What holds for all contacts of a file."""

    name: str | None = Field(None, description="title of tables and pictures")
    friction: _NotNegative = Field(0.5, description="Coulomb coefficient of contacts that give none")
    max_normal_force: _Positive = Field(1.0, description="upper bound of contacts that give none, in N")
    edges: _Edges | None = Field(8, description="edges of linearised friction cones; null for true cones")
    friction_margin: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        1.0, description="divides all friction coefficients"
    )


class _Scaled(_Shared):
    """What measures torques, where the file gives the contacts' places."""

    length_scale: _Positive = Field(1.0, description="length in m that divides torques in the norm")
    origin: _Vector | None = Field(None, description="point about which torques are taken, in m")


class GraspModel(_Scaled):
    """A grasp: its contacts, and what they have in common."""

    contacts: list[ContactModel] = Field(min_length=1)
    torsion: _NotNegative = Field(0.0, description="torsional coefficient of contacts that give none, in m")
    outline: list[_Planar] | None = Field(None, description="corners of a planar object, for pictures, in m")
    mesh: _Mesh | None = Field(
        None, description="the object's mesh, for pictures and for contacts without normals"
    )


class GraspArgumentsModel(_Strict):
    """A grasp by the arguments of `graspforce.Grasp`, as `Grasp.to_dict` writes it.

    What follows from the arguments may be there too: ``wrench_dim``, ``num_contacts``, ``force_dim`` and
    ``num_edges`` must then agree with them.
    """

    name: str | None = None
    positions: list[_Vector] = Field(min_length=1)
    normals: list[_Vector]
    friction: list[_Number] | _Number = 0.5
    max_normal_force: list[_Number] | _Number = 1.0
    edges: list[_AnyEdges] | _AnyEdges | None = 8
    torsion: list[_Number] | _Number | None = None
    tangents: list[_Spatial] | _Spatial | None = None
    origin: _Vector | None = None
    length_scale: _Positive = 1.0
    friction_margin: _Number = 1.0
    extreme_forces: list[list[_Force]] | None = None
    wrench_dim: int | None = None
    num_contacts: int | None = None
    force_dim: int | None = None
    num_edges: list[int] | None = None


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


class PlaneModel(_Strict):
    """The face ``start + p u + q v``; its parameters are p and q."""

    kind: Literal["plane"]
    start: _Spatial
    u: _Spatial
    v: _Spatial
    object_side: Literal["along", "against"]


class EllipsoidModel(_Strict):
    """An ellipsoid about the origin; its parameters are longitude and latitude in rad."""

    kind: Literal["ellipsoid"]
    semi_x: _Positive
    semi_y: _Positive
    semi_z: _Positive
    pressed_from: Literal["outside", "inside"] = "outside"


class CylinderModel(_Strict):
    """The side of a cylinder about the z axis; its parameters are the angle in rad and the height in m."""

    kind: Literal["cylinder"]
    radius: _Positive
    pressed_from: Literal["outside", "inside"] = "outside"


def _listed(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _rows(value: Any) -> Any:
    return [value] if isinstance(value, list) and not any(isinstance(row, list) for row in value) else value


_NUMBERS_SCHEMA = {"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}}]}
_Numbers = Annotated[list[_Number], BeforeValidator(_listed), WithJsonSchema(_NUMBERS_SCHEMA)]
_Positives = Annotated[list[_Positive], BeforeValidator(_listed), WithJsonSchema(_NUMBERS_SCHEMA)]
_Bounds = Annotated[list[_Planar], BeforeValidator(_rows), Field(min_length=1, max_length=2)]


class PlanContactModel(_Strict):
    """One contact of a plan file: the curve or surface it may lie on, and how it is searched.

    On a curve each field of the search is a number and ``bounds`` a pair; on a surface there are two of each.
    """

    curve: Annotated[EllipseModel | LineModel, Field(discriminator="kind")] | None = None
    surface: Annotated[PlaneModel | EllipsoidModel | CylinderModel, Field(discriminator="kind")] | None = None
    initial: _Numbers = Field(description="parameters at which the search starts")
    step: _Positives = Field(description="first step of the search, one for all parameters or one for each")
    tolerance: _Positives = Field(description="step at which the search ends, likewise")
    bounds: _Bounds = Field(description="smallest and largest value of each parameter")
    friction: _NotNegative | None = Field(None, description="Coulomb coefficient")
    max_normal_force: _Positive | None = Field(None, description="upper bound of the normal force, in N")


class PlanModel(_Scaled):
    """A planning problem: a curve in the plane, or a surface in space, for each contact."""

    contacts: list[PlanContactModel] = Field(min_length=1, max_length=8)
    outline: list[_Planar] | None = Field(None, description="corners of the object, for pictures, in m")


def of_each_contact(model: GraspModel | PlanModel, field: str) -> list[float]:
    """Return what each contact gives, or the file says of all."""
    given = (getattr(contact, field) for contact in model.contacts)
    return [getattr(model, field) if value is None else value for value in given]


class MeshPlanModel(_Shared):
    """A planning problem on a mesh: any number of contacts anywhere on its surface, from many starts."""

    mesh: _Mesh = Field(description="the object")
    contacts: int = Field(3, ge=2, le=12, description="number of contacts")
    torsion: _NotNegative = Field(0.0, description="torsional coefficient in m; soft fingers where positive")
    length_scale: _Positive | None = Field(
        None, description="length in m that divides torques in the norm; half the mesh's extent"
    )
    origin: _Spatial | None = Field(
        None, description="point about which torques are taken, in m; the mesh's centre of mass"
    )
    starts: int = Field(100, ge=1, le=100_000, description="number of searches")
    best: int = Field(3, ge=1, le=1000, description="number of distinct grasps kept")
    step: _Positive | None = Field(None, description="first step in m; a fifth of the mesh's extent")
    tolerance: _Positive | None = Field(None, description="last step in m; a tenth of the first")
    min_distance: _NotNegative | None = Field(
        None, description="least distance between contacts in m; a twentieth of the mesh's extent"
    )
    refine: bool = Field(True, description="whether the grasps kept are refined by gradients")
    seed: int = Field(0, ge=0, description="of the starts: the same seed gives the same grasps")
    time_limit: _Positive | None = Field(None, description="seconds after which search and refinement end")
