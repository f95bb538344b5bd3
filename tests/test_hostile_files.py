"""Files from strangers: read, or refused with their place; nothing blocks, runs or escapes."""

import io
import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import graspforce as gf
from graspforce.files import load_grasp, load_mesh, load_problem, load_wrenches
from hostile_values import HOSTILE
from test_files import CURVE, PINCH


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
    with pytest.raises(gf.InvalidFileError, match=f"a\0{name}: "):
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
