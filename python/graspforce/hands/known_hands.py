"""Hands of public packages, prepared: the Shadow hand and the Allegro hand."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce.errors import GraspForceError, InvalidInputError

from .hand import Hand

if TYPE_CHECKING:
    from collections.abc import Callable


_ALLEGRO = "share/example-robot-data/robots/allegro_hand_description/urdf/allegro_{side}_hand.urdf"
# Thumb, then the finger next to it. On the left hand the same joints come in the opposite order.
_ALLEGRO_TIPS = {
    "right": ("link_15.0_tip", "link_3.0_tip", "link_7.0_tip", "link_11.0_tip"),
    "left": ("link_15.0_tip", "link_11.0_tip", "link_7.0_tip", "link_3.0_tip"),
}
_SHADOW_FINGERS = ("FF", "MF", "RF", "LF")


def presets() -> dict[str, bool]:
    """Return the names of all presets, each with whether the package that holds its model is installed.

    Safe to call from several threads.

    Examples
    --------
    >>> import graspforce as gf
    >>> list(gf.hands.presets())
    ['allegro-left', 'allegro-right', 'shadow']
    """
    return {name: _model_file(name) is not None for name in sorted(_PRESETS)}


def preset(name: str, **changes: Any) -> Hand:
    """Return a hand whose model an installed package holds.

    ``"allegro-right"`` and ``"allegro-left"`` come from ``example-robot-data``, ``"shadow"`` from
    ``gymnasium-robotics``. The Allegro's file states joint friction of 5 to 12 N m and torque limits of
    15 N m; the preset has no joint friction and 0.7 N m, as its maker says. The last two joints of a Shadow
    finger are coupled by a tendon: the preset is at the end of its dead band at which the finger presses. The
    Shadow's servos have 3 N m/rad in place of the model's 1: at 1, a force of 2 N at 8 cm is a way of
    0.16 rad. ``stiffness=1.0`` has the model's.

    Safe to call from several threads.

    Parameters
    ----------
    name : {"shadow", "allegro-right", "allegro-left"}
        The hand.
    **changes
        Arguments of `graspforce.hands.Hand` in place of the preset's.

    Raises
    ------
    InvalidInputError
        The name is unknown.
    GraspForceError
        The package that holds the model is not installed; the message says what to install.

    Examples
    --------
    >>> import graspforce as gf
    >>> hand = gf.hands.preset("allegro-right")
    >>> len(hand.joints), hand.num_fingers
    (16, 4)
    """
    if name not in _PRESETS:
        raise InvalidInputError(f"name: {name!r} is no preset; there are {', '.join(sorted(_PRESETS))}")
    package, options = _PRESETS[name][0], _PRESETS[name][1]()
    path = _model_file(name)
    if path is None:
        raise GraspForceError(f"preset {name!r}: its model is in {package}: pip install {package}")
    hand = Hand.load(path, **{**options, "name": name, **changes})
    if not changes:
        hand.source = {"preset": name}
    return hand


def _model_file(name: str) -> Path | None:
    if name == "shadow":
        spec = importlib.util.find_spec("gymnasium_robotics")
        path = spec and spec.origin and Path(spec.origin).parent / "envs/assets/hand/reach.xml"
        return path if path and path.is_file() else None
    spec = importlib.util.find_spec("cmeel")
    roots = [Path(p).parent / "cmeel.prefix" for p in (spec.submodule_search_locations or ())] if spec else []
    found = [root / _ALLEGRO.format(side=name.partition("-")[2]) for root in roots]
    return next((path for path in found if path.is_file()), None)


def _allegro(side: str) -> dict[str, Any]:
    # The thumb's base turns the other way on the left hand, with the limits that its file states.
    bent = {
        f"joint_{4 * finger + k}.0": angle
        for finger in range(3)
        for k, angle in enumerate((0, 0.5, 0.6, 0.6))
    }
    thumb = {f"joint_{12 + k}.0": angle for k, angle in enumerate((1.3, 0.4, 0.4, 0.5))}
    return {
        "fingertips": _ALLEGRO_TIPS[side],
        "palm": "palm_link",
        "pads": (1, 0, 1),
        "torque_limits": 0.7,
        "stiffness": 3.0,
        "damping": 0.1,
        "armature": 1e-3,
        "posture": {**bent, **thumb},
    }


def _shadow() -> dict[str, Any]:
    posture = {
        "robot0:LFJ4": 0.2,
        "robot0:THJ4": 0.8,
        "robot0:THJ3": 0.7,
        "robot0:THJ1": -0.1,
        "robot0:THJ0": -0.5,
    }
    for finger in _SHADOW_FINGERS:
        posture |= {f"robot0:{finger}J2": 0.6, f"robot0:{finger}J1": 0.6, f"robot0:{finger}J3": 0.0}
    tips = tuple(f"robot0:C_{finger.lower()}distal" for finger in ("TH", *_SHADOW_FINGERS))
    return {
        "fingertips": tips,
        "palm": "robot0:palm",
        "root": "robot0:hand mount",
        "pads": {tips[0]: (-1, 0, 0.6), **dict.fromkeys(tips[1:], (0, -1, 0.6))},
        "posture": {**posture, "robot0:THJ2": 0.0},
        "stiffness": 3.0,
        "damping": 0.1,
    }


_PRESETS: dict[str, tuple[str, Callable[[], dict[str, Any]]]] = {
    "allegro-left": ("example-robot-data", lambda: _allegro("left")),
    "allegro-right": ("example-robot-data", lambda: _allegro("right")),
    "shadow": ("gymnasium-robotics", _shadow),
}
