"""Fingertips: the sphere or capsule at the end of a finger, found by the name of a body, geom or site."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import finite_vector, known_options, real_number
from graspforce._internal.restored import expect_array, expect_instance, expect_number, expect_whole
from graspforce._internal.to_dict import Record
from graspforce._internal.vectors import unit
from graspforce.errors import InvalidInputError

from .hand_model import named
from .poses import rotations

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from .hand_model import HandModel, Shape

    Array = NDArray[np.float64]


_SPHERE, _CAPSULE = 2, 3  # mjtGeom
_GIVEN = ("name", "radius", "position", "axis", "half_length", "pad")


@dataclass(frozen=True, slots=True, eq=False)
class Fingertip(Record):
    """A sphere or capsule at the end of a finger; threads may share it.

    Attributes
    ----------
    name : str
        Name that was given: of a body, geom or site.
    body : int
        Number of its body among those of the hand.
    position, axis : numpy.ndarray
        (3,) centre in m and unit direction of the capsule, in the frame of the body.
    half_length, radius : float
        In m. A sphere has a half length of 0.
    pad : numpy.ndarray or None
        (3,) unit direction, in the frame of the body, in which the finger is meant to press; None if any
        place of the tip may touch.
    shape : int or None
        Number of the hand's shape that it replaces; None if it was given by numbers.
    """

    name: str
    body: int
    position: Array
    axis: Array
    half_length: float
    radius: float
    pad: Array | None
    shape: int | None

    def _check(self) -> None:
        expect_instance("name", self.name, str)
        expect_whole("body", self.body)
        expect_array("position", self.position, (3,))
        expect_array("axis", self.axis, (3,))
        expect_number("half_length", self.half_length, least=0)
        expect_number("radius", self.radius, least=0)


def find_fingertips(model: HandModel, given: Any, pads: Any = None) -> tuple[Fingertip, ...]:
    """Find the tips by name; a name with numbers gives the sphere or capsule itself.

    Raises
    ------
    InvalidInputError
        A name is unknown (the error lists the candidates), two tips are one, or the body has no sphere or
        capsule and no radius is given.
    """
    if isinstance(given, str | Mapping) or not hasattr(given, "__len__") or len(given) < 2:
        raise InvalidInputError(f"fingertips: {given!r}, expected a list of two or more names")
    tips = []
    for row, one in enumerate(given):
        where = f"fingertips, entry {row}"
        options = dict(one) if isinstance(one, Mapping) else {"name": one}
        known_options(options, _GIVEN)
        if not isinstance(options.get("name"), str):
            raise InvalidInputError(f"{where}: {one!r} is no name, and has no field `name`")
        tips.append(_fingertip(model, where, options))
    for row, tip in enumerate(tips):
        same = [
            k for k in range(row) if tips[k].body == tip.body and np.allclose(tips[k].position, tip.position)
        ]
        if same:
            raise InvalidInputError(
                f"fingertips, entry {row}: {tip.name!r} is the tip of entry {same[0]} again"
            )
    return tuple(_padded(tip, _pad_of(tip, pads, [t.name for t in tips])) for tip in tips)


def _fingertip(model: HandModel, where: str, options: dict[str, Any]) -> Fingertip:
    name = options["name"]
    bodies, sites = [body.name for body in model.bodies], [site[0] for site in model.sites]
    shapes = [shape.name for shape in model.shapes]
    radius = (
        None
        if options.get("radius") is None
        else real_number(f"{where}: radius", options["radius"], positive=True)
    )
    near: Array | None = None
    chosen: int | None = None
    if name in shapes and name:
        chosen = shapes.index(name)
        body = model.shapes[chosen].body
    elif name in sites and name:
        site = sites.index(name)
        body, near = model.sites[site][1], model.sites[site][2]
    elif name in bodies:
        body = bodies.index(name)
    else:
        ends = [t for t in _candidates(model) if t]
        named(
            where,
            name,
            [*ends, *(n for n in (*bodies, *shapes, *sites) if n not in ends)],
            "body, geom or site",
        )
        raise AssertionError
    pad = None if options.get("pad") is None else _direction(f"{where}: pad", options["pad"])
    if radius is not None:
        place = (
            near
            if options.get("position") is None
            else finite_vector(f"{where}: position", options["position"], 3)
        )
        axis = (
            _direction(f"{where}: axis", options["axis"])
            if options.get("axis") is not None
            else np.array([0.0, 0, 1])
        )
        half = real_number(f"{where}: half_length", options.get("half_length") or 0.0, least=0)
        return Fingertip(name, body, np.zeros(3) if place is None else place, axis, half, radius, pad, chosen)
    extra = [field for field in ("position", "axis", "half_length") if options.get(field) is not None]
    if extra:
        raise InvalidInputError(f"{where}: {extra[0]} without radius; give the radius of the tip in m, too")
    number = chosen if chosen is not None else _round_shape(model, where, name, body, near)
    shape = model.shapes[number]
    if shape.kind not in (_SPHERE, _CAPSULE):
        raise InvalidInputError(
            f"{where}: geom {name!r} is neither a sphere nor a capsule; give a radius in m"
        )
    axis = rotations(shape.quaternion)[:, 2]
    half = float(shape.size[1]) if shape.kind == _CAPSULE else 0.0
    return Fingertip(name, body, shape.position, axis, half, float(shape.size[0]), pad, number)


def _round_shape(model: HandModel, where: str, name: str, body: int, near: Array | None) -> int:
    """Return the number of a body's sphere or capsule: nearest to a site, or furthest from the joint."""
    found = [
        k
        for k, s in enumerate(model.shapes)
        if s.body == body and s.collides and s.kind in (_SPHERE, _CAPSULE)
    ]
    if not found:
        own, others = model.bodies[body].name, ", ".join(n for n in _candidates(model) if n)
        raise InvalidInputError(
            f"{where}: body {own!r}{f' of {name!r}' if name != own else ''} has no sphere or capsule that "
            "collides; give `radius` and `position` of the tip in m"
            + (f", or another name; tips could be {others}" if others else "")
        )
    if near is not None:
        return min(found, key=lambda k: _distance(model.shapes[k], near))
    return max(found, key=lambda k: float(np.linalg.norm(model.shapes[k].position)))


def _distance(shape: Shape, point: Array) -> float:
    half = float(shape.size[1]) if shape.kind == _CAPSULE else 0.0
    axis = rotations(shape.quaternion)[:, 2]
    along = float(np.clip((point - shape.position) @ axis, -half, half))
    return float(np.linalg.norm(point - shape.position - along * axis))


def _candidates(model: HandModel) -> list[str]:
    """Names of the bodies at the ends of fingers that hold a sphere or capsule."""
    parents = {body.parent for body in model.bodies}
    round_bodies = {s.body for s in model.shapes if s.collides and s.kind in (_SPHERE, _CAPSULE)}
    return [b.name for k, b in enumerate(model.bodies) if k not in parents and k in round_bodies]


def _direction(argument: str, value: Any) -> Array:
    vector = finite_vector(argument, value, 3)
    if not np.linalg.norm(vector) > 0:
        raise InvalidInputError(f"{argument}: {vector.tolist()} has no direction")
    return unit(vector)


def _pad_of(tip: Fingertip, pads: Any, names: Sequence[str]) -> Array | None:
    if pads is None:
        return tip.pad
    if isinstance(pads, Mapping):
        for name in pads:
            named("pads", name, names, "fingertip")
        value = pads.get(tip.name)
        return tip.pad if value is None else _direction(f"pads, {tip.name}", value)
    return _direction("pads", pads)


def _padded(tip: Fingertip, pad: Array | None) -> Fingertip:
    return Fingertip(tip.name, tip.body, tip.position, tip.axis, tip.half_length, tip.radius, pad, tip.shape)
