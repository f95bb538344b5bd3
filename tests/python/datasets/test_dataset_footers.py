"""Parquet footers that lie about rows, or whose names are no text."""

import time

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.random_datasets import as_table, grasp_rows

import graspforce as gf

ROWS = 60


@pytest.fixture(scope="module")
def table():
    return as_table(grasp_rows(ROWS, 2))


def grade(source, out):
    return gf.grade(source, out, criteria="sum", rows_per_part=20)


def varint(number):
    number, digits = 2 * number, []
    while number >= 0x80:
        digits.append(number % 0x80 + 0x80)
        number //= 0x80
    return bytes([*digits, number])


def lying(path, rows, claimed, which):
    """Put another number of rows into the footer: of the file (0), of chunks, of the row group (-1)."""
    content = path.read_bytes()
    length = int.from_bytes(content[-8:-4], "little")
    data, footer = content[: -8 - length], content[-8 - length : -8]
    pieces = footer.split(b"\x16" + varint(rows))
    assert len(pieces) >= 3
    chosen = {k % (len(pieces) - 1) for k in which} if which else set(range(len(pieces) - 1))
    footer = pieces[0]
    for k, piece in enumerate(pieces[1:]):
        footer += b"\x16" + varint(claimed if k in chosen else rows) + piece
    path.write_bytes(data + footer + len(footer).to_bytes(4, "little") + b"PAR1")


@pytest.mark.parametrize("claimed", [10**12, 2**61, 3])
@pytest.mark.parametrize("which", [(0,), (0, -1), ()], ids=["file", "file and group", "everything"])
def test_a_footer_that_claims_another_number_of_rows_is_refused_at_once(table, tmp_path, claimed, which):
    path = tmp_path / "a.parquet"
    # Flat columns beside the lists: their chunks have as many values as there are rows.
    flat = table.set_column(3, "friction", pa.array([0.5] * ROWS))
    pq.write_table(flat, path, compression="none")
    assert pq.read_metadata(path).num_rows == ROWS
    lying(path, ROWS, claimed, which)
    begin = time.monotonic()
    with pytest.raises(gf.InvalidInputError, match=r"rows"):
        gf.grade(path, tmp_path / "out", criteria="sum", rows_per_part=20)
    assert time.monotonic() - begin < 5
    assert not list((tmp_path / "out").glob("*.parquet"))


def test_rows_of_lists_beyond_what_a_row_group_claims_are_not_dropped(table, tmp_path):
    path = tmp_path / "a.parquet"
    pq.write_table(table.drop_columns(["id"]), path, compression="none")
    lying(path, ROWS, 41, ())
    with pytest.raises(gf.InvalidFileError, match=r"a\.parquet: its row groups claim 41 rows"):
        grade(path, tmp_path / "out")


@pytest.mark.parametrize("name", [b"positions", b"normals", b"friction"])
def test_a_footer_whose_names_are_no_text_is_refused(table, tmp_path, name):
    path = tmp_path / "a.parquet"
    pq.write_table(table, path, compression="none")
    content = path.read_bytes()
    length = int.from_bytes(content[-8:-4], "little")
    footer = content[-8 - length : -8]
    assert name in footer
    for wrong in (b"\xff" + name[1:], name[:-1] + b"\xc3", bytes(len(name)), b"\xed\xa0\x80" + name[3:]):
        path.write_bytes(content[: -8 - length] + footer.replace(name, wrong) + content[-8:])
        # InvalidFileError is an InvalidInputError; names of zeros are text, of a column that nobody wants.
        with pytest.raises(gf.InvalidInputError, match=r"a\.parquet|positions|normals|friction") as raised:
            grade(path, tmp_path / "out")
        assert isinstance(raised.value, gf.InvalidFileError) or not wrong[0]
