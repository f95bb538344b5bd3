"""Every public name: it is there, it says what threads may do, and its objects travel."""

import copy
import importlib
import inspect
import json
import pickle
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import graspforce as gf

MODULES = [
    "graspforce",
    *(f"graspforce.{m}" for m in ("surfaces", "surrogates", "adapters", "files", "hands")),
    *(f"graspforce.{m}" for m in ("plotting", "viewer", "torch", "jax")),
]
NEEDED = {"files": "pydantic", "plotting": "matplotlib", "viewer": "viser", "torch": "torch", "jax": "jax"}

# The names of the design that programs are written against.
CONTRACT = {
    gf.Grasp: "wrench_dim num_contacts grasp_matrix primitive_wrenches quality resistance measures "
    "is_force_closure minkowski_sum",
    gf.Quality: "rho epsilon lower upper converged closure direction wrench gradient",
    gf.Gradient: "positions normals unique",
    gf.MinkowskiSum: "wrenches starts ends contacts edges to_scipy",
    gf.ForceDistributor: "solve solve_into solve_many update",
    gf.ForceSolution: "forces world_forces contact_wrenches sigma_max sigma_sum dual gap pivots unique "
    "within_limits slip_margin",
    gf.ForceBatch: "forces sigma_max sigma_sum status",
    gf.Plan: "params quality grasp history",
    gf.hands.Hand: "load joints joint_limits torque_limits coupling fingertips stiffness reach",
    gf.hands.HandPose: "palm joints position_error normal_error clearance",
    gf.hands.HandPlan: "palm joints pregrasp grasp quality penetration contact_error slip_onset torques "
    "squeeze",
    gf.hands.Trial: "held displacement rotation",
    gf: "plan_hand quality_many plan from_mujoco GraspForceError InvalidGraspError InvalidInputError "
    "InfeasibleWrenchError TooLargeError",
}


def public():
    """Return every public class and function by its full name."""
    found = {}
    for name in MODULES:
        needed = NEEDED.get(name.partition(".")[2])
        if needed is not None and importlib.util.find_spec(needed) is None:
            continue
        module = importlib.import_module(name)
        for member in module.__all__:
            value = getattr(module, member)
            if not inspect.ismodule(value) and not isinstance(value, str):
                found[f"{name}.{member}"] = value
    return found


NAMES = public()
ERRORS = {n: v for n, v in NAMES.items() if isinstance(v, type) and issubclass(v, Exception)}
CLASSES = {n: v for n, v in NAMES.items() if isinstance(v, type) and n not in ERRORS}


@pytest.mark.parametrize(("owner", "names"), CONTRACT.items(), ids=lambda x: getattr(x, "__name__", ""))
def test_the_contract_is_kept(owner, names):
    assert not [name for name in names.split() if not hasattr(owner, name)]


def test_public_names_are_listed_in_order():
    assert list(gf.__all__) == sorted(gf.__all__)
    internal = {"BoxBound", "CandidateSearch", "ProductBound", "TIE", "TriangleTree"}
    assert set(gf._core.__all__) - internal <= set(gf.__all__)


@pytest.mark.parametrize("name", [n for n in NAMES if n not in ERRORS])
def test_a_docstring_says_what_threads_may_do(name):
    assert re.search(r"\bthreads?\b", NAMES[name].__doc__ or "", re.IGNORECASE)


POSITIONS = [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)]
NORMALS = [(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0)]
WEIGHT = [0, 0, -5, 0, 0, 0]
PINCH = "contacts: [{position: [-1, 0], normal: [1, 0]}, {position: [1, 0], normal: [-1, 0]}]\n"
DISC = """
contacts:
  - {curve: {kind: ellipse, semi_x: 1, semi_y: 1}, initial: 0, step: 0.5, tolerance: 0.1, bounds: [0, 1]}
  - {curve: {kind: ellipse, semi_x: 1, semi_y: 1}, initial: 2, step: 0.5, tolerance: 0.1, bounds: [1, 4]}
"""


def grasp(**options):
    return gf.Grasp(POSITIONS, NORMALS, friction=0.6, max_normal_force=20.0, length_scale=0.04, **options)


def rim():
    return gf.surfaces.contacts_on(*[gf.surfaces.ellipse(0.1, 0.08)] * 2)


def many_forces():
    return gf.forces_many(
        [POSITIONS] * 2, [NORMALS, np.zeros((3, 3))], [WEIGHT], infeasible="nearest", gradient=True
    )


BOUNDS = [(0, 1), (1, 4)]
SEARCH = {"step": 0.5, "tolerance": 0.1, "bounds": BOUNDS}


def box():
    trimesh = pytest.importorskip("trimesh")
    return gf.surfaces.MeshSurface(trimesh.creation.box((0.06, 0.04, 0.02)))


def file_of(text, load, folder):
    pytest.importorskip("pydantic")
    path = folder / "file.yaml"
    path.write_text(text)
    return getattr(importlib.import_module("graspforce.files"), load)(path)


def mesh_plan(folder):
    pytest.importorskip("trimesh").creation.box((0.06, 0.04, 0.02)).export(folder / "box.stl")
    return file_of("mesh: box.stl\nstarts: 2\n", "load_problem", folder)


def small_hand():
    mujoco = pytest.importorskip("mujoco", minversion="4")
    finger = (
        '<body name="f{0}" pos="{1} 0 0">'
        '<joint name="j{0}" axis="0 1 0" range="-1 1" actuatorfrcrange="-1 1"/>'
        '<geom name="tip{0}" type="capsule" size="0.01" fromto="0 0 0 0 0 0.08"/></body>'
    )
    fingers = finger.format(0, -0.03) + finger.format(1, 0.03)
    text = f'<mujoco><worldbody><body name="palm">{fingers}</body></worldbody></mujoco>'
    return gf.hands.Hand(mujoco.MjSpec.from_string(text.replace("<worldbody>", RADIANS)), ["tip0", "tip1"])


RADIANS = '<compiler angle="radian"/><worldbody>'
TWO = gf.Grasp([(0.02, 0, 0), (-0.02, 0, 0)], [(-1, 0, 0), (1, 0, 0)], friction=0.6, torsion=0.02)


def hand_plan():
    zero, measures = np.zeros(2), [2.0, 1e-5, 0.0, 0.0, 0.1, 0.005, 1.5]
    return gf.hands.HandPlan(
        small_hand(), (0, 1), np.eye(4), zero, zero, TWO, TWO.quality("max"), np.ones((2, 4)),
        np.zeros(6), np.ones((2, 3, 2)), *measures,
    )  # fmt: skip


MADE = {
    "graspforce.hands.Hand": lambda _: small_hand(),
    "graspforce.hands.Fingertip": lambda _: small_hand().fingertips[0],
    "graspforce.hands.HandPlan": lambda _: hand_plan(),
    "graspforce.hands.HandPlanSet": lambda _: gf.hands.HandPlanSet(
        (hand_plan(),), {"tried": 60, "usable": 20}, "done", 0.5
    ),
    "graspforce.hands.HandPose": lambda _: gf.hands.HandPose(
        small_hand(), np.eye(4), np.zeros(2), (1, 0), 1e-5, 1e-3, 0.005
    ),
    "graspforce.hands.Trial": lambda _: gf.hands.Trial(
        np.ones(6, bool), np.zeros(6), np.zeros(6), 1e-4, 1e-3, np.ones(3), 0.1, 0, "squeeze"
    ),
    "graspforce.Grasp": lambda _: grasp(torsion=0.01),
    "graspforce.Quality": lambda _: grasp().quality("max"),
    "graspforce.Gradient": lambda _: grasp().quality("max").gradient,
    "graspforce.QualityBatch": lambda _: gf.quality_many([POSITIONS] * 2, [NORMALS, np.zeros((3, 3))]),
    "graspforce.GradientBatch": lambda _: (
        gf.quality_many([POSITIONS] * 2, [NORMALS, np.zeros((3, 3))], gradient=True).gradient
    ),
    "graspforce.BundleBatch": lambda _: (
        gf.quality_many([POSITIONS] * 2, [NORMALS, np.zeros((3, 3))], bundle=3).bundle
    ),
    "graspforce.MinkowskiSum": lambda _: grasp(edges=3).minkowski_sum(),
    "graspforce.ForceDistributor": lambda _: gf.ForceDistributor(
        grasp(), "sum", weight=0.0, min_normal=0.01, rtol=1e-8
    ),
    "graspforce.ForceSolution": lambda _: gf.ForceDistributor(grasp()).solve(WEIGHT),
    "graspforce.ForceBatch": lambda _: gf.ForceDistributor(grasp()).solve_many([WEIGHT, [np.nan] * 6]),
    "graspforce.GraspForces": lambda _: many_forces(),
    "graspforce.ForceGradients": lambda _: many_forces().gradient,
    "graspforce.surrogates.SurrogateBatch": lambda _: gf.surrogates.min_weight(
        [POSITIONS] * 2, [NORMALS, np.zeros((3, 3))]
    ),
    "graspforce.ForceSteps": lambda _: gf.ForceDistributor(grasp()).solve_iter([WEIGHT, WEIGHT]),
    "graspforce.Status": lambda _: gf.Status.SOLVED,
    "graspforce.Plan": lambda _: gf.plan(rim(), [0, 2], **SEARCH),
    "graspforce.Iterate": lambda _: gf.plan(rim(), [0, 2], **SEARCH).history[0],
    "graspforce.PlanSet": lambda _: gf.plan_multistart(rim(), **SEARCH, starts=4),
    "graspforce.Refinement": lambda _: gf.refine(rim(), [0, 3], BOUNDS),
    "graspforce.GlobalOptimum": lambda _: gf.plan_global(rim(), BOUNDS, gap=0.2),
    "graspforce.PlacementNoise": lambda _: gf.PlacementNoise(position_std=0.001),
    "graspforce.PlacementQuality": lambda _: gf.PlacementNoise(0.001).quality([POSITIONS], [NORMALS]),
    "graspforce.FrictionBracket": lambda _: gf.least_friction(grasp()),
    "graspforce.ClosureProbability": lambda _: gf.probability_of_closure(grasp(), gf.PlacementNoise(0.001)),
    "graspforce.SupportRegion": lambda _: gf.support_region(
        gf.Grasp(POSITIONS, [(0, 0, 1)] * 3, max_normal_force=9.0), 9.0
    ),
    "graspforce.surfaces.PlanarCurve": lambda _: gf.surfaces.line((0, 0), (1, 0), object_side="left"),
    "graspforce.surfaces.ParametricSurface": lambda _: gf.surfaces.cylinder(0.1),
    "graspforce.surfaces.MeshSurface": lambda _: box(),
    "graspforce.surfaces.Arrangement": lambda _: gf.surfaces.contacts_on(
        *[gf.surfaces.ellipse(0.1, 0.08)] * 2
    ),
    "graspforce.adapters.ContactReading": lambda _: gf.adapters.ContactReading(
        grasp(), np.ones((3, 3)), (4, 5, 6)
    ),
    "graspforce.files.GraspFile": lambda folder: file_of(PINCH, "load_grasp", folder),
    "graspforce.files.PlanFile": lambda folder: file_of(DISC, "load_problem", folder),
    "graspforce.files.MeshPlanFile": mesh_plan,
    "graspforce.files.WrenchFile": lambda _: NAMES["graspforce.files.WrenchFile"](np.eye(3), np.arange(3.0)),
    "graspforce.viewer.ViewState": lambda _: NAMES["graspforce.viewer.ViewState"](grasp(), wrenches=[WEIGHT]),
}
NOT_COPIED = {"graspforce.viewer.Viewer": "a server with threads and sockets"}
NOT_JSON = {
    "graspforce.ForceSteps": "an iterator",
    "graspforce.Status": "a number",
    "graspforce.surfaces.PlanarCurve": "made of functions",
    "graspforce.surfaces.ParametricSurface": "made of functions",
    "graspforce.surfaces.MeshSurface": "a mesh, for which there are files",
    "graspforce.surfaces.Arrangement": "made of functions",
    "graspforce.files.GraspFile": "read from JSON or YAML; its grasp has to_dict",
    "graspforce.files.PlanFile": "read from JSON or YAML",
    "graspforce.files.MeshPlanFile": "read from JSON or YAML",
    "graspforce.files.WrenchFile": "two arrays, for which there are files",
    "graspforce.viewer.ViewState": "the state of a page; its grasp has to_dict",
}


def same(one, other):
    """Whether two objects hold the same, as deep as this test's objects go."""
    if isinstance(one, np.ndarray | float | int):
        return np.array_equal(one, other, equal_nan=np.asarray(one).dtype.kind == "f")
    if hasattr(one, "to_dict"):
        return json.dumps(one.to_dict()) == json.dumps(other.to_dict())
    if isinstance(one, gf.ForceSteps):
        return all(same(a, b) for a, b in zip(copy.deepcopy(one), other, strict=True))
    return repr(one) == repr(other) if type(one).__repr__ is not object.__repr__ else True


def test_every_public_class_is_walked():
    assert set(CLASSES) == {*(n for n in MADE if n in NAMES), *(n for n in NOT_COPIED if n in NAMES)}


@pytest.mark.parametrize("name", [n for n in MADE if n in NAMES])
def test_an_object_survives_pickles_and_deep_copies(name, tmp_path):
    made = MADE[name](tmp_path)
    assert type(made) is CLASSES[name]
    for again in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert type(again) is type(made)
        assert same(made, again)


@pytest.mark.parametrize("name", [n for n in MADE if n in NAMES and n not in NOT_JSON])
def test_an_object_can_be_written_as_json(name, tmp_path):
    made = MADE[name](tmp_path)
    assert json.loads(json.dumps(made.to_dict(), allow_nan=False))


@pytest.mark.parametrize("name", [n for n in MADE if n in NAMES])
def test_a_repr_reads_well(name, tmp_path):
    made = MADE[name](tmp_path)
    assert not re.search(r" object at 0x|\n", repr(made)) or name in NOT_JSON


@pytest.mark.parametrize("name", ["ForceSolution", "ForceBatch", "QualityBatch", "MinkowskiSum"])
def test_an_array_of_numbers_is_one_for_numpy(name, tmp_path):
    made = MADE[f"graspforce.{name}"](tmp_path)
    expected = {"QualityBatch": "epsilon", "MinkowskiSum": "wrenches"}.get(name, "forces")
    np.testing.assert_array_equal(np.asarray(made), getattr(made, expected))
    assert np.asarray(made, dtype=np.float32).dtype == np.float32
    copied = np.array(made)
    assert copied.flags.writeable
    copied[...] = 7.0
    assert not (np.asarray(made) == 7.0).any()


@pytest.mark.parametrize("name", [n for n in NAMES if hasattr(NAMES[n], "_repr_html_")])
def test_a_notebook_shows_a_table(name, tmp_path):
    shown = MADE[name](tmp_path)._repr_html_()
    assert shown.startswith("<table>")
    assert shown.count("<tr>") == shown.count("</tr>") > 1


@pytest.mark.parametrize("name", ERRORS)
def test_an_error_survives_pickles_with_what_it_says(name, tmp_path):
    kind = ERRORS[name]
    arguments = {
        "InvalidFileError": (tmp_path / "file.yaml", "mu: unknown field", 3),
        "MissingExtraError": ("plot", ImportError("no", name="matplotlib")),
    }.get(kind.__name__, ("why",))
    error = kind(*arguments)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again)) == (kind, str(error))
    assert getattr(again, "line", None) == getattr(error, "line", None)


def test_the_direction_of_an_infeasible_wrench_survives_pickles():
    with pytest.raises(gf.InfeasibleWrenchError) as caught:
        gf.ForceDistributor(gf.Grasp([(0, 0)], [(1, 0)])).solve([1, 0, 0])
    again = pickle.loads(pickle.dumps(caught.value))
    np.testing.assert_array_equal(again.direction, caught.value.direction)


def test_a_tampered_pickle_of_forces_is_refused():
    restore, state = MADE["graspforce.ForceSolution"](None).__reduce__()
    with pytest.raises(gf.InvalidInputError, match="lengths"):
        restore(state[0], state[1][:-1], *state[2:])


def test_threads_may_share_what_says_so():
    solution, batch = MADE["graspforce.ForceSolution"](None), MADE["graspforce.ForceBatch"](None)
    surface = rim()
    with ThreadPoolExecutor(8) as pool:
        forces = list(pool.map(lambda _: (solution.forces, batch.forces[0]), range(64)))
        plans = list(pool.map(lambda _: gf.plan(surface, [0, 2], **SEARCH).params, range(8)))
    assert all(np.array_equal(pair, forces[0]) for pair in forces)
    assert all(np.array_equal(params, plans[0]) for params in plans)
