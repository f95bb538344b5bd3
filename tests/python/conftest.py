"""Reference answers and the seeds of generated cases, shared by all tests."""

import json
import os
from typing import Any

import pytest
from hypothesis import settings
from support.reference_answers import REFERENCE, SPATIAL

# A continuous-integration run must not fail by luck: there the generated cases are the same every time.
settings.register_profile("default", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "default")


@pytest.fixture(scope="session")
def racket() -> dict[str, Any]:
    """Return Example 1 of the paper as computed by Qhull and HiGHS from the printed inputs."""
    return json.loads((REFERENCE / "racket.json").read_text())


@pytest.fixture(params=SPATIAL, ids=lambda case: case["name"])
def spatial_case(request: pytest.FixtureRequest) -> dict[str, Any]:
    """Return one grasp of spatial.json with its reference answers."""
    return request.param


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a box of 60 x 40 x 20 mm, in mm, and an egg."""
    trimesh = pytest.importorskip(
        "trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'"
    )
    trimesh.creation.box((60, 40, 20)).export(tmp_path / "box.ply")
    egg = trimesh.creation.icosphere(subdivisions=3)
    egg.apply_scale([0.04, 0.03, 0.025])
    egg.export(tmp_path / "egg.stl")
    return tmp_path


@pytest.fixture
def write(folder):
    def written(text, name="grasp.yaml"):
        path = folder / name
        path.write_text(text)
        return path

    return written
