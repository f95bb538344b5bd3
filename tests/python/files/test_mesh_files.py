"""Meshes in grasp and plan files and on the command line."""

import errno
import json
import os

import numpy as np
import pytest
from support.plan_files import SURFACES

import graspforce as gf
from graspforce.cli.exit_codes import DONE, MISUSED
from graspforce.cli.main import main
from graspforce.files import MeshPlanFile, load_grasp, load_problem
from graspforce.surfaces import MeshSurface, contacts_on, cylinder, ellipsoid, plane

trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'")

# The words of the system, not ours.
NO_SUCH_FILE = os.strerror(errno.ENOENT)

PINCH = """
mesh: {file: box.ply, unit: mm, normals: face}
length_scale: 0.03
contacts:
"""


@pytest.fixture
def call(capsys):
    def called(*arguments, code=DONE):
        assert main([str(argument) for argument in arguments]) == code
        return capsys.readouterr()

    return called


def test_a_point_is_projected_and_takes_the_inward_normal(write):
    file = load_grasp(write(PINCH + "  - {point: [0.1, 0.01, 0]}\n  - {point: [-0.04, 0, 0.005]}\n"))
    np.testing.assert_allclose(file.grasp.positions, [[0.03, 0.01, 0], [-0.03, 0, 0.005]], atol=1e-12)
    np.testing.assert_allclose(file.grasp.normals, [[-1, 0, 0], [1, 0, 0]], atol=1e-12)


def test_a_position_stays_where_it_is_and_a_normal_given_wins(write):
    text = "  - {position: [0.031, 0, 0]}\n  - {position: [-0.03, 0, 0], normal: [1, 0.1, 0]}\n"
    grasp = load_grasp(write(PINCH + text)).grasp
    assert grasp.positions.tolist() == [[0.031, 0, 0], [-0.03, 0, 0]]
    np.testing.assert_allclose(grasp.normals[0], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(grasp.normals[1], np.array([1, 0.1, 0]) / np.hypot(1, 0.1))


def test_barycentric_coordinates_are_weights_of_a_face_of_the_file(folder, write):
    mesh = trimesh.load_mesh(folder / "box.ply")
    text = "  - {face: 3, barycentric: [0.2, 0.3, 0.5]}\n  - {face: 0, barycentric: [1, 0, 0]}\n"
    grasp = load_grasp(write(PINCH + text)).grasp
    expected = np.array([0.2, 0.3, 0.5]) @ mesh.triangles[3] / 1000
    np.testing.assert_allclose(grasp.positions[0], expected, atol=1e-12)
    np.testing.assert_allclose(grasp.normals, -mesh.face_normals[[3, 0]], atol=1e-12)


def test_the_mesh_of_a_file_is_scaled_for_pictures(write):
    file = load_grasp(write(PINCH + "  - {position: [0.03, 0, 0], normal: [-1, 0, 0]}\n"))
    assert file.surface is None
    np.testing.assert_allclose(np.ptp(file.object_mesh()[0], axis=0), [0.06, 0.04, 0.02])


BAD = {
    "no mesh": ("contacts:\n  - {position: [1, 0, 0]}\n", r":2: contacts\[0\]: no normal"),
    "no place": (PINCH + "  - {friction: 1}\n", r":5: contacts\[0\]: .*none of them"),
    "two places": (PINCH + "  - {point: [0, 0, 1], face: 2}\n", r":5: contacts\[0\]: .*`point` and `face`"),
    "half a place": (PINCH + "  - {face: 2}\n", r":5: contacts\[0\]: .*given is `face`"),
    "no such face": (PINCH + "  - {face: 12, barycentric: [1, 0, 0]}\n", r":5: .*face: 12, expected 0 to 11"),
    "no place on a face": (
        PINCH + "  - {face: 1, barycentric: [1, 1, 0]}\n", r":5: contacts\[0\].barycentric: .*sum 1"),
    "millimetres": (PINCH + "  - {point: [30, 0, 0]}\n", r":5: contacts\[0\].point: .*positions in m"),
    "planar": (PINCH + "  - {position: [0.03, 0]}\n", r":5: contacts\[0\].position: 2 numbers"),
    "wrong unit": (
        PINCH.replace("mm", "m") + "  - {point: [0, 0, 1]}\n", r":2: mesh.unit: .*give the unit"),
    "unknown unit": (PINCH.replace("mm", "inch") + "  - {point: [0, 0, 1]}\n", r":2: mesh.unit: .*'inch'"),
    "no such mesh": (
        PINCH.replace("box.ply", "b.ply") + "  - {point: [0, 0, 1]}\n", f"b.ply: {NO_SUCH_FILE}"),
    "number for a mesh": ("mesh: 3\ncontacts: [{point: [0, 0, 1]}]\n", r":1: mesh: "),
}  # fmt: skip


@pytest.mark.parametrize(("content", "message"), BAD.values(), ids=BAD)
def test_an_unusable_contact_on_a_mesh_is_refused_with_its_place(write, content, message):
    with pytest.raises(gf.InvalidFileError, match=message):
        load_grasp(write(content))


def test_a_mesh_with_holes_is_refused_unless_the_file_allows_it(folder, write):
    box = trimesh.creation.box((0.06, 0.04, 0.02))
    trimesh.Trimesh(box.vertices, box.faces[1:], process=False).export(folder / "open.off")
    text = "mesh: {file: open.off}\ncontacts:\n  - {point: [0.03, 0, 0]}\n"
    with pytest.raises(gf.InvalidFileError, match=r":1: mesh.file: not watertight.*check_watertight: false"):
        load_grasp(write(text))
    load_grasp(write(text.replace("off}", "off, check_watertight: false}")))


def test_a_plan_file_on_a_mesh_is_the_same_search_as_its_arguments(folder, write):
    text = """
mesh: egg.stl
contacts: 2
edges: null
torsion: 0.005
friction: 0.7
length_scale: 0.03
starts: 4
best: 2
step: 0.02
tolerance: 0.01
min_distance: 0.01
refine: false
seed: 3
"""
    file = load_problem(write(text, "plan.yaml"))
    egg = MeshSurface.load(folder / "egg.stl")
    expected = gf.plan_multistart(
        contacts_on(egg, egg), np.tile(egg.bounds, (2, 1)), step=0.02, tolerance=0.01, starts=4, best=2,
        min_distance=0.01, seed=3, rtol=1e-4, edges=None, torsion=0.005, friction=0.7, length_scale=0.03,
        origin=egg.center,
    )  # fmt: skip
    found = file.plan()
    assert found.best.params.tolist() == expected.best.params.tolist()
    assert found.best.quality.epsilon == expected.best.quality.epsilon


def test_refinement_never_loses_and_is_the_last_iterate(write):
    text = "mesh: egg.stl\nstarts: 4\nbest: 1\nstep: 0.02\ntolerance: 0.01\nrefine: {}\n"
    plain = load_problem(write(text.format("false"), "plan.yaml")).plan().best
    better = load_problem(write(text.format("true"), "plan.yaml")).plan().best
    assert better.quality.epsilon >= plain.quality.epsilon
    assert better.history[-1].rho == better.quality.rho
    assert len(better.history) == len(plain.history) + 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("contacts: 2", "contacts: 1", r":2: contacts: .*given 1"),
        ("contacts: 2", "contacts: []", r":2: contacts: "),
        ("starts: 4", "starts: 0", r":3: starts: "),
        ("starts: 4", "bounds: [0, 1]", r":3: bounds: unknown field"),
        ("egg.stl", "none.stl", f"none.stl: {NO_SUCH_FILE}"),
    ],
)
def test_an_unusable_plan_on_a_mesh_is_refused_with_its_place(write, old, new, message):
    text = "mesh: egg.stl\ncontacts: 2\nstarts: 4\n".replace(old, new)
    with pytest.raises(gf.InvalidFileError, match=message):
        load_problem(write(text, "plan.yaml"))


def test_a_plan_file_puts_contacts_on_spatial_surfaces(write):
    places = (
        plane((0, 0, 0.1), (1, 0, 0), (0, 1, 0), object_side="against"),
        ellipsoid(0.05, 0.05, 0.1),
        cylinder(0.05),
    )
    expected = gf.plan(
        contacts_on(*places), [0, 0.01, 0, -1, 3, 0], step=[0.02, 0.02, 0.5, 0.4, 0.4, 0.4],
        tolerance=[0.01, 0.005, 0.1, 0.1, 0.1, 0.1], edges=6, max_normal_force=1.0,
        bounds=[(-0.05, 0.05), (-0.04, 0.04), (-3, 3), (-1.5, 0), (1, 5), (-0.05, 0.05)],
    )  # fmt: skip
    # How many candidates are rejected depends on the timing of threads, the plan does not.
    plans = [load_problem(write(SURFACES, "plan.yaml")).plan().to_dict(), expected.to_dict()]
    counts = [plan.pop("counts")["candidates"] for plan in plans]
    assert plans[0] == plans[1]
    assert counts[0] == counts[1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("v: [0, 1, 0]", "v: [2, 0, 0]", r":4: contacts\[0\].surface: .*span no plane"),
        ("initial: [0, 0.01]", "initial: 0", r":5: contacts\[0\].initial: 1 given, expected 2: one for each"),
        ("initial: [0, 0.01]", "initial: [0, 1]", r":5: contacts\[0\].initial: 1.0 is outside"),
        ("[[1, 5], [-0.05, 0.05]]", "[1, 5]", r":18: contacts\[2\].bounds: 1 given, expected 2"),
        ("[[1, 5], [-0.05, 0.05]]", "[[1, 5], 3]", r":18: contacts\[2\].bounds"),
        ("kind: cylinder, radius: 0.05", "kind: torus", r":14: contacts\[2\].surface: "),
        ("surface: {kind: cylinder, radius: 0.05}", "friction: 1", r":14: contacts\[2\]: give either"),
        (
            "surface: {kind: cylinder, radius: 0.05}",
            "curve: {kind: ellipse, semi_x: 1, semi_y: 1}",
            r":14: contacts\[2\]: curves are planar",
        ),
    ],
)
def test_an_unusable_surface_is_refused_with_its_place(write, old, new, message):
    with pytest.raises(gf.InvalidFileError, match=message):
        load_problem(write(SURFACES.replace(old, new), "plan.yaml"))


AT = ("--at", "0.03,0,0", "--at", "-0.03,0.01,0", "--at", "0,0.02,0.002")


def test_a_mesh_on_the_command_line_is_the_grasp_file_that_says_the_same(folder, write, call):
    text = PINCH.replace(", normals: face", "")
    text += "".join(f"  - {{point: [{point}]}}\n" for point in AT[1::2])
    options = ("--unit", "mm", *AT, "--length-scale", "0.03", "--json")
    mesh = json.loads(call("quality", folder / "box.ply", *options).out)
    file = json.loads(call("quality", write(text), "--json").out)
    assert mesh["rho_max"] == file["rho_max"]
    true = json.loads(call("quality", folder / "box.ply", *options, "--edges", "0").out)
    assert true["grasp"]["num_edges"] == [0, 0, 0]
    wrench = ("--wrench", "0,0,-0.1,0,0,0", "--json", "--friction", "0.8")
    forces = json.loads(call("forces", folder / "box.ply", "--unit", "mm", *AT, *wrench).out)
    np.testing.assert_allclose(np.sum(forces["world_forces"], axis=0), [0, 0, 0.1], atol=1e-9)


def test_a_plan_on_a_mesh_can_be_measured_again_and_drawn(folder, call):
    out, picture = folder / "new" / "best.json", folder / "best.png"
    out.parent.mkdir(exist_ok=True)
    search = ("--starts", "3", "--best", "2", "--no-refine", "--contacts", "3", "--friction", "0.8")
    printed = call("plan", folder / "egg.stl", *search, "--out", out, "--plot", picture, "--json").out
    found = json.loads(printed)
    assert found["plans"][0]["quality"]["epsilon"] >= found["plans"][1]["quality"]["epsilon"]
    again = json.loads(call("quality", out, "--json", "--plot", folder / "again.png").out)
    epsilon = found["plans"][0]["quality"]["epsilon"]
    assert again["rho_max"]["epsilon"] == pytest.approx(epsilon, rel=1e-3)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert f"{epsilon:.9g}" in call("plan", folder / "egg.stl", *search).out


def test_a_plan_on_curves_can_be_measured_again(folder, write, call):
    text = """
friction: 0.4
contacts:
  - {curve: {kind: ellipse, semi_x: 1, semi_y: 1}, initial: 0, step: 0.5, tolerance: 0.1, bounds: [0, 1]}
  - {curve: {kind: ellipse, semi_x: 1, semi_y: 1}, initial: 2, step: 0.5, tolerance: 0.1, bounds: [1, 4], friction: 0.6}
"""  # noqa: E501
    found = json.loads(call("plan", write(text), "--out", folder / "b.json", "--json").out)
    again = json.loads(call("quality", folder / "b.json", "--json").out)
    assert again["rho_max"]["epsilon"] == pytest.approx(found["quality"]["epsilon"], rel=1e-9)


def test_options_of_a_mesh_and_of_a_file_are_not_mixed(folder, write, call):
    grasp = write(PINCH + "  - {point: [0.03, 0, 0]}\n")
    assert "only with a mesh" in call("quality", grasp, "--friction", "1", code=MISUSED).err
    assert "only with a mesh" in call("plan", grasp, "--no-refine", code=MISUSED).err
    assert "--at" in call("quality", folder / "box.ply", "--unit", "mm", code=MISUSED).err
    mesh = (folder / "box.ply", "--unit", "mm")
    assert "--at" in call("quality", *mesh, "--at", "1,1,1", code=MISUSED).err
    assert "'x'" in call("quality", *mesh, "--at", "x,1,1", code=MISUSED).err
    assert "--contacts" in call("plan", *mesh, "--contacts", "1", code=MISUSED).err


def test_the_schema_of_plans_on_meshes_is_printed(call):
    assert "starts" in json.loads(call("info", "--schema", "mesh-plan").out)["properties"]
    assert isinstance(MeshPlanFile.__doc__, str)


def test_a_mesh_that_the_user_names_may_lie_behind_a_link_and_have_any_name(folder, tmp_path_factory, call):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "box.ply").symlink_to(folder / "box.ply")
    (elsewhere / "left:box.ply").symlink_to(folder / "box.ply")
    for name in ("box.ply", "left:box.ply"):
        options = ("--unit", "mm", *AT, "--json")
        assert json.loads(call("quality", elsewhere / name, *options).out)["grasp"]["num_contacts"] == 3
        search = ("--unit", "mm", "--starts", "2", "--best", "1", "--no-refine")
        call("plan", elsewhere / name, *search, "--out", elsewhere / "best.json")
        call("quality", elsewhere / "best.json", "--plot", elsewhere / "again.png")
