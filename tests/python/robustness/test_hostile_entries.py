"""Entry points in Python: each answers, or refuses by the argument's name with an error of the library."""

import itertools
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from support.hostile_values import Unwilling

import graspforce as gf
from graspforce.surfaces import ParametricSurface, PlanarCurve, contacts_on, ellipse, mirrored, tied

WRONG = [
    None,
    5,
    -1,
    7,
    2.5,
    "abc",
    b"x",
    [],
    [1, 2, 3],
    [[np.nan, 0.0]],
    {"a": 1},
    object(),
    Unwilling(),
    True,
]

PLANAR = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
SPATIAL = gf.Grasp([(-1, 0, 0), (1, 0, 0)], [(1, 0, 0), (-1, 0, 0)])
DISC = contacts_on(*[ellipse(1, 1)] * 2)


def refusal(call):
    """Return what the call refuses with; a wrong value may also be no mistake for it."""
    try:
        call()
    except (gf.GraspForceError, TypeError, ValueError, OverflowError) as error:
        return error
    return None


ENTRIES = {
    "contacts_on": (contacts_on, "places"),
    "contacts": (DISC, "params"),
    "tied": (lambda wrong: tied(wrong, [[1]]), "surface"),
    "tied matrix": (lambda wrong: tied(DISC, wrong), "matrix|surface"),
    "mirrored": (lambda wrong: mirrored(wrong, (1, 0)), "surface"),
    "curve": (lambda wrong: PlanarCurve(point=wrong), "point"),
    "surface": (lambda wrong: ParametricSurface(point=wrong), "point"),
    "curve friction": (lambda wrong: PlanarCurve(point=np.sin, friction=wrong), "friction"),
    "criteria": (lambda wrong: gf.grade(None, criteria=wrong), "criteria|criterion|source"),
    "progress": (lambda wrong: gf.grade(None, progress=wrong), "progress|source"),
    "parse_wrench": (lambda wrong: __import__("graspforce.files").files.parse_wrench(wrong, 3), "text"),
}


@pytest.mark.parametrize("name", ENTRIES)
def test_wrong_values_are_refused_by_the_arguments_name(name):
    call, argument = ENTRIES[name]
    for wrong in WRONG:
        error = refusal(lambda wrong=wrong: call(wrong))
        if error is not None:
            assert isinstance(error, gf.GraspForceError), (wrong, error)
            assert any(word in str(error) for word in argument.split("|")), (wrong, error)


def test_figures_refuse_by_the_arguments_name():
    pytest.importorskip("matplotlib", reason="matplotlib is not installed: pip install 'graspforce[plot]'")
    from graspforce import plotting  # noqa: PLC0415

    figures = {
        "grasp": [plotting.grasp_figure, plotting.quality_figure],
        "plan": [plotting.history_figure],
        "outline": [lambda wrong: plotting.grasp_figure(PLANAR, outline=wrong)],
        "forces": [lambda wrong: plotting.grasp_figure(PLANAR, wrong)],
        "mesh": [lambda wrong: plotting.grasp_figure(SPATIAL, mesh=wrong)],
        "normal_forces": [lambda wrong: plotting.trajectory_figure(wrong, 5.0)],
        "max_normal_force": [lambda wrong: plotting.trajectory_figure([[1.0, 2.0]], wrong)],
        "times": [lambda wrong: plotting.trajectory_figure([[1.0, 2.0]], 5.0, times=wrong)],
    }
    for argument, calls in figures.items():
        for call, wrong in itertools.product(calls, WRONG):
            error = refusal(lambda call=call, wrong=wrong: call(wrong))
            if error is not None:
                assert str(error).startswith(argument), (argument, wrong, error)
    with pytest.raises(gf.InvalidInputError, match="forces, entry"):
        plotting.grasp_figure(PLANAR, [[np.nan, 0], [0, 0]])


def test_the_viewers_state_refuses_by_the_arguments_name():
    from graspforce.viewer import ViewState  # noqa: PLC0415

    wrenches = np.zeros((2, 6))
    state = ViewState(SPATIAL, wrenches=wrenches)
    wrenches[:] = 1
    assert not state.wrenches.any()
    assert not state.wrenches.flags.writeable
    calls = {
        "grasp": ViewState,
        "wrenches": lambda wrong: ViewState(SPATIAL, wrenches=wrong),
        "mesh": lambda wrong: ViewState(SPATIAL, wrong),
        "friction": lambda wrong: state.scale(wrong, 1.0),
        "limits": lambda wrong: state.scale(1.0, wrong),
        "contact": lambda wrong: state.move(wrong, (0, 0, 1)),
        "to": lambda wrong: state.move(0, wrong),
        "criterion": state.quality,
        "row": state.forces,
    }
    for (argument, call), wrong in itertools.product(calls.items(), WRONG):
        error = refusal(lambda call=call, wrong=wrong: call(wrong))
        if error is not None:
            assert argument in str(error).partition(":")[0], (argument, wrong, error)


@pytest.mark.parametrize("simulator", ["mujoco", "drake", "pinocchio"])
def test_adapters_refuse_what_is_no_simulation(simulator):
    package = {"drake": "pydrake"}.get(simulator, simulator)
    module = pytest.importorskip(package, reason=f"{simulator} is not installed")
    for wrong in [*WRONG, SimpleNamespace(), sys]:
        if simulator == "pinocchio":
            error = refusal(lambda wrong=wrong: gf.from_pinocchio(wrong, [], ["tip"], [(1, 0, 0)]))
        else:
            read = {"mujoco": gf.from_mujoco, "drake": gf.from_drake}[simulator]
            error = refusal(lambda wrong=wrong, read=read: read(wrong, wrong, "box"))
        assert isinstance(error, gf.InvalidInputError), (wrong, error)
        assert str(error).partition(":")[0] in ("model", "plant"), error
    if simulator == "pinocchio":
        with pytest.raises(gf.InvalidInputError, match="has no joints"):
            gf.from_pinocchio(module.Model(), [], ["tip"], [(1, 0, 0)])
        hand = module.Model()
        hand.addJoint(0, module.JointModelPX(), module.SE3.Identity(), "slide")
        with pytest.raises(gf.InvalidInputError, match=r"frames: \[1, 2, 3\]"):
            gf.from_pinocchio(hand, [0.0], [1, 2, 3], [(1, 0, 0)])


def test_a_mesh_surface_does_not_change_and_refuses_far_contacts():
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    ball = gf.surfaces.MeshSurface(trimesh.creation.icosphere(radius=0.045))
    with pytest.raises(AttributeError, match="bounds: a MeshSurface is immutable"):
        ball.bounds = 3
    with pytest.raises(gf.InvalidInputError, match=r"positions, contact 1: 39\.\d+ m away"):
        ball.grasp([(0.05, 0, 0), (40, 0, 0)])
    for limits in ({"friction": -1}, {"friction": "x"}, {"max_normal_force": 0}):
        with pytest.raises(gf.InvalidInputError, match=next(iter(limits))):
            gf.surfaces.MeshSurface(trimesh.creation.icosphere(radius=0.045), **limits)


def test_names_read_on_demand_are_listed():
    assert {"load_grasp", "save_grasp", "Grasp"} <= set(dir(gf))
