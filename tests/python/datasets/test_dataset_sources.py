"""Sources of datasets: told apart value by value, never confused with results, broken ones named."""

import json
import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.random_datasets import as_table, grasp_rows, repeated

import graspforce as gf
from graspforce.datasets import grade_table
from graspforce.datasets.parts import Part, _opened, _rows_at_once

PART = "part-000000.parquet"


@pytest.fixture(scope="module")
def table():
    return as_table(grasp_rows(60, 2))


@pytest.fixture
def source(table, tmp_path):
    path = tmp_path / "data" / "a.parquet"
    path.parent.mkdir()
    pq.write_table(table, path)
    return path


def with_limits(table, limits):
    return table.set_column(4, "max_normal_force", pa.array(limits))


def test_a_value_between_least_and_largest_makes_it_another_source(table, tmp_path):
    source, out = tmp_path / "a.parquet", tmp_path / "out"
    footers = []
    for middle in (2.0, 2.5):
        limits = np.linspace(1, 3, len(table))
        limits[20] = middle
        pq.write_table(with_limits(table, limits), source, compression="none", use_dictionary=False)
        footers.append(source.read_bytes()[-pq.read_metadata(source).serialized_size :])
        if middle == 2.0:
            gf.grade(source, out, criteria="sum", rows_per_part=10)
            (out / PART).unlink()
    assert footers[0] == footers[1]
    with pytest.raises(gf.ResumeError, match=r"a\.parquet has changed, or was written or copied again"):
        gf.grade(source, out, criteria="sum", rows_per_part=10)


def test_a_copy_that_keeps_its_time_is_the_same_source(source, tmp_path):
    gf.grade(source.parent, tmp_path / "out", criteria="sum")
    shutil.copytree(source.parent, tmp_path / "copy")
    assert gf.grade(tmp_path / "copy", tmp_path / "out", criteria="sum").graded_parts == 0


def test_files_of_other_people_are_left_alone_in_a_folder_that_is_refused(source, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    names = [".notes.tmp", ".part.tmp", "precious"]
    for name in names:
        (out / name).touch()
    with pytest.raises(gf.ResumeError, match="which no run of grade wrote"):
        gf.grade(source, out)
    assert sorted(path.name for path in out.iterdir()) == names


def test_what_killed_writers_left_is_cleared_before_anything_was_graded(source, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for name in (f".{PART}.0123.tmp", "._grade.json.4567.tmp"):
        (out / name).touch()
    assert gf.grade(source, out, criteria="sum").graded_parts == 1
    assert sorted(path.name for path in out.iterdir()) == [".lock", "_grade.json", PART]


def test_a_pattern_that_finds_the_results_goes_on_without_them(source, table):
    pattern, out = source.parent / "**" / "*.parquet", source.parent / "deep" / "graded"
    # The results lie further up than the only source: the folder of all files must not become another one.
    source.parent.joinpath("x").mkdir()
    source.rename(source.parent / "x" / "a.parquet")
    assert gf.grade(pattern, out, criteria="sum", rows_per_part=20).parts == 3
    (out / PART).unlink()
    found = gf.grade(pattern, out, criteria="sum", rows_per_part=20)
    assert (found.rows, found.graded_parts) == (len(table), 1)


def test_results_are_not_put_beside_all_that_a_pattern_finds(source):
    with pytest.raises(gf.InvalidInputError, match="holds all files of the source"):
        gf.grade(source.parent / "*.parquet", source.parent)
    assert list(source.parent.iterdir()) == [source]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"edges": 2}, "edges: 2"),
        ({"edges": 100_000}, "edges.*100000"),
        ({"edges": 8.0}, r"edges: 8\.0 is not a whole number"),
        ({"edges": (8, 8)}, "edges"),
        ({"rtol": np.nan}, "rtol"),
        ({"rtol": "1e-3"}, "rtol"),
        ({"length_scale": -1}, "length_scale"),
        ({"rows_per_part": 1e5}, r"rows_per_part: 100000\.0 is not a whole number"),
        ({"rows_per_part": 0}, "rows_per_part: 0"),
    ],
)
def test_bad_options_are_refused_before_any_row_is_graded(source, tmp_path, options, message):
    with pytest.raises(gf.InvalidInputError, match=message):
        gf.grade(source, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_numbers_of_numpy_are_the_options_they_say(source, tmp_path):
    options = {"edges": np.int64(6), "rtol": np.float64(1e-6), "length_scale": np.float32(0.5)}
    assert gf.grade(source, tmp_path / "out", **options, rows_per_part=np.int64(25)).parts == 3
    plain = {"edges": 6, "rtol": 1e-6, "length_scale": 0.5, "rows_per_part": 25}
    assert gf.grade(source, tmp_path / "out", **plain).graded_parts == 0
    manifest = json.loads((tmp_path / "out" / "_grade.json").read_text())
    assert manifest["options"]["edges"] == 6


def test_a_broken_page_of_data_names_its_file(table, tmp_path):
    source = tmp_path / "a.parquet"
    pq.write_table(repeated(table, 3000), source, compression="zstd", use_dictionary=False)
    content = bytearray(source.read_bytes())
    content[1000:20_000] = bytes(19_000)
    source.write_bytes(content)
    with pytest.raises(gf.InvalidFileError, match=r"a\.parquet: "):
        gf.grade(source, tmp_path / "out", criteria="sum")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [".lock", "_grade.json"]


def test_a_source_that_shrinks_while_it_is_graded_leaves_no_part_of_it(source, table, tmp_path, monkeypatch):
    def shrinking(batch, options, progress=None):
        pq.write_table(table.slice(0, 10), source.with_name("new"))
        source.with_name("new").replace(source)
        return grade_table.grade_batch(batch, options, progress)

    monkeypatch.setattr("graspforce.datasets.parts.grade_batch", shrinking)
    with pytest.raises(gf.InvalidFileError, match=r"a\.parquet: changed while it was graded"):
        gf.grade(source, tmp_path / "out", criteria="sum", rows_per_part=20)
    assert list((tmp_path / "out").glob("*.parquet")) == []


@pytest.mark.parametrize("kind", [pa.string(), pa.list_(pa.string())])
def test_rows_at_once_are_bounded_decoded_and_not_as_their_dictionary_encodes_them(table, tmp_path, kind):
    long, source = repeated(table, 3000), tmp_path / "a.parquet"
    text = "x" * 100_000
    value = text if kind == pa.string() else [text]
    pq.write_table(long.append_column("text", pa.array([value] * 3000, kind)), source)
    assert source.stat().st_size < 20e6
    with _opened(source) as file:
        assert _rows_at_once(file, Part(0, source, 0, 3000)) <= (20 << 20) / 1e5


def test_rows_that_share_a_dictionary_are_not_weighed_by_all_of_it(table, tmp_path):
    long, source = repeated(table, 3000), tmp_path / "a.parquet"
    words = pa.array([f"{k:05d}" * 2000 for k in range(500)])
    column = pa.DictionaryArray.from_arrays(pa.array(np.arange(3000, dtype=np.int32) % 500), words)
    pq.write_table(long.append_column("text", column), source)
    with _opened(source) as file:
        assert _rows_at_once(file, Part(0, source, 0, 3000)) == 3000
