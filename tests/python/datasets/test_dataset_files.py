"""Datasets in Parquet files: bounded, resumable after a kill, the same rows whatever happened on the way."""

import json
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.random_datasets import as_table, grasp_rows, repeated

import graspforce as gf
from graspforce.cli.exit_codes import BAD_FILE, DONE, FAILED
from graspforce.cli.main import main
from graspforce.datasets import GradeSummary

PART = "part-000000.parquet"


@pytest.fixture(scope="module")
def table():
    """Return planar grasps, a bad one among them, with columns of other kinds."""
    rows = grasp_rows(300, 2)
    rows[100]["friction"][1] = -1.0
    table = as_table(rows)
    return table.append_column("object", pa.array(["cup", None, "bowl"] * 100).dictionary_encode())


@pytest.fixture(scope="module")
def expected(table):
    return gf.grade(table)


def contents(out):
    return {path.name: path.read_bytes() for path in out.glob("part-*.parquet")}


def hidden(out):
    return sorted(path.name for path in out.iterdir() if not path.name.startswith("part-"))


@pytest.mark.parametrize("row_group_size", [7, 100, 300])
@pytest.mark.parametrize("rows_per_part", [32, 100, 1000])
def test_rows_are_the_same_whatever_row_groups_and_parts(
    table, expected, tmp_path, row_group_size, rows_per_part
):
    pq.write_table(table, tmp_path / "grasps.parquet", row_group_size=row_group_size)
    summary = gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=rows_per_part)
    found = pq.read_table(tmp_path / "out")
    assert found.schema == expected.schema
    assert found.to_pylist() == expected.to_pylist()
    parts = sorted((tmp_path / "out").glob("*.parquet"))
    assert [path.name for path in parts] == [f"part-{k:06d}.parquet" for k in range(len(parts))]
    assert len(parts) == summary.parts == -(-300 // rows_per_part)
    assert summary.rows == summary.graded_rows == 300
    assert summary.statuses == {"converged": 299, "bracketed": 0, "invalid": 1}
    assert sum(summary.closures.values()) == 299


@pytest.mark.parametrize("pattern", ["", "*.parquet", "**/*.parquet"])
def test_folders_and_patterns_are_read_in_the_order_of_names(table, expected, tmp_path, pattern):
    source = tmp_path / "source"
    source.mkdir()
    for k in range(3):
        pq.write_table(table.slice(100 * k, 100), source / f"{k}.parquet")
    (source / "_SUCCESS").touch()
    (source / ".hidden").mkdir()
    found = gf.grade(source / pattern, tmp_path / "out", rows_per_part=64)
    assert found.parts == 6
    assert pq.read_table(tmp_path / "out").to_pylist() == expected.to_pylist()


def test_an_empty_file_gives_an_empty_part_with_all_columns(table, expected, tmp_path):
    pq.write_table(table.slice(0, 0), tmp_path / "empty.parquet")
    assert gf.grade(tmp_path / "empty.parquet", tmp_path / "out").rows == 0
    found = pq.read_table(tmp_path / "out")
    assert len(found) == 0
    assert found.schema == expected.schema
    assert gf.grade(tmp_path / "empty.parquet", tmp_path / "out").graded_parts == 0


GRADE = """
import sys, graspforce as gf
gf.grade(sys.argv[1], sys.argv[2], rows_per_part=int(sys.argv[3]))
"""


def start(source, out, rows_per_part):
    return subprocess.Popen([sys.executable, "-c", GRADE, str(source), str(out), str(rows_per_part)])


def wait_for_parts(run, out, count):
    deadline = time.monotonic() + 60
    while len(list(out.glob("part-*.parquet"))) < count:
        assert run.poll() is None, "ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_a_run_killed_twice_goes_on_to_the_same_bytes(table, tmp_path):
    source, whole, out = tmp_path / "grasps.parquet", tmp_path / "whole", tmp_path / "out"
    pq.write_table(repeated(table, 8000), source, row_group_size=1500)
    gf.grade(source, whole, rows_per_part=200)
    luck = random.Random(4)
    for least in (3, 15):
        with start(source, out, 200) as run:
            wait_for_parts(run, out, least)
            time.sleep(luck.uniform(0, 0.05))
            run.send_signal(signal.SIGKILL)
        done = len(list(out.glob("part-*.parquet")))
        assert least <= done < 40
    # What a kill while writing leaves behind, whether or not one of these two met such a moment.
    (out / f".{PART}.0123.tmp").write_bytes(b"half")
    summary = gf.grade(source, out, rows_per_part=200)
    assert summary.rows == 8000
    assert summary.graded_parts == 40 - done
    assert contents(out) == contents(whole)
    assert hidden(out) == [".lock", "_grade.json"]


def test_a_finished_run_does_nothing(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    first = gf.grade(tmp_path / "grasps.parquet", tmp_path / "out")
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("part-*")}
    again = gf.grade(tmp_path / "grasps.parquet", tmp_path / "out")
    assert (again.graded_rows, again.graded_parts) == (0, 0)
    assert (again.rows, again.statuses, again.closures) == (first.rows, first.statuses, first.closures)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("part-*")} == before


def test_a_lost_part_is_graded_again(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=100)
    before = contents(tmp_path / "out")
    (tmp_path / "out" / "part-000001.parquet").unlink()
    assert gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=100).graded_rows == 100
    assert contents(tmp_path / "out") == before


def test_a_part_with_other_rows_is_refused(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=100)
    pq.write_table(pq.read_table(tmp_path / "out" / PART).slice(1), tmp_path / "out" / PART)
    with pytest.raises(gf.ResumeError, match=r"part-000000\.parquet: holds 99 rows, expected 100"):
        gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=100)
    (tmp_path / "out" / PART).write_bytes(b"nothing")
    with pytest.raises(gf.InvalidFileError, match=r"part-000000\.parquet"):
        gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=100)


def test_other_options_and_other_sources_are_told_apart(table, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    pq.write_table(table, source / "a.parquet")
    gf.grade(source, out, criteria="sum")
    with pytest.raises(gf.ResumeError, match=r"edges was 8, is 6.*overwrite"):
        gf.grade(source, out, criteria="sum", edges=6)
    with pytest.raises(
        gf.ResumeError, match=r"criteria was \['sum'\], is \['max'\]; rtol was None, is 0.001"
    ):
        gf.grade(source, out, criteria="max", rtol=1e-3)
    with pytest.raises(gf.ResumeError, match="rows_per_part was 50000, is 10"):
        gf.grade(source, out, criteria="sum", rows_per_part=10)
    pq.write_table(table, source / "b.parquet")
    with pytest.raises(gf.ResumeError, match=r"b\.parquet is new"):
        gf.grade(source, out, criteria="sum")
    (source / "b.parquet").unlink()
    # As many rows and bytes, and one other number.
    limits = np.full(len(table), 2.0)
    column = table.schema.get_field_index("max_normal_force")
    for last in (3.0, 4.0):
        limits[-1] = last
        changed = table.set_column(column, "max_normal_force", pa.array(limits))
        pq.write_table(changed, source / "a.parquet", compression="none", use_dictionary=False)
        if last == 3.0:
            gf.grade(source, out, criteria="sum", overwrite=True)
    with pytest.raises(gf.ResumeError, match=r"a\.parquet has changed"):
        gf.grade(source, out, criteria="sum")
    (source / "a.parquet").rename(source / "c.parquet")
    with pytest.raises(gf.ResumeError, match=r"a\.parquet is missing; c\.parquet is new"):
        gf.grade(source, out, criteria="sum")


def test_a_moved_dataset_is_the_same_dataset(table, tmp_path):
    (tmp_path / "here").mkdir()
    pq.write_table(table, tmp_path / "here" / "a.parquet")
    gf.grade(tmp_path / "here", tmp_path / "out", criteria="sum")
    (tmp_path / "here").rename(tmp_path / "there")
    assert gf.grade(tmp_path / "there", tmp_path / "out", criteria="sum").graded_parts == 0


def test_starting_over_leaves_no_part_of_the_run_before(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=10)
    found = gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", rows_per_part=150, overwrite=True)
    assert (found.parts, found.graded_parts) == (2, 2)
    assert len(contents(tmp_path / "out")) == 2


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_of_something_else_is_left_alone(table, tmp_path, overwrite):
    pq.write_table(table, tmp_path / "grasps.parquet")
    out = tmp_path / "out"
    out.mkdir()
    (out / PART).write_text("precious")
    with pytest.raises(gf.ResumeError, match=r"part-000000\.parquet, which no run of grade wrote"):
        gf.grade(tmp_path / "grasps.parquet", out, overwrite=overwrite)
    assert (out / PART).read_text() == "precious"


def test_two_runs_at_once_are_refused(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    refused = []

    def again(_done, _total):
        if not refused:
            with pytest.raises(gf.BusyError, match="another run"):
                gf.grade(tmp_path / "grasps.parquet", tmp_path / "out")
            refused.append(True)

    gf.grade(tmp_path / "grasps.parquet", tmp_path / "out", progress=again)
    assert refused


def test_an_interrupt_leaves_whole_parts_only_and_is_resumed(table, expected, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")

    def interrupt(done, _total):
        if done > 150:
            raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        gf.grade(tmp_path / "grasps.parquet", out, rows_per_part=50, progress=interrupt)
    assert len(contents(out)) == 3
    assert hidden(out) == [".lock", "_grade.json"]
    assert gf.grade(tmp_path / "grasps.parquet", out, rows_per_part=50).graded_rows == 150
    assert pq.read_table(out).to_pylist() == expected.to_pylist()


SMALL_DISK = """
import resource, sys, graspforce as gf
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
gf.grade(sys.argv[1], sys.argv[2])
"""


def test_a_full_disk_leaves_no_half_part(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    command = [sys.executable, "-c", SMALL_DISK, str(tmp_path / "grasps.parquet"), str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert hidden(tmp_path / "out") == [".lock", "_grade.json"]
    assert contents(tmp_path / "out") == {}


PEAK = """
import sys, graspforce as gf
options = {"criteria": "sum", "rows_per_part": 1000}
print(*(gf.grade(sys.argv[k], sys.argv[3] + f"/out{k}", **options).peak_bytes for k in (1, 2)))
"""


def test_memory_is_bounded_by_parts_and_not_by_row_groups_or_payload(table, tmp_path):
    # 400 MB in one row group, most of it a payload that is only passed on.
    count = 8000
    long = repeated(table, count)
    payload = np.random.default_rng(0).bytes(50_000)
    long = long.append_column("payload", pa.array([payload[k % 97 :] for k in range(count)], pa.binary()))
    pq.write_table(long, tmp_path / "long.parquet", use_dictionary=False, compression="none")
    pq.write_table(repeated(table, 1000), tmp_path / "short.parquet")
    names = [tmp_path / "short.parquet", tmp_path / "long.parquet", tmp_path]
    command = [sys.executable, "-c", PEAK, *map(str, names)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    short, peak = map(int, done.stdout.split())
    assert peak - short < 330e6
    found = pq.read_table(tmp_path / "out2", columns=["payload", "number"])
    assert found["payload"].combine_chunks().equals(long["payload"].combine_chunks())


def test_files_that_cannot_be_graded_are_named_before_any_work(table, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    with pytest.raises(gf.InvalidFileError, match="not a file"):
        gf.grade(source, out)
    with pytest.raises(gf.InvalidFileError, match="not a file"):
        gf.grade(tmp_path / "missing.parquet", out)
    pq.write_table(table, source / "a.parquet")
    pq.write_table(table.drop_columns(["normals"]), source / "b.parquet")
    with pytest.raises(gf.InvalidFileError, match=r"b\.parquet: column normals"):
        gf.grade(source, out)
    pq.write_table(table.append_column("more", table["id"]), source / "b.parquet")
    with pytest.raises(
        gf.InvalidFileError, match=r"b\.parquet: columns differ from those of .*a\.parquet: .*more"
    ):
        gf.grade(source, out)
    (source / "b.parquet").write_text("text")
    with pytest.raises(gf.InvalidFileError, match=r"b\.parquet"):
        gf.grade(source, out)
    (source / "b.parquet").unlink()
    (source / "object=cup").mkdir()
    pq.write_table(table, source / "object=cup" / "a.parquet")
    with pytest.raises(gf.InvalidFileError, match="object=cup"):
        gf.grade(source, out)
    with pytest.raises(gf.InvalidInputError, match="out: missing"):
        gf.grade(source)
    with pytest.raises(gf.InvalidInputError, match="lies in the folder of the source"):
        gf.grade(source, source / "graded")
    with pytest.raises(gf.InvalidInputError, match="rows_per_part"):
        gf.grade(source / "a.parquet", out, rows_per_part=0)
    with pytest.raises(gf.InvalidInputError, match="is a file"):
        gf.grade(source / "a.parquet", source / "a.parquet")
    assert not out.exists()


def test_a_file_of_another_version_is_another_run(table, tmp_path):
    pq.write_table(table, tmp_path / "grasps.parquet")
    gf.grade(tmp_path / "grasps.parquet", tmp_path / "out")
    manifest = tmp_path / "out" / "_grade.json"
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "graspforce": "0.0.1"}))
    with pytest.raises(gf.ResumeError, match=f"graspforce was 0.0.1, is {gf.__version__}"):
        gf.grade(tmp_path / "grasps.parquet", tmp_path / "out")
    manifest.write_text("[")
    with pytest.raises(gf.ResumeError, match=r"_grade\.json"):
        gf.grade(tmp_path / "grasps.parquet", tmp_path / "out")


def test_the_command_prints_a_summary_and_goes_on(table, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pq.write_table(table, "grasps.parquet")
    command = ["grade", "grasps.parquet", "--out", "graded", "--rows-per-part", "128"]
    assert main(command) == DONE
    printed = capsys.readouterr()
    assert "rows a second" in printed.out
    assert printed.err == ""
    assert main(command) == DONE
    assert "nothing was done" in capsys.readouterr().out
    assert main([*command, "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["statuses"] == {"converged": 299, "bracketed": 0, "invalid": 1}
    assert set(found) == {*GradeSummary.__dataclass_fields__, "rows_per_second"}
    assert main([*command, "--edges", "0"]) == FAILED
    assert "edges was 8, is None" in capsys.readouterr().err
    assert main(["grade", "missing.parquet", "--out", "other"]) == BAD_FILE
    assert main([*command, "--edges", "0", "--criterion", "sum", "--overwrite"]) == DONE
    assert "rho_max" not in pq.read_schema(f"graded/{PART}").names


@pytest.mark.parametrize(
    ("flags", "told"),
    [([], "the same command continues the run"), (["--overwrite"], "without --overwrite continues the run")],
)
def test_the_command_stops_at_once_when_interrupted_and_says_how_to_go_on(table, tmp_path, flags, told):
    pq.write_table(repeated(table, 50_000), tmp_path / "grasps.parquet")
    command = [sys.executable, "-m", "graspforce", "grade", "grasps.parquet", "--out", "graded", *flags]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as run:
        deadline = time.monotonic() + 60
        while not list((tmp_path / "graded").glob(".part-0*")):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        begin = time.monotonic()
        os.kill(run.pid, signal.SIGINT)
        assert told in run.communicate()[1]
        assert time.monotonic() - begin < 5
    assert run.returncode == FAILED
    assert hidden(tmp_path / "graded") == [".lock", "_grade.json"]
