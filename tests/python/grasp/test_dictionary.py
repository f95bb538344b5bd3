"""A grasp as a dictionary: written and read again it is the same grasp, and nothing else is read."""

import json

import pytest

import graspforce as gf

GIVEN = gf.Grasp([(-1, 0), (1, 0.5)], [(3, 0), (-1, 0.1)], friction=[0.4, 0.3]).to_dict()


def test_a_grasp_made_of_its_dictionary_is_equal_also_through_json():
    grasp = gf.Grasp.from_dict(GIVEN)
    assert grasp == gf.Grasp.from_dict(json.loads(json.dumps(GIVEN)))
    assert grasp.to_dict() == GIVEN


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({**GIVEN, "mass": 1.0}, "mass: no argument of a grasp; known are positions"),
        ({"positions": GIVEN["positions"]}, "normals: missing"),
        ({**GIVEN, "wrench_dim": 6}, "wrench_dim: 6, but the contacts make it 3"),
        ({**GIVEN, "num_edges": [2]}, r"num_edges: \[2\], but the contacts make it \[2, 2\]"),
        ({**GIVEN, "friction": [0.4, -1]}, "friction, contact 1: -1"),
    ],
)
def test_a_dictionary_that_is_no_grasp_is_refused_by_its_field(given, message):
    with pytest.raises(gf.InvalidGraspError, match=message):
        gf.Grasp.from_dict(given)
