"""A small hand of three fingers that needs no package but MuJoCo, and the hands of the presets."""

import pytest

mujoco = pytest.importorskip("mujoco", minversion="4", reason="mujoco is not installed: pip install .[hands]")
pytest.importorskip("mink", reason="mink is not installed: pip install .[hands]")
pytest.importorskip("manifold3d", reason="manifold3d is not installed: pip install .[hands]")

from support.small_hand import PLACES, TIPS, mjcf

import graspforce as gf


@pytest.fixture(scope="session")
def small_hand():
    pads = {"thumb_tip": (1, 0, 0.5), "left_tip": (1, 0, 0.5), "right_tip": (1, 0, 0.5)}
    posture = {f"{n}_{j}": a for n in PLACES for j, a in (("base", -0.2), ("bend", 0.6), ("side", 0.0))}
    return gf.hands.Hand(mujoco.MjSpec.from_string(mjcf()), TIPS, pads=pads, posture=posture, name="small")


def preset(name):
    if not gf.hands.presets()[name]:
        pytest.skip(f"the model of {name} is not installed: pip install --group simulators")
    return gf.hands.preset(name)


@pytest.fixture(scope="session")
def allegro():
    return preset("allegro-right")


@pytest.fixture(scope="session")
def shadow():
    return preset("shadow")
