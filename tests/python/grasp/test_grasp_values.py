"""Grasps as values: equal where their arguments are, written and read again, changed by name."""

import copy
import json
import pickle

import numpy as np
import pytest

import graspforce as gf
from graspforce.typing import GRASP_ARGUMENTS

pytestmark = pytest.mark.filterwarnings("ignore::graspforce.GraspWarning")  # contacts are drawn at random

BALL = np.array([(1.0, 0, 0), (-0.5, 0.8, 0.1), (-0.5, -0.8, 0), (0, 0.1, 1)])


def drawn(seed):
    """Return the arguments of a random grasp of one of all kinds."""
    random = np.random.default_rng(seed)
    dim, m = (2, 3)[seed % 2], int(random.integers(1, 6))
    given = {"positions": random.normal(size=(m, dim)), "normals": random.normal(size=(m, dim))}
    choices = {
        "friction": (0.4, random.uniform(0, 1, m)),
        "max_normal_force": (20, random.uniform(1, 9, m)),
        "edges": (None, 5, random.integers(3, 9, m).tolist()),
        "torsion": (0.01, random.uniform(0, 0.1, m)),
        "origin": (random.normal(size=dim),),
        "length_scale": (0.05,),
        "friction_margin": (1.5,),
    }
    if dim == 3:
        choices["tangents"] = (random.normal(size=(m, 3)),)
    else:
        del choices["torsion"]
    for name, values in choices.items():
        at = int(random.integers(0, len(values) + 1))
        if at < len(values):
            given[name] = values[at]
    if random.random() < 0.3:
        k = 2 if dim == 2 else 3
        forces = [np.abs(random.normal(size=(4, k))) for _ in range(m)]
        forces[0][1] = 0
        given["extreme_forces"] = forces
        given.pop("torsion", None)
    return given


@pytest.mark.parametrize("seed", range(40))
def test_a_grasp_equals_what_its_dictionary_json_and_pickle_make(seed):
    grasp = gf.Grasp(**drawn(seed))
    written = json.dumps(grasp.to_dict(), allow_nan=False)
    for again in (
        gf.Grasp.from_dict(grasp.to_dict()),
        gf.Grasp.from_dict(json.loads(written)),
        pickle.loads(pickle.dumps(grasp)),
        copy.deepcopy(grasp),
        grasp.replace(),
        gf.Grasp(**drawn(seed)),
    ):
        assert again == grasp
        assert hash(again) == hash(grasp)
        assert json.dumps(again.to_dict()) == written
    assert grasp != gf.Grasp(**drawn(seed + 40))
    assert grasp != "a grasp"


CHANGES = {
    "positions": 2 * BALL, "normals": -BALL[::-1], "friction": 0.3, "max_normal_force": [1, 2, 3, 4],
    "edges": None, "torsion": 0.02, "tangents": BALL[::-1], "origin": (0, 0, 1), "length_scale": 0.1,
    "friction_margin": 2.0, "extreme_forces": [[(1, 0, 0), (1, 0.5, 0)]] * 4,
}  # fmt: skip


@pytest.mark.parametrize("name", GRASP_ARGUMENTS)
def test_a_replaced_argument_changes_the_grasp_and_nothing_else(name):
    given = {"positions": BALL, "normals": -BALL, "friction": 0.5}
    changed = gf.Grasp(**given).replace(**{name: CHANGES[name]})
    assert changed == gf.Grasp(**{**given, name: CHANGES[name]})
    assert changed != gf.Grasp(**given)


def test_numbers_that_all_contacts_share_fit_another_number_of_contacts():
    grasp = gf.Grasp(BALL, -BALL, friction=0.3, edges=6, max_normal_force=5)
    fewer = grasp.replace(positions=BALL[:3], normals=-BALL[:3])
    assert fewer == gf.Grasp(BALL[:3], -BALL[:3], friction=0.3, edges=6, max_normal_force=5)


def test_zero_and_minus_zero_are_one_grasp():
    one, other = (gf.Grasp([(zero, 1.0)], [(zero, -1.0)]) for zero in (0.0, -0.0))
    assert one == other
    assert hash(one) == hash(other)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"normals": None}, "normals"),
        ({"num_edges": [2]}, r"num_edges: \[2\], but the contacts make it \[8, 8, 8, 8\]"),
        ({"friction": [0.4, -1, 0.4, 0.4]}, "friction, contact 1: -1"),
        ({"wrench_dim": 3}, "wrench_dim: 3, but the contacts make it 6"),
        ({"num_contacts": 3}, "num_contacts: 3, but the contacts make it 4"),
        ({"fiction": 0.5}, "fiction: no argument of a grasp; known are positions"),
        ({"friction": [0.5]}, "friction: shape"),
    ],
)
def test_a_dictionary_that_contradicts_itself_is_refused_by_field(changes, message):
    with pytest.raises(gf.InvalidGraspError, match=message):
        gf.Grasp.from_dict({**gf.Grasp(BALL, -BALL).to_dict(), **changes})


@pytest.mark.parametrize("given", [None, 5, "grasp", [("positions", BALL)]])
def test_what_is_no_dictionary_is_refused(given):
    with pytest.raises(gf.InvalidGraspError, match=r"given: .* is not the dictionary of a grasp"):
        gf.Grasp.from_dict(given)


def test_a_dictionary_without_a_needed_field_names_it():
    with pytest.raises(gf.InvalidGraspError, match="normals: missing"):
        gf.Grasp.from_dict({"positions": BALL})


@pytest.mark.parametrize("edges", [None, 3, [5, 9]])
def test_planar_cones_have_no_edges_to_differ_in(edges):
    planar = {"positions": [(-1, 0), (1, 0)], "normals": [(1, 0), (-1, 0)]}
    grasp, default = gf.Grasp(**planar, edges=edges), gf.Grasp(**planar)
    assert grasp == default
    assert grasp.to_dict() == default.to_dict()
    assert "edges" not in grasp.to_dict()
    assert grasp.replace(edges=6) == gf.Grasp.from_dict(grasp.to_dict()) == default


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((), {}, "missing a required argument: 'positions'"),
        ((BALL,), {}, "missing a required argument: 'normals'"),
        ((BALL, -BALL), {"fiction": 0.5}, "unexpected keyword argument 'fiction'"),
        ((BALL, -BALL), {"normals": BALL}, "multiple values for argument 'normals'"),
        ((BALL, -BALL, *range(10)), {}, "12 were given"),
    ],
)
def test_arguments_that_a_grasp_does_not_take_are_named(arguments, options, message):
    many = {"center_index": 0}
    calls = (gf.Grasp, gf.quality_many, lambda *a, **o: gf._core.CandidateSearch(3).best(*a, **o, **many))
    for call in calls:
        with pytest.raises(TypeError, match=message):
            call(*arguments, **options)
