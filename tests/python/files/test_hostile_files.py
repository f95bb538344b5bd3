"""Files from strangers: read, or refused with their place; nothing blocks, runs or escapes."""

import io
import os
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.hostile_values import HOSTILE
from test_files import CURVE, PINCH

import graspforce as gf
from graspforce.files import load_grasp, load_mesh, load_problem, load_wrenches


def npz(**arrays):
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def npy(array):
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


PAIR = {"positions": [(-1.0, 0.0), (1.0, 0.0)], "normals": [(1.0, 0.0), (-1.0, 0.0)]}
TETRAHEDRON = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
SEEDS = {
    "grasp.yaml": (load_grasp, (PINCH + "friction: 0.5\nname: pinch\n").encode()),
    "grasp.json": (load_grasp, b'{"contacts": [{"position": [-1, 0], "normal": [1, 0]}], "edges": null}'),
    "grasp.npz": (load_grasp, npz(**PAIR)),
    "plan.yaml": (load_problem, CURVE.encode()),
    "wrenches.csv": (lambda path: load_wrenches(path, 3), b"t,fx,fy,tau\n0,1,2,3\n1,4,5e-1,6\n"),
    "wrenches.npy": (lambda path: load_wrenches(path, 3), npy(np.ones((4, 3)))),
    "mesh.obj": (load_mesh, TETRAHEDRON),
    "mesh.off": (load_mesh, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
}
FRAGMENTS = [
    b"\0", b"\xff", b"\xef\xbb\xbf", b"\r\n", b"\n", b"[", b"{", b"&a ", b"*a", b"<<: ", b"'", b'"',
    b":", b"- ", b"!!python/object:os.system ", b"1e999", b"9" * 400, b"-", b".nan", b"null", b"PK\x05\x06",
    b"0x10", b"99999999999", b"\xf0\x9f",
]  # fmt: skip


@st.composite
def mangled(draw, content):
    """Cut pieces of the content, repeat them, or put others in."""
    data = bytearray(content)
    for _ in range(draw(st.integers(1, 6))):
        at, length = draw(st.integers(0, len(data))), draw(st.integers(0, 12))
        piece = draw(st.one_of(st.sampled_from(FRAGMENTS), st.binary(max_size=8)))
        change = draw(st.integers(0, 3))
        if change == 0:
            del data[at : at + length]
        elif change == 1:
            data[at:at] = piece
        elif change == 2:
            data[at : at + len(piece)] = piece
        else:
            data[at:at] = data[at : at + length] * 3
    return bytes(data)


@pytest.mark.parametrize("name", SEEDS)
@HOSTILE
@given(st.data())
def test_a_mangled_file_is_read_or_refused(tmp_path_factory, name, data):
    load, content = SEEDS[name]
    path = tmp_path_factory.getbasetemp() / name
    path.write_bytes(data.draw(mangled(content)))
    refusal = None
    try:
        load(path)
    except gf.InvalidFileError as error:
        refusal = error
    if refusal is not None:
        assert refusal.path == path
        assert str(path) in str(refusal)
        assert len(str(refusal)) < 5000


ELSEWHERE = ["../other.obj", "/etc/passwd", "sub/../../other.obj", "http://example.org/a.obj", "file:///etc/passwd",
             "C:\\mesh.obj", "a\\0b.obj"]  # fmt: skip


@pytest.mark.parametrize("mesh", ELSEWHERE)
def test_a_mesh_outside_the_folder_of_its_grasp_is_refused(tmp_path, mesh):
    path = tmp_path / "grasp.yaml"
    path.write_text(PINCH + f'mesh: "{mesh}"\n' if "\\" not in mesh else PINCH + f"mesh: '{mesh}'\n")
    if mesh == "a\\0b.obj":
        path.write_text(PINCH + 'mesh: "a\\0b.obj"\n')
    with pytest.raises(gf.InvalidFileError, match=r"grasp.yaml:4: mesh.file: "):
        load_grasp(path)


def test_a_link_that_leads_out_of_the_folder_is_refused_and_one_within_is_not(tmp_path):
    (tmp_path / "outside.obj").write_bytes(TETRAHEDRON)
    folder = tmp_path / "grasps"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "inside.obj").write_bytes(TETRAHEDRON)
    (folder / "out.obj").symlink_to(tmp_path / "outside.obj")
    (folder / "in.obj").symlink_to(folder / "meshes" / "inside.obj")
    path = folder / "grasp.yaml"
    path.write_text(PINCH + "mesh: out.obj\n")
    with pytest.raises(gf.InvalidFileError, match="outside the folder"):
        load_grasp(path)
    for name in ("in.obj", "meshes/inside.obj"):
        path.write_text(PINCH + f"mesh: {name}\n")
        vertices, _ = load_mesh(load_grasp(path).mesh)
        assert vertices.shape == (4, 3)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
@pytest.mark.parametrize("name", SEEDS)
def test_a_pipe_is_refused_and_not_waited_for(tmp_path, name):
    path = tmp_path / name
    os.mkfifo(path)
    with pytest.raises(gf.InvalidFileError, match="not a regular file"):
        SEEDS[name][0](path)


@pytest.mark.skipif(os.name != "posix", reason="devices")
@pytest.mark.parametrize("name", SEEDS)
def test_devices_and_folders_are_refused(tmp_path, name):
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(gf.InvalidFileError, match="not a regular file"):
        SEEDS[name][0](tmp_path / name)
    with pytest.raises(gf.InvalidFileError):
        SEEDS[name][0](tmp_path)
    with pytest.raises(gf.InvalidFileError, match=rf"a\\x00{name}: "):
        SEEDS[name][0](f"{tmp_path}/a\0{name}")


def test_an_archive_that_unpacks_to_more_than_the_limit_is_refused(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("positions", "normals"):
            archive.writestr(f"{name}.npy", bytes(200 * 1024 * 1024))
    assert path.stat().st_size < 10**6
    with pytest.raises(gf.InvalidFileError, match="larger than"):
        load_grasp(path)


def test_an_array_that_claims_more_than_its_archive_holds_is_refused(tmp_path):
    header = npy(np.zeros((2, 2))).replace(b"(2, 2), }", b"(9999999999, 2), }")[:128]
    path = tmp_path / "liar.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("positions.npy", header)
        archive.writestr("normals.npy", header)
    with pytest.raises(gf.InvalidFileError, match=r"liar\.npz"):
        load_grasp(path)


def test_numbers_only_python_would_read_are_refused(tmp_path):
    path = tmp_path / "w.csv"
    for cell in ("1_0", "१", "0x10", "1e5_0", "infinity", "1e999", ""):
        path.write_text(f"{cell},2,3\n", encoding="utf-8")
        with pytest.raises(gf.InvalidFileError, match=r"csv:1: fx"):
            load_wrenches(path, 3)


def test_a_large_table_of_wrenches_takes_a_small_multiple_of_its_size(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text("0,-1,0\n" * 1_000_000)
    code = (
        "import resource, sys\nfrom graspforce.files import load_wrenches\n"
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        "before = peak(); load_wrenches(sys.argv[1], 3); print(peak() - before)\n"
    )
    child = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=False
    )
    assert child.returncode == 0, child.stderr
    assert float(child.stdout) < 12 * path.stat().st_size / 1e6


def test_a_line_without_end_is_refused(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text("1" * 10**6 + ",2,3\n")
    with pytest.raises(gf.InvalidFileError, match="csv"):
        load_wrenches(path, 3)


def test_marks_and_line_ends_of_other_systems_are_read(tmp_path):
    path = tmp_path / "w.csv"
    path.write_bytes(b"\xef\xbb\xbffx,fy,tau\r\n1,2,3\r\n")
    assert load_wrenches(path, 3).wrenches.tolist() == [[1, 2, 3]]
    path = tmp_path / "g.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + PINCH.replace("\n", "\r\n").encode())
    assert load_grasp(path).grasp.num_contacts == 2


@pytest.mark.parametrize("comment", ['# a "quoted" note', '#,"not closed', '#"', ' # ,"', '"#"'])
def test_quotes_in_comments_swallow_no_rows(tmp_path, comment):
    path = tmp_path / "w.csv"
    path.write_text(f'fx,fy,tau\n1,2,3\n{comment}\n4,5,6\n# "\n7,8,9\n')
    assert load_wrenches(path, 3).wrenches.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    path.write_text(f"fx,fy,tau\n1,2,3\n{comment}\n4,5,wrong\n")
    with pytest.raises(gf.InvalidFileError, match=r"w\.csv:4: tau: 'wrong'"):
        load_wrenches(path, 3)


@pytest.mark.parametrize("last", ["", '\n7,8,9"\n', "\n7,8,9\n"])
def test_a_quote_that_is_not_closed_on_its_line_is_refused(tmp_path, last):
    path = tmp_path / "w.csv"
    path.write_text('# one\n1,2,3\n# two\n1,2,"3\n4,5,6' + last)
    with pytest.raises(gf.InvalidFileError, match=r"w\.csv:4: not CSV: a quote that is not closed"):
        load_wrenches(path, 3)
    path.write_text('"fx","fy","tau"\n"1","2","3"\n')
    assert load_wrenches(path, 3).wrenches.tolist() == [[1, 2, 3]]


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("second", ["positions.npy", "positions"])
def test_an_archive_with_two_arrays_of_one_name_is_refused(tmp_path, second):
    path = tmp_path / "twice.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in (("positions.npy", 1.0), ("normals.npy", 1.0), (second, 2.0)):
            archive.writestr(name, npy(np.full((2, 2), values)))
    with pytest.raises(gf.InvalidFileError, match=r"positions: there are 2 arrays of this name"):
        load_grasp(path)


def test_an_array_that_claims_less_than_it_holds_is_refused(tmp_path):
    path = tmp_path / "short.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("positions.npy", "normals.npy"):
            archive.writestr(name, npy(np.ones((3, 2))).replace(b"(3, 2)", b"(2, 2)"))
    with pytest.raises(gf.InvalidFileError, match="positions: holds more numbers than its shape"):
        load_grasp(path)
    path = tmp_path / "short.npy"
    path.write_bytes(npy(np.ones((3, 3))).replace(b"(3, 3)", b"(2, 3)"))
    with pytest.raises(gf.InvalidFileError, match="more numbers than its shape"):
        load_wrenches(path, 3)


PLY = b"""ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0\n1 0 0\n0 1 0\n0 0 1
3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3
"""
OFF = (
    b"OFF # a comment\n4 4 6\n\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3 0.5 0.5 0.5\n"
)
SOLID = b"""solid %d
facet normal 0 0 1
outer loop
vertex 0 0 0\nvertex %d 0 0\nvertex 0 1 0
endloop
endfacet
endsolid
"""
STL = b"".join(SOLID % (k, k + 1) for k in range(4))
BINARY_STL = bytes(80) + (2).to_bytes(4, "little") + np.zeros(25, "<f4").tobytes()
WRONG_MESHES = {
    "zero.obj": TETRAHEDRON.replace(b"f 1 3 2", b"f 0 3 2"),
    "minus.obj": TETRAHEDRON.replace(b"f 1 3 2", b"f -1 3 2"),
    "beyond.obj": TETRAHEDRON.replace(b"f 1 3 2", b"f 1 5 2"),
    "immense.obj": TETRAHEDRON.replace(b"f 1 3 2", b"f 1 99999999999999999999 2"),
    "python.obj": TETRAHEDRON.replace(b"v 1 0 0", b"v 1_0 0 0"),
    "python.off": OFF.replace(b"3 0 2 1", b"3 0_0 2 1"),
    "nan.obj": TETRAHEDRON.replace(b"v 1 0 0", b"v nan 0 0"),
    "minus.off": OFF.replace(b"3 0 2 1", b"3 -1 2 1"),
    "beyond.off": OFF.replace(b"3 0 2 1", b"3 4 2 1"),
    "more.off": OFF.replace(b"4 4 6", b"4 5 6"),
    "fewer.off": OFF.replace(b"4 4 6", b"4 3 6"),
    "immense.off": OFF.replace(b"4 4 6", b"4 999999999999 6"),
    "corners.off": OFF.replace(b"3 0 2 1", b"9 0 2 1"),
    "minus.ply": PLY.replace(b"3 0 2 1", b"3 -1 2 1"),
    "beyond.ply": PLY.replace(b"3 0 2 1", b"3 4 2 1"),
    "more.ply": PLY.replace(b"face 4", b"face 5"),
    "immense.ply": PLY.replace(b"face 4", b"face 999999999999"),
    "endless.ply": PLY.replace(b"vertex 4", b"vertex " + b"9" * 5000),
    "short.stl": STL.replace(b"vertex 3 0 0\n", b""),
    "more.stl": BINARY_STL[:-1],
}


@pytest.mark.parametrize("name", WRONG_MESHES)
def test_faces_and_counts_that_a_mesh_does_not_hold_are_refused(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(WRONG_MESHES[name])
    with pytest.raises(gf.InvalidFileError, match=name):
        load_mesh(path)


def test_the_meshes_themselves_are_read_in_the_order_of_their_faces(tmp_path):
    quads = (
        b"v 0 0 0\\\n 1 1 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1/1 2/2 3/3 4/4\ng b\nf 1//1 3//1 2//2\n"
    )
    for name, content, faces in (
        ("a.obj", TETRAHEDRON, 4), ("b.obj", quads, 3), ("a.off", OFF, 4), ("a.ply", PLY, 4),
        ("a.stl", STL, 4),
        ("b.stl", bytes(80) + (2).to_bytes(4, "little") + bytes(100), 2),
    ):  # fmt: skip
        path = tmp_path / name
        path.write_bytes(content)
        assert load_mesh(path)[1].shape == (faces, 3), name
    assert load_mesh(tmp_path / "b.obj")[1].tolist() == [[0, 1, 2], [0, 2, 3], [0, 2, 1]]


def test_reading_a_mesh_takes_time_in_proportion_to_its_size(tmp_path):
    count = 20_000
    corners = "".join(f"v {k % 100} {k // 100} 0\n" for k in range(count))
    separate = "".join(f"usemtl m{k}\no o{k}\ng g{k}\nf {k + 1} {k + 2} {k + 3}\n" for k in range(count - 2))
    solids = "".join(STL.decode().split("endsolid\n", 1)[0] + "endsolid\n" for _ in range(count))
    boxes = [f"{x} {y} {z}\n" for _ in range(count) for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0))]
    off = f"OFF\n{len(boxes)} {count} 0\n{''.join(boxes)}" + "".join(
        f"3 {3 * k} {3 * k + 1} {3 * k + 2}\n" for k in range(count)
    )
    blank = OFF.decode().replace("OFF # a comment\n", "OFF\n" + "\n" * 1_000_000)
    for name, text in (("a.obj", corners + separate), ("a.stl", solids), ("a.off", off), ("b.off", blank)):
        (tmp_path / name).write_text(text)
        begin = time.process_time()
        load_mesh(tmp_path / name)
        assert time.process_time() - begin < (1 if name == "b.off" else 5), name


def test_a_mesh_of_more_parts_than_the_limit_is_refused_at_once(tmp_path):
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]) * 0.05
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    for count in (3, 5000):
        shifted = np.concatenate([corners + 1e-6 * k for k in range(count)])
        lines = [" ".join(map(str, row)) for row in shifted]
        lines += [f"3 {a} {b} {c}" for k in range(count) for a, b, c in faces + 4 * k]
        (tmp_path / "parts.off").write_text(f"OFF\n{4 * count} {4 * count} 0\n" + "\n".join(lines))
        path = tmp_path / "grasp.yaml"
        path.write_text(
            "mesh: parts.off\ncontacts:\n  - {point: [0, 0, 0.1]}\n  - {point: [0.08, 0.05, 0]}\n"
        )
        begin = time.process_time()
        if count == 3:
            load_grasp(path)
        else:
            with pytest.raises(
                gf.InvalidFileError, match=r"grasp\.yaml:1: mesh\.file: .*: 5000 separate parts, more"
            ):
                load_grasp(path)
            with pytest.raises(gf.InvalidFileError, match=r"parts\.off: 5000 separate parts, more"):
                gf.plan_multistart(tmp_path / "parts.off", contacts=3)
        assert time.process_time() - begin < 5


@pytest.mark.parametrize("suffix", ["yaml", "json"])
@pytest.mark.parametrize("count", [49_900, 330_000])
def test_text_of_many_empty_lists_takes_bounded_memory(tmp_path, suffix, count):
    path = tmp_path / f"a.{suffix}"
    lists = "[" + "[]," * count + "[]]"
    path.write_text(f'{{"contacts": [], "outline": {lists}}}')
    code = (
        "import resource, sys, graspforce as gf\nfrom graspforce.files import load_grasp\n"
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        "before = peak()\n"
        "try: load_grasp(sys.argv[1])\n"
        "except gf.InvalidFileError: print(peak() - before)\n"
    )
    child = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, timeout=60, check=False
    )
    assert child.returncode == 0, child.stderr
    assert float(child.stdout) < 150
