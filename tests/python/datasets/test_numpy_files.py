"""NumPy files of strangers: whole data comes back as NumPy reads it, and nothing of theirs is run."""

import collections
import contextlib
import io
import os
import pickle
import subprocess
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import graspforce as gf
from graspforce.datasets import load_numpy

DTYPES = ("bool", "i1", "u2", ">i4", "i8", "f2", "f4", ">f8", "c16", "S5", "U7")
ARRAYS = st.sampled_from(DTYPES).flatmap(
    lambda dtype: arrays.arrays(dtype, arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4))
)
LEAVES = st.one_of(
    ARRAYS, ARRAYS.filter(lambda a: a.size).map(lambda a: a.ravel()[0]), ARRAYS.map(np.asfortranarray)
)
LEAVES |= (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.binary(max_size=5)
)
TREES = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(max_size=4), inner, max_size=3)
        | st.tuples(inner, inner)
        | st.sets(st.integers(), max_size=3)
    ),
    max_leaves=8,
)


def same(left, right):
    assert type(left) is type(right)
    if isinstance(left, dict):
        assert list(left) == list(right)
        return all(same(left[key], right[key]) for key in left)
    if isinstance(left, (list, tuple)):
        return len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, np.ndarray) and left.dtype == object:
        return left.shape == right.shape and all(map(same, left.ravel(), right.ravel()))
    if isinstance(left, (np.ndarray, np.generic)):
        right = right.astype(right.dtype.newbyteorder("="))
        return left.dtype == right.dtype and left.shape == right.shape and left.tobytes() == right.tobytes()
    return left == right if isinstance(left, set) else repr(left) == repr(right)


def pickled(value, protocol):
    """Return a .npy file of one object by a protocol of pickle."""
    return forged(pickle.dumps(boxed(value), protocol=protocol))


def forged(body):
    """Return a .npy file of one object with the bytes of a pickle."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "|O", "fortran_order": False, "shape": ()})
    file.write(body)
    return file.getvalue()


def boxed(value):
    box = np.empty((), dtype=object)
    box[()] = value
    return box


@given(tree=TREES, protocol=st.sampled_from([3, 4, 5]))
def test_whole_data_comes_back_as_numpy_reads_it(tree, protocol, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "tree.npy"
    path.write_bytes(pickled(tree, protocol))
    assert same(load_numpy(path), np.load(path, allow_pickle=True)[()])


def test_a_list_of_grasps_and_an_archive_are_read(tmp_path):
    grasps = np.empty((2, 1), dtype=object)
    grasps[:, 0] = [{"points": np.eye(3)}, {"points": np.zeros((2, 3))}]
    np.savez(tmp_path / "all.npz", grasps=grasps, friction=np.float32(0.5), names=np.array(["a", "b"]))
    read = load_numpy(tmp_path / "all.npz")
    assert list(read) == ["grasps", "friction", "names"]
    assert read["grasps"].shape == (2, 1)
    np.testing.assert_array_equal(read["grasps"][0, 0]["points"], np.eye(3))
    read["grasps"][0, 0]["points"][0] = 1  # results can be written to


def test_what_was_shared_stays_shared(tmp_path):
    points = np.eye(3)
    levels = [points]
    for _ in range(200):  # 2^200 entries, if each were copied
        levels = [levels, levels]
    (tmp_path / "shared.npy").write_bytes(pickled({"a": points, "b": points, "deep": levels}, 4))
    read = load_numpy(tmp_path / "shared.npy")
    assert read["a"] is read["b"]


class Attack:
    """What pickle turns into a call."""

    def __init__(self, call, *arguments):
        self.reduced = call, arguments

    def __reduce__(self):
        return self.reduced


def global_of(module, name, then=b""):
    return b"\x80\x03c" + module.encode() + b"\n" + name.encode() + b"\n" + then + b"."


@pytest.mark.parametrize(
    ("value", "named"),
    [
        (Attack(os.system, "touch PWNED"), "system"),
        (Attack(subprocess.check_output, ["touch", "PWNED"]), "subprocess.check_output"),
        (Attack(eval, "open('PWNED', 'w')"), "builtins.eval"),
        (Attack(getattr, {}, "clear"), "builtins.getattr"),
        (Attack(open, "PWNED", "w"), "io.open"),
        (Attack(np.load, "PWNED"), "numpy.load"),
        (Attack(np.fromfile, "/etc/passwd"), "numpy"),
        (Attack(collections.defaultdict, list), "collections.defaultdict"),
        ({"deep": [Attack(pickle.loads, b"")]}, "pickle.loads"),
        (np.zeros(2, dtype=[("a", "f8")]), "dtype"),
        (np.zeros(2, dtype="M8[s]"), "dtype"),
        (slice(1), "builtins.slice"),
        (Attack(bytearray, 1 << 60), "builtins.bytearray"),
        (Attack, "test_numpy_files"),
    ],
)
def test_everything_else_is_refused_by_name_and_not_run(value, named, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "evil.npy").write_bytes(pickled(value, 4))
    with pytest.raises(gf.InvalidFileError, match=named):
        load_numpy("evil.npy")
    assert not (tmp_path / "PWNED").exists()
    with zipfile.ZipFile("evil.npz", "w") as archive:
        archive.write("evil.npy")
    with pytest.raises(gf.InvalidFileError, match=named):
        load_numpy("evil.npz")


RECONSTRUCT = b"cnumpy.core.multiarray\n_reconstruct\n"
ARRAY = RECONSTRUCT + b"cnumpy\nndarray\nK\x00\x85C\x01b\x87R"


def dtype(code):
    return b"cnumpy\ndtype\nX" + len(code).to_bytes(4, "little") + code.encode() + b"\x89\x88\x87R"


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\x80",
        b"\x80\x04\x95\xff\xff\xff\xff\xff\xff\xff\x7f.",
        global_of("numpy", "ndarray"),
        # Fields of objects over bytes of the file: a pointer of the attacker's choice.
        b"\x80\x03" + dtype("V8") + b".",
        b"\x80\x03" + dtype("O8,O8") + b".",
        # Objects made of bytes.
        b"\x80\x03" + ARRAY + b"(K\x01K\x01\x85" + dtype("O8") + b"\x89C\x08AAAAAAAAtb.",
        b"\x80\x03cnumpy.core.multiarray\nscalar\n" + dtype("O8") + b"C\x08AAAAAAAA\x86R.",
        # A shape that is larger than its data, negative, or no shape.
        b"\x80\x03" + ARRAY + b"(K\x01J\xff\xff\xff\x7f\x85" + dtype("f8") + b"\x89C\x08AAAAAAAAtb.",
        b"\x80\x03" + ARRAY + b"(K\x01J\xfe\xff\xff\xff\x85" + dtype("f8") + b"\x89C\x08AAAAAAAAtb.",
        b"\x80\x03" + ARRAY + b"(K\x01X\x01\x00\x00\x00a\x85" + dtype("f8") + b"\x89C\x08AAAAAAAAtb.",
        # Gigabytes of zeros from a number.
        b"\x80\x03" + ARRAY + b"(K\x01K\x01\x85" + dtype("f8") + b"\x89J\xff\xff\xff\x7ftb.",
        # Never given its data; a list that holds itself; a function whose parts are replaced; a deep list.
        b"\x80\x03" + ARRAY + b".",
        b"\x80\x03]q\x00h\x00a.",
        b"\x80\x03" + RECONSTRUCT + b"}X\x05\x00\x00\x00_callNsb.",
        b"\x80\x03" + RECONSTRUCT + b"N}X\x05\x00\x00\x00_callNs\x86b.",
        b"\x80\x03" + b"]" * 100_000 + b"a" * 99_999 + b".",
        b"\x80\x03cbuiltins\nset\n" + ARRAY + b"\x85\x81.",
        # The C unpickler would take gigabytes for this index.
        b"\x80\x03]r\x00\x00\x00\x7f.",
    ],
)
def test_a_damaged_or_forged_file_is_an_error_that_names_it(body, tmp_path):
    (tmp_path / "forged.npy").write_bytes(forged(body))
    with pytest.raises(gf.InvalidFileError, match=r"forged\.npy"):
        load_numpy(tmp_path / "forged.npy")


TREE = {"positions": np.eye(3), "names": ["a", np.float64(2)], "more": {1: np.ones(2, ">i4")}}


def compressed():
    file = io.BytesIO()
    np.savez_compressed(file, tree=boxed(TREE), numbers=np.arange(100.0) % 7)
    return file.getvalue()


@pytest.mark.parametrize("good", [pickled(TREE, 4), compressed()], ids=["npy", "npz"])
@given(data=st.data())
def test_bytes_changed_anywhere_give_an_answer_or_the_typed_error(good, data, tmp_path_factory):
    byte = st.tuples(st.integers(0, len(good) - 1), st.integers(0, 255))
    at = data.draw(st.lists(byte, min_size=1, max_size=4))
    bad = bytearray(good)
    for index, byte in at:
        bad[index] = byte
    path = tmp_path_factory.getbasetemp() / "changed.npy"
    path.write_bytes(bad)
    with contextlib.suppress(gf.InvalidFileError):
        load_numpy(path)


def test_a_file_that_is_not_there_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_numpy(tmp_path / "missing.npy")
    (tmp_path / "text.npy").write_text("hello")
    with pytest.raises(gf.InvalidFileError):
        load_numpy(tmp_path / "text.npy")
