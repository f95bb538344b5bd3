"""PLY files that claim much, or that take a parser long."""

import contextlib
import struct
import time

import pytest

import graspforce as gf
from graspforce.files import load_mesh

pytest.importorskip("trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'")

ASCII, BINARY = b"ply\nformat ascii 1.0\n", b"ply\nformat binary_little_endian 1.0\n"
VERTICES = b"element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACES = b"element face %d\nproperty list uchar int vertex_indices\n"
END = b"end_header\n"
CORNERS = b"0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
TETRAHEDRON = CORNERS + b"3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
BYTES = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)


def many(text, count):
    return b"".join(text % k for k in range(count))


SOLID = VERTICES + FACES % 4 + END + TETRAHEDRON
ROW = b"element e%d 1\nproperty int x\n"
LISTS = b"element e%d 1\nproperty list uchar uchar x\n"
WORD_LIST = FACES.replace(b"uchar", b"uint") % 1


def with_properties(text, count):
    return ASCII + VERTICES + many(text, count) + END + (b"0 " * (count + 3) + b"\n") * 4


# Content for a size; ten times the size makes some ten times as much of it.
FILES = {
    "elements": lambda n: ASCII + many(ROW.replace(b" 1", b" 0"), n) + SOLID,
    "elements with rows": lambda n: ASCII + many(ROW, n) + END + b"0\n" * n,
    "elements without properties": lambda n: BINARY + many(b"element e%d 1\n", n) + END + bytes(n),
    "binary lists": lambda n: BINARY + many(LISTS, n) + END + b"\1\1" * n,
    "properties": lambda n: with_properties(b"property int p%d\n", n),
    "lists": lambda n: with_properties(b"property list uchar int p%d\n", n),
    "comments": lambda n: ASCII + b"comment c\n" * n + SOLID,
    "polygons of several sizes": lambda n: (
        ASCII + VERTICES + FACES % (2 * n) + END + CORNERS + b"3 0 1 2\n4 0 1 2 3\n" * n
    ),
    "binary polygons of several sizes": lambda n: (
        BINARY + VERTICES + FACES % (2 * n) + END + BYTES
        + struct.pack("<B3iB4i", 3, 0, 1, 2, 4, 0, 1, 2, 3) * n
    ),
    "one large polygon": lambda n: (
        ASCII + VERTICES + WORD_LIST + END + CORNERS + b"%d" % n + b" 1 2" * (n // 2)
    ),
    "empty rows": lambda n: ASCII + VERTICES + FACES % n + END + CORNERS + b"0\n" * n,
}  # fmt: skip


@pytest.mark.alone
@pytest.mark.parametrize("make", FILES.values(), ids=FILES)
def test_reading_takes_a_time_that_grows_no_faster_than_the_file(tmp_path, make):
    path = tmp_path / "a.ply"

    def seconds(size):
        path.write_bytes(make(size))
        begin = time.process_time()
        with contextlib.suppress(gf.InvalidFileError):
            vertices, faces = load_mesh(path)
            assert faces.max() < len(vertices)
        return time.process_time() - begin

    seconds(10)
    assert seconds(20_000) < 0.05 + 30 * max(seconds(2000), 0.005)


@pytest.mark.parametrize("count", [b"99999999", b"-1", b"1e9", b"4294967296", b"9" * 500, b"0x10", b""])
@pytest.mark.parametrize("element", [b"vertex", b"face", b"edge"])
@pytest.mark.parametrize("kind", [ASCII, BINARY])
def test_a_count_that_the_file_cannot_hold_is_refused_at_once(tmp_path, kind, element, count):
    path = tmp_path / "a.ply"
    head = dict.fromkeys((b"vertex", b"face", b"edge"), b"4") | {element: count}
    text = VERTICES.replace(b" 4\n", b" %b\n" % head[b"vertex"]) + FACES.replace(b"%d", head[b"face"])
    text += b"element edge %b\nproperty int a\n" % head[b"edge"] + END
    path.write_bytes(kind + text + TETRAHEDRON + b"0\n" * 4)
    begin = time.process_time()
    with pytest.raises(gf.InvalidFileError, match=r"a\.ply"):
        load_mesh(path)
    assert time.process_time() - begin < 1.0


@pytest.mark.parametrize("length", [2**31, 2**32 - 1, 10**6])
def test_a_list_longer_than_the_file_is_refused_at_once(tmp_path, length):
    path = tmp_path / "a.ply"
    head = BINARY + VERTICES + FACES.replace(b"uchar", b"uint") % 1 + END
    path.write_bytes(head + BYTES + struct.pack("<I", length) + bytes(64))
    with pytest.raises(gf.InvalidFileError, match=r"a\.ply"):
        load_mesh(path)


def test_a_header_without_end_is_refused(tmp_path):
    path = tmp_path / "a.ply"
    for content in (ASCII + VERTICES, b"", b"ply\n", ASCII + b"comment c\n" * 10_000 + VERTICES + END):
        path.write_bytes(content)
        with pytest.raises(gf.InvalidFileError, match="end_header"):
            load_mesh(path)


def test_a_picture_that_a_comment_names_is_not_asked_for(tmp_path, caplog):
    path = tmp_path / "a.ply"
    path.write_bytes(ASCII + b"comment TextureFile /etc/passwd\r\ncomment \n" + SOLID)
    assert load_mesh(path)[1].shape == (4, 3)
    assert caplog.records == []
