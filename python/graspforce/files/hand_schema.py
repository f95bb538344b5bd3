"""The schemas of hand files and of saved plans of hands."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from .schema import GraspArgumentsModel, _NotNegative, _Number, _Planar, _Positive, _Spatial, _Strict


class FingertipModel(_Strict):
    """A fingertip: the sphere or capsule of a body, geom or site, or one given in the body's frame."""

    name: str = Field(min_length=1, description="name of a body, geom or site")
    radius: _Positive | None = Field(None, description="in m; by default that of the geom")
    position: _Spatial | None = Field(None, description="centre in m, with `radius`")
    axis: _Spatial | None = Field(None, description="of a capsule, with `radius`")
    half_length: _NotNegative | None = Field(None, description="of a capsule in m, with `radius`")
    pad: _Spatial | None = Field(None, description="direction in which the tip presses")


class FollowsModel(_Strict):
    """A joint that follows another one: q = ratio q_joint + offset."""

    joint: str
    ratio: _Number = 1.0
    offset: _Number = Field(0.0, description="in rad")


def _by_name(value: Any) -> Any:
    return {"name": value} if isinstance(value, str) else value


_TIP_SCHEMA = {"anyOf": [{"type": "string"}, FingertipModel.model_json_schema()]}
_Tip = Annotated[FingertipModel, BeforeValidator(_by_name), WithJsonSchema(_TIP_SCHEMA)]
_PerJoint = dict[str, _Positive] | _Positive
_PerJointOrZero = dict[str, _NotNegative] | _NotNegative


class HandFileModel(_Strict):
    """A hand: its model, and what planning needs to know beside it."""

    name: str | None = Field(None, description="title of tables and pictures")
    model: str = Field(min_length=1, description="MJCF or URDF, relative to this file")
    package_dirs: list[str] = Field([], description="folders of `package://` names, relative to this file")
    palm: str | None = Field(None, description="body whose frame is the pose of the hand")
    root: str | None = Field(None, description="body above the palm from which on the model is the hand")
    fingertips: Annotated[list[_Tip], Field(min_length=2)]
    pads: dict[str, _Spatial] | _Spatial | None = Field(None, description="directions in which tips press")
    coupling: dict[str, FollowsModel] | None = Field(None, description="joints that follow others")
    joint_limits: dict[str, _Planar] | None = Field(None, description="lower and upper in rad, by joint")
    torque_limits: _PerJoint | None = Field(None, description="in N m, for all joints or by joint")
    stiffness: _PerJoint | None = Field(None, description="of the position servos in N m/rad")
    damping: _PerJointOrZero | None = Field(None, description="in N m s/rad")
    armature: _PerJointOrZero | None = Field(None, description="in kg m^2")
    posture: dict[str, _Number] | None = Field(None, description="an open, preshaped hand, in rad by joint")


class HandSourceModel(_Strict):
    """What makes the hand again: a preset, or a hand file."""

    preset: str | None = None
    file: str | None = None


class SavedObjectModel(_Strict):
    """The object's mesh."""

    file: str = Field(min_length=1, description="OBJ, OFF, PLY, STL, GLB, GLTF or 3MF, relative to this file")
    unit: Literal["m", "dm", "cm", "mm", "in", "ft"] = "m"


class HandPlanModel(_Strict):
    """A planned grasp of a hand, as `HandPlan.save` writes it."""

    kind: Literal["hand plan"]
    hand: HandSourceModel | None
    joint_names: list[str]
    object: SavedObjectModel | None = None
    fingers: Annotated[list[int], Field(min_length=2)]
    palm: list[list[_Number]]
    joints: list[_Number]
    pregrasp: list[_Number]
    grasp: GraspArgumentsModel
    criterion: Literal["max", "sum"]
    resting_forces: list[list[_Number]]
    external_wrench: list[_Number]
    jacobians: list[list[list[_Number]]]
    preload: _NotNegative
    contact_error: _NotNegative
    penetration: _NotNegative
    self_penetration: _NotNegative
    pad_angle: _NotNegative
    pregrasp_clearance: _Number
    onset: _Number
