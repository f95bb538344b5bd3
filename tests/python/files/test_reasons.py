"""What is wrong with a field is said in plain words, whatever the field and whatever stands there."""

import itertools
import json
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

import graspforce as gf
from graspforce.files import load_grasp, load_problem, schema
from graspforce.files.reasons import reasons

VALIDATORS = re.compile(r"Input should|Field required|validation|valid |Value error|constrained|Extra inputs")

PLACES = [
    {"position": [1.0, 0, 0], "normal": [-1.0, 0, 0]},
    {"position": [-1.0, 0, 0], "normal": [1.0, 0, 0]},
]
SEARCH = {"initial": 0.0, "step": 0.5, "tolerance": 0.1, "bounds": [0.0, 1.0]}
ROUND = {"kind": "ellipse", "semi_x": 1.0, "semi_y": 1.0}
GOOD = {
    "grasp": {
        "contacts": PLACES,
        "edges": 8,
        "friction": 0.5,
        "torsion": 0.0,
        "name": "cup",
        "length_scale": 1.0,
    },
    "arguments": gf.Grasp([(1, 0), (-1, 0)], [(-1, 0), (1, 0)]).to_dict(),
    "plan": {"contacts": [{"curve": ROUND, **SEARCH}, {"curve": ROUND, **SEARCH}], "edges": 8},
    "mesh plan": {
        "mesh": {"file": "egg.off", "unit": "m"},
        "contacts": 3,
        "edges": 8,
        "starts": 2,
        "refine": True,
    },
}
WRONG = [
    None, "x", "", True, -1, -0.5, 0, 2.5, 70_000, 10**30, [], ["x"], {}, {"kind": "cube"}, [[]], [1.0] * 9,
    [None], {"x": 1},
]  # fmt: skip


def places(value, path=()):
    """Yield the path of everything in a nest of dictionaries and lists."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


def changed(value, path, new):
    """Return a copy with one part replaced."""
    copy = json.loads(json.dumps(value))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = new
    return copy


@pytest.mark.parametrize("kind", GOOD)
@settings(max_examples=150, deadline=None, derandomize=True)
@given(data=st.data())
def test_a_wrong_value_is_refused_by_its_field_in_plain_words(tmp_path_factory, kind, data):
    where = data.draw(st.sampled_from([path for path in places(GOOD[kind]) if path]))
    path = tmp_path_factory.getbasetemp() / f"{kind}.json"
    path.write_text(json.dumps(changed(GOOD[kind], where, data.draw(st.sampled_from(WRONG)))))
    said = ""
    try:
        (load_problem if "plan" in kind else load_grasp)(path)
    except gf.InvalidFileError as error:
        said = str(error)
    assert not VALIDATORS.search(said), said


@pytest.mark.parametrize(
    ("where", "wrong", "message"),
    [
        (("friction",), -0.5, "friction: must be at least 0, given -0.5"),
        (("contacts",), [], "contacts: 0 entries, expected at least 1"),
        (("edges",), 2.5, "edges: expected a whole number or null for true cones, given 2.5"),
        (("contacts", 1, "position"), "x", r"contacts\[1\].position: expected a list, given 'x'"),
        (("contacts", 0), 3, r"contacts\[0\]: expected fields, `name: value`, given 3"),
    ],
)
def test_words_of_common_mistakes(tmp_path, where, wrong, message):
    path = tmp_path / "grasp.json"
    path.write_text(json.dumps(changed(GOOD["grasp"], where, wrong)))
    with pytest.raises(gf.InvalidFileError, match=f"grasp.json:1: {message}$") as raised:
        load_grasp(path)
    assert raised.value.field == where


def test_no_word_of_the_validator_reaches_a_message():
    wrong = [*WRONG, float("nan"), 2**70, [None, 1], "\ud800", {"file": ""}, [[["a"]]], [1, 2], [{}], "1"]
    models = {
        kind for kind in vars(schema).values() if isinstance(kind, type) and issubclass(kind, BaseModel)
    }
    for model in models:
        for field, value in itertools.product(model.model_fields, wrong):
            try:
                model.model_validate({field: value})
            except ValidationError as error:
                for _, reason in reasons({field: value}, error.errors(include_url=False)):
                    assert not VALIDATORS.search(reason)
