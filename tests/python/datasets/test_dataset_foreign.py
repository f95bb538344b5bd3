"""Files of strangers in a folder of results: no run deletes them, writes over them or waits for them."""

import json
import os

import pyarrow.parquet as pq
import pytest
from support.random_datasets import as_table, grasp_rows, state

import graspforce as gf

FIRST, SECOND = "part-000000.parquet", "part-000001.parquet"
ROWS = 60


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "data" / "a.parquet"
    path.parent.mkdir()
    pq.write_table(as_table(grasp_rows(ROWS, 2)), path)
    return path


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def grade(source, out, **options):
    return gf.grade(source, out, criteria="sum", **{"rows_per_part": 20, **options})


def test_overwriting_beside_a_foreign_file_is_refused_and_changes_nothing(source, tmp_path):
    out = tmp_path / "out"
    grade(source, out)
    (out / "notes.txt").write_text("precious")
    before = state(out)
    with pytest.raises(gf.ResumeError, match=r"notes\.txt, which no run of grade wrote"):
        grade(source, out, edges=6, overwrite=True)
    assert state(out) == before


@pytest.mark.parametrize("name", ["part-000099.parquet", "part-000003.parquet", FIRST])
@pytest.mark.parametrize("kind", ["link", "dead link", "file", "copy", "folder", "pipe"])
def test_a_foreign_part_is_neither_deleted_nor_written_over(source, tmp_path, name, kind):
    out = tmp_path / "out"
    grade(source, out)
    mine = tmp_path / "precious.parquet"
    if kind != "dead link":
        mine.write_bytes(source.read_bytes())
    (out / name).unlink(missing_ok=True)
    if kind in ("file", "copy"):
        # A copy of another part, or of a part of another run, is the user's too.
        (out / name).write_bytes((source if kind == "file" else out / SECOND).read_bytes())
    elif kind == "folder":
        (out / name).mkdir()
    elif kind == "pipe":
        os.mkfifo(out / name)
    else:
        (out / name).symlink_to(mine)
    before = state(out), names(out)
    with pytest.raises(gf.ResumeError, match=rf"{name}, which no run of grade wrote"):
        grade(source, out, edges=6, overwrite=True)
    if name == FIRST:
        with pytest.raises(gf.GraspForceError, match=FIRST):
            grade(source, out)
    assert (state(out), names(out)) == before
    assert (out / name).is_symlink() == kind.endswith("link")


def test_a_foreign_part_that_appears_while_results_are_replaced_stays(source, tmp_path):
    out = tmp_path / "out"
    grade(source, out)
    mine = source.read_bytes()

    def appear(_done, _total):
        (out / FIRST).write_bytes(mine)

    with pytest.raises(gf.ResumeError, match=f"{FIRST}, which no run of grade wrote"):
        grade(source, out, edges=6, overwrite=True, progress=appear)
    assert (out / FIRST).read_bytes() == mine
    (out / FIRST).unlink()
    assert grade(source, out, edges=6, overwrite=True).graded_parts == 0


@pytest.mark.parametrize("folder", [".graspforce-new", ".graspforce-finished"])
@pytest.mark.parametrize("name", [FIRST, "notes.txt", ".notes"])
def test_foreign_files_in_a_run_s_own_folders_stay(source, tmp_path, folder, name):
    out = tmp_path / "out"
    grade(source, out)
    (out / folder).mkdir()
    (out / folder / name).write_text("precious")
    before = state(out)
    with pytest.raises(gf.ResumeError, match=f"{name}, which no run of grade wrote"):
        grade(source, out, edges=6, overwrite=True)
    assert state(out) == before


def test_a_folder_of_something_else_gets_no_file_not_even_a_lock(source, tmp_path):
    (tmp_path / "notes.txt").write_text("precious")
    before = names(tmp_path)
    with pytest.raises(gf.ResumeError, match="which no run of grade wrote"):
        grade(source, tmp_path, overwrite=True)
    assert names(tmp_path) == before


def test_hidden_files_that_no_run_has_written_stay(source, tmp_path):
    out = tmp_path / "out"
    grade(source, out)
    names = [".part-a.parquet.backup.tmp", f".{FIRST}.backup.tmp", "._grade.json.tmp", ".notes"]
    for name in names:
        (out / name).write_text("precious")
    grade(source, out)
    grade(source, out, edges=6, overwrite=True)
    assert all((out / name).read_text() == "precious" for name in names)
    assert json.loads((out / "_grade.json").read_text())["options"]["edges"] == 6
