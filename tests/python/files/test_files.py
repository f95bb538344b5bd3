"""Files of grasps, plans and wrenches: what is read, and that everything else is refused with its place."""

import errno
import json
import os
import zipfile

import numpy as np
import pytest

import graspforce as gf
from graspforce.files import load_grasp, load_mesh, load_problem, load_wrenches, parse_wrench

PINCH = "contacts:\n  - {position: [-1, 0], normal: [1, 0]}\n  - {position: [1, 0], normal: [-1, 0]}\n"
SPATIAL = "contacts:\n  - {position: [1, 0, 0], normal: [-1, 0, 0]}\n  - {position: [-1, 0, 0], normal: [1, 0, 0]}\n"
CURVE = """contacts:
  - curve: {kind: ellipse, semi_x: 1, semi_y: 1}
    initial: 0
    step: 0.5
    tolerance: 0.1
    bounds: [0, 1]
"""


@pytest.fixture
def write(tmp_path):
    def written(content, name="grasp.yaml"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return written


def test_yaml_json_and_npz_hold_the_same_grasp(write, tmp_path):
    contacts = [{"position": [-1, 0], "normal": [1, 0]}, {"position": [1, 0], "normal": [-1, 0]}]
    text = json.dumps({"contacts": contacts, "friction": 1e-1}, indent="\t")
    np.savez(tmp_path / "grasp.npz", positions=[(-1, 0), (1, 0)], normals=[(1, 0), (-1, 0)], friction=0.1)
    found = [
        load_grasp(path).grasp.primitive_wrenches
        for path in (write(PINCH + "friction: 1e-1\n"), write(text, "grasp.json"), tmp_path / "grasp.npz")
    ]
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_a_contact_overrides_what_the_file_says_of_all(write):
    text = (
        PINCH.replace("normal: [1, 0]", "normal: [1, 0], friction: 0, max_normal_force: 7")
        + "friction: 0.3\n"
    )
    grasp = load_grasp(write(text)).grasp
    assert grasp.friction.tolist() == [0, 0.3]
    assert grasp.max_normal_force.tolist() == [7, 1]


def test_every_argument_of_a_grasp_can_be_written(write):
    text = """
name: everything
contacts:
  - {position: [1, 0, 0], normal: [-1, 0, 0], torsion: 0.01, edges: 6, tangent: [0, 0, 1]}
  - {position: [-1, 0, 0], normal: [1, 0, 0], tangent: [0, 0, 1]}
torsion: 0.02
edges: 4
origin: [0, 0, 1]
length_scale: 0.5
friction_margin: 1.5
"""
    file = load_grasp(write(text))
    assert (file.name, file.grasp.force_dim, file.grasp.length_scale) == ("everything", 4, 0.5)
    assert file.grasp.origin.tolist() == [0, 0, 1]
    cones = load_grasp(write(text.replace("edges: 4", "edges: null").replace(", edges: 6", ""))).grasp
    assert cones.num_edges.tolist() == [0, 0]


BAD_GRASPS = {
    "syntax": ("contacts: [\n", r"grasp.yaml:2: not YAML"),
    "empty": ("", r"empty"),
    "a list": ("[1, 2]", r"grasp.yaml:1: "),
    "no contacts": ("friction: 1\n", r"grasp.yaml:1: contacts: "),
    "unknown field": (PINCH + "mu: 1\n", r"grasp.yaml:4: mu: unknown field"),
    "text for a number": (PINCH + "friction: half\n", r"yaml:4: friction: .*'half'"),
    "true for a number": (PINCH + "friction: true\n", r"yaml:4: friction: .*True"),
    "infinite": (PINCH + "friction: .inf\n", r"yaml:4: friction: "),
    "negative": (PINCH.replace("normal: [1, 0]", "normal: [1, 0], friction: -1"), r":2: contacts"),
    "mixed dimensions": (PINCH.replace("position: [1, 0]", "position: [1, 0, 0]"), r":3: contacts\[1\].position"),
    "zero normal": (PINCH.replace("[-1, 0]}\n", "[0, 0]}\n"), r":3: contacts\[1\].normal: .*no direction"),
    "given twice": (PINCH + "friction: 1\nfriction: 2\n", r"yaml:5: friction: given twice"),
    "alias": ("a: &x [1]\nb: *x\n", r"yaml:2: aliases"),
    "object": ("contacts: !!python/object/apply:os.system ['true']\n", r":1: tags \(.*os.system\) are not read"),
    "a bool that is none": (PINCH + "friction: !!bool maybe\n", r"yaml:4: tags \(.*bool\) are not read"),
    "a time that is none": (PINCH + "name: !!timestamp x\n", r"yaml:4: tags \(.*timestamp\) are not read"),
    "a tagged list": (PINCH + "outline: !own [[0, 1]]\n", r"yaml:4: tags \(!own\) are not read"),
    "too deep": ("[" * 100_000, r"grasp.yaml:1: "),
    "too large": (" " * 1_000_001, r"larger than"),
    "huge integer": (PINCH + "friction: " + "9" * 5000 + "\n", r"grasp.yaml"),
    "not text": (b"\xff\xfe\x00", r"UTF-8"),
    "half of the tangents": (SPATIAL.replace("]}\n", "], tangent: [0, 1, 0]}\n", 1), r":3: contacts\[1\].tangent: missing"),
    "edges of a true cone": (SPATIAL.replace("]}\n", "], edges: 5}\n", 1) + "edges: null\n", r":2: .*edges"),
}  # fmt: skip


@pytest.mark.parametrize(("content", "message"), BAD_GRASPS.values(), ids=BAD_GRASPS)
def test_an_unusable_grasp_file_is_refused_with_its_place(write, content, message):
    with pytest.raises(gf.InvalidFileError, match=message):
        load_grasp(write(content))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"contacts": [}', r"json:1: not JSON"),
        ('{"friction": NaN}', r"NaN"),
        ("[" * 100_000, r"not JSON"),
        ('{\n\t"contacts": [],\n\t"mu": 1\n}', r"json:2: contacts"),
    ],
)
def test_unusable_json_is_refused_with_its_place(write, content, message):
    with pytest.raises(gf.InvalidFileError, match=message):
        load_grasp(write(content, "grasp.json"))


def test_all_mistakes_are_reported_at_once(write):
    with pytest.raises(gf.InvalidFileError) as caught:
        load_grasp(write(PINCH + "friction: -1\nlength_scale: 0\n"))
    assert caught.value.line == 4
    assert "yaml:5: length_scale" in str(caught.value)


def test_an_npz_with_pickles_or_strangers_is_refused(tmp_path, write):
    arrays = {"positions": [(-1, 0), (1, 0)], "normals": [(1, 0), (-1, 0)]}
    for extra in ({"friction": np.array([object()])}, {"mu": 1}):
        np.savez(tmp_path / "bad.npz", **arrays, **extra)
        with pytest.raises(gf.InvalidFileError, match=r"bad.npz: (not plain arrays|mu: unknown)"):
            load_grasp(tmp_path / "bad.npz")
    np.savez(tmp_path / "half.npz", positions=arrays["positions"])
    with pytest.raises(gf.InvalidFileError, match="normals: missing"):
        load_grasp(tmp_path / "half.npz")
    with pytest.raises(gf.InvalidFileError, match="not an NPZ"):
        load_grasp(write("no archive", "text.npz"))


def test_a_grasp_and_a_plan_that_are_mixed_up_are_told_apart(write):
    with pytest.raises(gf.InvalidFileError, match="a plan file, not a grasp file"):
        load_grasp(write(CURVE))
    with pytest.raises(gf.InvalidFileError, match="a grasp file, not a plan file"):
        load_problem(write(PINCH))


def test_a_long_value_is_cut_short(write):
    with pytest.raises(gf.InvalidFileError, match=r"expected fields.* given '1, 1, .* \.\.\.$"):
        load_grasp(write("'" + "1, " * 1000 + "'"))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(gf.InvalidFileError, match=f"nowhere.yaml: {os.strerror(errno.ENOENT)}"):
        load_grasp(tmp_path / "nowhere.yaml")


def test_a_plan_file_is_the_same_problem_as_its_arguments(write):
    text = CURVE + CURVE.removeprefix("contacts:\n").replace("initial: 0", "initial: 2").replace(
        "[0, 1]", "[1, 4]"
    )
    rim = gf.surfaces.ellipse(1, 1)
    expected = gf.plan(
        gf.surfaces.contacts_on(rim, rim), [0, 2], step=0.5, tolerance=0.1, bounds=[(0, 1), (1, 4)],
        max_normal_force=1.0,
    )  # fmt: skip
    found, expected = load_problem(write(text)).plan().to_dict(), expected.to_dict()
    # How many candidates need a polytope depends on which thread is first.
    assert found.pop("counts")["candidates"] == expected.pop("counts")["candidates"]
    assert found == expected


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("initial: 0", "initial: 3", r":3: contacts\[0\].initial: .*outside"),
        ("[0, 1]", "[1, 0]", r":6: contacts\[0\].bounds: .*above"),
        ("kind: ellipse", "kind: spiral", r":2: .*kind"),
        ("semi_x: 1", "semi_x: 0", r":2: .*semi_x"),
        ("step: 0.5", "step: 0", r":4: contacts\[0\].step"),
    ],
)
def test_an_unusable_plan_file_is_refused_with_its_place(write, old, new, message):
    with pytest.raises(gf.InvalidFileError, match=message):
        load_problem(write(CURVE.replace(old, new)))


def test_a_line_is_a_curve_too(write):
    text = CURVE.replace(
        "{kind: ellipse, semi_x: 1, semi_y: 1}",
        "{kind: line, start: [0, 0], direction: [1, 0], object_side: left}",
    )
    assert load_problem(write(text)).places[0].normals(np.zeros(1)).tolist() == [[0, 1]]


def test_csv_with_and_without_names_and_npy_hold_the_same_wrenches(write, tmp_path):
    expected = [[1.0, 2, 3], [4, 5, 6]]
    np.save(tmp_path / "w.npy", np.array(expected, dtype=np.float32))
    plain = load_wrenches(write("# comment\n1,2,3\n\n4, 5, 6\n", "a.csv"), 3)
    named = load_wrenches(write("t,fx,fy,tau\n0,1,2,3\n1,4,5,6\n", "b.csv"), 3)
    assert plain.wrenches.tolist() == named.wrenches.tolist() == expected
    assert load_wrenches(tmp_path / "w.npy", 3).wrenches.tolist() == expected
    assert plain.times is None
    assert named.times.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1,2,3\n1,2\n", r"csv:2: 2 columns, expected 3"),
        ("fx,fy,tau\n1,x,3\n", r"csv:2: fy: 'x'"),
        ("a,b,c\n1,2,3\n", r"csv:1: columns a,b,c, expected fx,fy,tau or t,fx,fy,tau"),
        ("1,2,nan\n", r"csv:1: tau: 'nan' is not a finite number"),
        ("# nothing\n", r"no wrenches"),
        (b"\xff\xfe", r"UTF-8"),
    ],
)
def test_unusable_wrenches_are_refused_with_their_line(write, content, message):
    with pytest.raises(gf.InvalidFileError, match=message):
        load_wrenches(write(content, "w.csv"), 3)


def test_an_npy_with_pickles_or_a_false_header_is_refused(write, tmp_path):
    np.save(tmp_path / "objects.npy", np.array([object()]), allow_pickle=True)
    with pytest.raises(gf.InvalidFileError, match=r"objects.npy: not an array"):
        load_wrenches(tmp_path / "objects.npy", 3)
    np.save(tmp_path / "small.npy", np.zeros((2, 3)))
    claimed = (tmp_path / "small.npy").read_bytes().replace(b"(2, 3)", b"(9999999999, 3)", 1)
    with pytest.raises(gf.InvalidFileError, match="not an array"):
        load_wrenches(write(claimed.replace(b"         }", b"}", 1), "large.npy"), 3)
    with pytest.raises(gf.InvalidFileError, match=r"shape \(2, 3\), expected \(T, 6\)"):
        load_wrenches(tmp_path / "small.npy", 6)


def test_a_mesh_is_read_and_a_broken_one_refused(write):
    tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    vertices, faces = load_mesh(write(tetrahedron, "t.obj"))
    assert (vertices.shape, faces.shape) == ((4, 3), (4, 3))
    for content, name in (("", "empty.obj"), ("junk", "t.stl"), ("x", "t.exe")):
        with pytest.raises(gf.InvalidFileError, match=name):
            load_mesh(write(content, name))


CONTACTS = [{"position": [-1, 0], "normal": [1, 0]}, {"position": [1, 0], "normal": [-1, 0]}]
FACE = "\N{GRINNING FACE}"


@pytest.mark.parametrize("ensure_ascii", [True, False])
def test_characters_beyond_the_basic_plane_are_read_however_json_writes_them(write, ensure_ascii):
    def text(**content):
        return json.dumps({**content, "contacts": CONTACTS}, indent=1, ensure_ascii=ensure_ascii)

    assert load_grasp(write(text(name=f"cup {FACE}"), "grasp.json")).name == f"cup {FACE}"
    with pytest.raises(gf.InvalidFileError, match=f"json:3: {FACE}: unknown field"):
        load_grasp(write(text(name=FACE, **{FACE: 1}), "grasp.json"))


@pytest.mark.parametrize("name", [r"\ud83d", r"\ude00", r"\\ud83d\ude00", r"\ud83d \ude00"])
def test_half_a_pair_of_surrogates_is_refused(write, name):
    text = json.dumps({"contacts": CONTACTS, "name": "half"}).replace("half", name)
    with pytest.raises(gf.InvalidFileError, match=r"grasp\.json"):
        load_grasp(write(text, "grasp.json"))


def test_backslashes_are_no_surrogates(write):
    name = r"\ud83d\ude00"
    text = json.dumps({"contacts": CONTACTS, "name": name})
    assert load_grasp(write(text, "grasp.json")).name == name


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"friction_margin": [1.0, 2.0]}, "friction_margin"),
        ({"friction_margin": "a"}, "friction_margin"),
        ({"edges": [8.5, 8]}, "edges"),
        ({"length_scale": [1.0, 2.0]}, "length_scale"),
        ({"friction": 1j}, "friction"),
        ({"origin": "a"}, "origin"),
    ],
)
def test_an_npz_with_numbers_of_another_kind_is_refused(tmp_path, arrays, message):
    pair = {"positions": [(-1, 0), (1, 0)], "normals": [(1, 0), (-1, 0)]}
    np.savez(tmp_path / "bad.npz", **pair, **{name: np.array(value) for name, value in arrays.items()})
    with pytest.raises(gf.InvalidFileError, match=rf"bad\.npz: .*{message}"):
        load_grasp(tmp_path / "bad.npz")


def test_a_member_of_an_npz_that_is_no_array_is_refused(tmp_path):
    path = tmp_path / "bad.npz"
    np.savez(path, positions=[(-1, 0), (1, 0)], normals=[(1, 0), (-1, 0)])
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("friction.npy", b"0.5")
    with pytest.raises(gf.InvalidFileError, match=r"bad\.npz: friction: not an array"):
        load_grasp(path)


@pytest.mark.parametrize("dim", [4, 0, "3", 3.0])
def test_wrenches_have_three_components_or_six(dim):
    with pytest.raises(gf.InvalidInputError, match="wrench_dim: "):
        load_wrenches("none.csv", dim)
    with pytest.raises(gf.InvalidInputError, match="wrench_dim: "):
        parse_wrench("1 2 3 4", dim)
