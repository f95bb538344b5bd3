"""Grasp files that are written: read again they are the same grasps, wherever their meshes lay."""

import json

import numpy as np
import pytest

import graspforce as gf
from graspforce.files import load_grasp, save_grasp

TRIANGLE = [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0.01)]
INWARD = [(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0.1)]
FLAT = [(-1.0, 0.0), (1.0, 0.5)], [(3.0, 0.0), (-1.0, 0.1)]
LISTED = [[(1, 0.2, 0), (1, -0.1, 0.1), (0.5, 0, -0.2)], [(1, 0, 0)], [(2, 0.1, 0.1), (1, 0, -0.3)]]

GRASPS = {
    "planar": gf.Grasp(*FLAT, friction=0.4),
    "planar with other edges": gf.Grasp(*FLAT, friction=[0.4, 0.2], edges=[2, 5]),
    "planar as true cones": gf.Grasp(*FLAT, edges=None, origin=(0.1, -0.2)),
    "planar with listed forces": gf.Grasp(*FLAT, extreme_forces=[[(1, 0.3), (1, -0.1)], [(2, 0)]]),
    "one for all": gf.Grasp(TRIANGLE, INWARD, friction=0.6, max_normal_force=20, edges=6, length_scale=0.04),
    "one for each": gf.Grasp(
        TRIANGLE, INWARD, friction=np.array([0.6, 0.5, 0.4]), max_normal_force=[20, 10, 20], edges=[3, 8, 5],
        torsion=[0, 0.01, 0.02], origin=(0, 0, 0.1), friction_margin=1.5,
    ),
    "tangents": gf.Grasp(TRIANGLE, INWARD, edges=3, tangents=[(0, 0, 1), (0.1, 0, 1), (1, 0, 1)]),
    "true cones": gf.Grasp(TRIANGLE, INWARD, edges=None, torsion=0.01),
    "listed forces": gf.Grasp(TRIANGLE, INWARD, edges=None, extreme_forces=LISTED),
    "no numbers of few digits": gf.Grasp(np.array(TRIANGLE) / 3, np.array(INWARD) / 7, friction=1 / 3),
}  # fmt: skip


@pytest.mark.parametrize("grasp", GRASPS.values(), ids=GRASPS)
def test_a_grasp_read_again_is_the_same_to_the_last_bit(tmp_path, grasp):
    save_grasp(str(tmp_path / "new" / "grasp.json"), grasp, name="cup \N{GRINNING FACE}")
    file = load_grasp(tmp_path / "new" / "grasp.json")
    assert file.name == "cup \N{GRINNING FACE}"
    again, given = file.grasp.to_dict(), grasp.to_dict()
    # The edges that listed forces ignore are nobody's.
    if grasp.wrench_dim == 6 and given["edges"] is not None and given["extreme_forces"] is not None:
        del again["edges"], given["edges"]
    assert again == given
    for criterion in ("max", "sum"):
        assert file.grasp.quality(criterion).to_dict() == grasp.quality(criterion).to_dict()


@pytest.mark.parametrize("grasp", GRASPS.values(), ids=GRASPS)
def test_the_dictionary_of_a_grasp_is_a_grasp_file(tmp_path, grasp):
    path = tmp_path / "grasp.json"
    path.write_text(json.dumps(grasp.to_dict()))
    assert gf.load_grasp(path).grasp.to_dict() == grasp.to_dict()
    assert gf.load_grasp(path).name == "grasp.json"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"normals": [[3.0, 0.0]]}, r"normals: .*2"),
        ({"friction": [0.4, -0.4]}, r"friction\[1\]: -0.4"),
        ({"friction": "0.4"}, "friction: expected a list or a number, given '0.4'"),
        ({"num_contacts": 3}, "num_contacts: 3, but the contacts make it 2"),
        ({"wrench": [0, 0, 1]}, "wrench: unknown field"),
        ({"edges": 70000}, "edges: must be at most 65536.*given 70000"),
        ({"positions": [[0.0, float("inf")], [1.0, 0.5]]}, "not JSON: Infinity is not a number of JSON"),
    ],
)
def test_a_dictionary_that_is_no_grasp_is_refused_by_its_field(tmp_path, change, message):
    path = tmp_path / "grasp.json"
    path.write_text(json.dumps(GRASPS["planar"].to_dict() | change))
    with pytest.raises(gf.InvalidFileError, match=message):
        gf.load_grasp(path)


def test_a_grasp_may_be_written_without_a_name(tmp_path):
    gf.save_grasp(tmp_path / "pinch.json", GRASPS["planar"])
    assert gf.load_grasp(tmp_path / "pinch.json").name == "pinch.json"


def test_what_could_not_be_read_again_is_not_written(tmp_path):
    with pytest.raises(gf.InvalidFileError, match=r"a\.json: name: expected text, given 5"):
        save_grasp(tmp_path / "a.json", GRASPS["planar"], name=5)
    with pytest.raises(gf.InvalidFileError, match=r"a\.NPZ: grasps are written as JSON"):
        save_grasp(tmp_path / "a.NPZ", GRASPS["planar"])
    with pytest.raises(gf.InvalidFileError, match=r"none\.off: no such mesh"):
        save_grasp(tmp_path / "a.json", GRASPS["one for all"], mesh=tmp_path / "none.off")
    with pytest.raises(gf.InvalidInputError, match="grasp: 5 is not a"):
        save_grasp(tmp_path / "a.json", 5)
    ring = np.linspace(0, 2 * np.pi, 4000)
    long = [np.stack([np.ones(4000), np.cos(ring) / 3, np.sin(ring) / 3], axis=1)] * 3
    with pytest.raises(gf.InvalidFileError, match=r"a\.json: the grasp takes \d+ bytes, more than 1000000"):
        save_grasp(tmp_path / "a.json", gf.Grasp(TRIANGLE, INWARD, extreme_forces=long), name="long")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("contacts", "edges"), [(1001, 8), (3, 4097), (3, 65_536), (1, 3)])
def test_a_file_holds_as_many_edges_and_contacts_as_a_grasp(tmp_path, contacts, edges):
    angles = np.linspace(0, 6, contacts)
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1).round(3)
    grasp = gf.Grasp(outward, -outward, edges=edges)
    save_grasp(tmp_path / "a.json", grasp)
    assert load_grasp(tmp_path / "a.json").grasp == grasp


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "a").write_text("a file")
    for path in (tmp_path, tmp_path / "a" / "b.json"):
        with pytest.raises(gf.InvalidFileError, match=str(path.name if path == tmp_path else "a")):
            save_grasp(path, GRASPS["planar"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"foo": 1}, "mesh.foo: unknown field"),
        ({"unit": "km"}, "mesh.unit: must be 'm', 'dm', .*, given 'km'"),
        ({"max_curvature": -1.0}, "mesh.max_curvature: must be greater than 0, given -1.0"),
        ({"unit": object()}, "mesh_options: Object of type object"),
    ],
)
def test_options_of_a_mesh_are_checked_before_anything_is_written(tmp_path, egg, options, message):
    out = tmp_path / "out" / "best.json"
    with pytest.raises(gf.InvalidInputError, match=message):
        save_grasp(out, GRASPS["one for all"], mesh=egg, mesh_options=options)
    assert not out.parent.exists()


@pytest.mark.parametrize(
    ("shared", "own", "expected"),
    [
        ("8", ["null", "null"], [0, 0]),
        ("null", ["6", "5"], [6, 5]),
        ("8", ["6", None], [6, 8]),
        ("8", ["null", None], r"contacts\[0\].edges: null here"),
        ("null", [None, "6"], r"contacts\[1\].edges: 6 here"),
        ("8", ["null", "6"], r"contacts\[0\].edges: null here"),
    ],
)
def test_null_edges_of_a_contact_are_a_true_cone(tmp_path, shared, own, expected):
    lines = [f"edges: {shared}", "contacts:"]
    for x, edges in zip((1, -1), own, strict=True):
        given = "" if edges is None else f", edges: {edges}"
        lines.append(f"  - {{position: [{x}, 0, 0], normal: [{-x}, 0, 0]{given}}}")
    path = tmp_path / "grasp.yaml"
    path.write_text("\n".join(lines))
    if isinstance(expected, list):
        assert load_grasp(path).grasp.num_edges.tolist() == expected
    else:
        with pytest.raises(gf.InvalidFileError, match=expected):
            load_grasp(path)


@pytest.fixture
def egg(tmp_path):
    trimesh = pytest.importorskip(
        "trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'"
    )
    (tmp_path / "meshes").mkdir()
    path = tmp_path / "meshes" / "egg.stl"
    trimesh.creation.icosphere(subdivisions=2, radius=0.03).export(path)
    return path


def saved(folder, mesh):
    """Return the name under which a grasp file names its mesh, which can be read through it."""
    save_grasp(folder / "best.json", GRASPS["one for all"], name="egg", mesh=mesh)
    vertices, _ = load_grasp(folder / "best.json").object_mesh()
    assert np.ptp(vertices, axis=0) == pytest.approx(0.06)
    return json.loads((folder / "best.json").read_text())["mesh"]["file"]


def test_a_mesh_is_named_where_it_is_or_copied_beside_its_grasp(tmp_path, egg):
    assert saved(tmp_path, egg) == "meshes/egg.stl"
    (tmp_path / "out").mkdir()
    assert saved(tmp_path / "out", str(egg)) == "egg.stl"
    assert saved(tmp_path / "out", egg) == "egg.stl"
    (tmp_path / "out" / "egg.stl").write_text("another")
    with pytest.raises(gf.InvalidFileError, match=r"egg\.stl: in the way of a copy of .*meshes"):
        saved(tmp_path / "out", egg)


def test_a_mesh_whose_name_could_be_an_address_is_named_as_a_file(egg):
    assert saved(egg.parent, egg.rename(egg.with_name("left:egg.stl"))) == "./left:egg.stl"


def test_a_link_out_of_the_folder_is_copied_beside_itself(tmp_path, egg):
    out = tmp_path / "out"
    out.mkdir()
    (out / "egg.stl").symlink_to(egg)
    for _ in range(2):
        assert saved(out, out / "egg.stl") == "best-egg.stl"
    assert (out / "best-egg.stl").read_bytes() == egg.read_bytes()
