"""Attacks on runs over datasets: kills while results are replaced, sources that change, footers that lie."""

import os
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.random_datasets import as_table, grasp_rows, state

import graspforce as gf
from graspforce.datasets import grade_table

FIRST, SECOND = "part-000000.parquet", "part-000001.parquet"
ROWS = 60


@pytest.fixture(scope="module")
def table():
    return as_table(grasp_rows(ROWS, 2))


@pytest.fixture
def source(table, tmp_path):
    path = tmp_path / "data" / "a.parquet"
    path.parent.mkdir()
    pq.write_table(table, path)
    return path


def grade(source, out, **options):
    return gf.grade(source, out, criteria="sum", **{"rows_per_part": 20, **options})


def test_an_interrupted_replacement_leaves_the_old_results_and_goes_on(source, tmp_path):
    out = tmp_path / "out"
    grade(source, out)
    before = state(out)

    def interrupt(done, _total):
        if done > 25:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        grade(source, out, edges=6, overwrite=True, progress=interrupt)
    assert before.items() <= state(out).items()
    assert grade(source, out).graded_parts == 0
    # The same question goes on where it was, whether or not it says again that it may overwrite.
    assert grade(source, out, edges=6, overwrite=True).graded_parts == 2
    assert sorted(state(out)) == ["_grade.json", FIRST, SECOND, "part-000002.parquet"]
    assert grade(source, out, edges=6).graded_parts == 0


# One process with everything imported is forked again and again: each child is killed a step later.
KILLED = """
import os, signal, sys
import graspforce as gf
from graspforce.datasets import grade_files, options
import pyarrow.parquet

source, folder = sys.argv[1:]

def child(work):
    pid = os.fork()
    if pid == 0:
        try:
            work()
        except BaseException as error:
            print(repr(error), flush=True)
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

def grade(out, **asked):
    return gf.grade(source, out, criteria="sum", **asked)

def killed_at(step):
    taken = 0
    def counting(call):
        def counted(*given, **named):
            nonlocal taken
            taken += 1
            if taken == step:
                os.kill(os.getpid(), signal.SIGKILL)
            return call(*given, **named)
        return counted
    for name in ("replace", "rename", "unlink", "rmdir", "mkdir"):
        setattr(os, name, counting(getattr(os, name)))

def attack(step):
    out = f"{folder}/{step}"
    assert child(lambda: grade(out, rows_per_part=30)) == 0
    def work():
        killed_at(step)
        grade(out, rows_per_part=60, edges=6, overwrite=True)
    return child(work) == 0

def main():
    for step in range(1, 100):
        if attack(step):
            print(step)
            return
main()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_a_kill_at_any_step_of_a_replacement_leaves_the_old_run_or_the_new_one(source, tmp_path):
    folder, old, new = tmp_path / "killed", tmp_path / "old", tmp_path / "new"
    folder.mkdir()
    grade(source, old, rows_per_part=30)
    grade(source, new, edges=6, rows_per_part=60)
    before, after = state(old), state(new)
    command = [sys.executable, "-c", KILLED, str(source), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    steps = int(done.stdout)
    assert steps > 8
    recovered = 0
    for step in range(1, steps):
        out = folder / str(step)
        found = state(out)
        if any(name.startswith(".graspforce-finished/") for name in found):
            # The new run counts already, and the next one says that it has put it in place.
            with pytest.raises(gf.ResumeError, match="another run"):
                grade(source, out, rows_per_part=30)
            assert state(out) == found
            summary = grade(source, out, edges=6, rows_per_part=60)
            assert (summary.recovered, summary.graded_parts) == (True, 0)
            recovered += 1
        elif not after.items() <= found.items():
            assert before.items() <= found.items()
            assert grade(source, out, rows_per_part=30).graded_parts == 0
            grade(source, out, edges=6, rows_per_part=60, overwrite=True)
        grade(source, out, edges=6, rows_per_part=60)
        assert state(out) == after
        assert not [path for path in out.iterdir() if path.is_dir()]
    assert recovered >= 3


def other_rows(table):
    return table.take(pa.array(range(len(table) - 1, -1, -1)))


def replaced(path, table):
    pq.write_table(table, path.with_name("new"))
    path.with_name("new").replace(path)


def rewritten(path, table):
    times = path.stat()
    pq.write_table(table, path)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


@pytest.mark.parametrize("change", [replaced, rewritten])
@pytest.mark.parametrize("at", [0, 20, 40])
def test_a_source_that_changes_while_it_is_read_gives_no_mixed_results(source, table, tmp_path, change, at):
    changes = []

    def changing(done, _total):
        if done == at and not changes:
            changes.append(change(source, other_rows(table)))

    with pytest.raises(gf.InvalidFileError, match=r"a\.parquet: changed.*overwrite=True"):
        grade(source, tmp_path / "out", progress=changing)
    kept = [pq.read_table(path).column("id") for path in sorted((tmp_path / "out").glob("*.parquet"))]
    ids = [name for column in kept for name in column.to_pylist()]
    # Progress is told before a part ends, which is then not kept either.
    assert len(ids) in {at, max(0, at - 20)}
    assert ids == table.column("id").to_pylist()[: len(ids)]
    assert grade(source, tmp_path / "out", overwrite=True).rows == ROWS
    found = pq.read_table(tmp_path / "out").column("id").to_pylist()
    assert found == table.column("id").to_pylist()[::-1]


@pytest.mark.parametrize("change", ["copied", "other rows", "one bit"])
def test_a_run_goes_on_only_with_the_rows_that_its_parts_hold(source, table, tmp_path, change):
    def interrupt(done, _total):
        if done > 25:
            raise KeyboardInterrupt

    plain = {"compression": "none", "use_dictionary": False}
    pq.write_table(table, source, **plain)
    with pytest.raises(KeyboardInterrupt):
        grade(source, tmp_path / "out", progress=interrupt)
    # Of the same size, with the same footer and time: only its rows tell it from the source as it was.
    before, times = source.read_bytes(), source.stat()
    if change == "other rows":
        pq.write_table(other_rows(table), source, **plain)
    else:
        position = np.float64(table.column("positions")[3].as_py()[1][1]).tobytes()
        at = before.index(position)
        source.write_bytes(before[:at] + bytes([before[at] ^ (change == "one bit")]) + before[at + 1 :])
    os.utime(source, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert source.stat().st_size == len(before)
    if change == "copied":
        assert grade(source, tmp_path / "out").graded_parts == 2
    else:
        with pytest.raises(gf.ResumeError, match=rf"{FIRST}: does not hold the rows from row 0"):
            grade(source, tmp_path / "out")


def test_a_source_that_changes_within_a_part_leaves_no_part(source, table, tmp_path, monkeypatch):
    def changing(batch, options, progress=None):
        replaced(source, other_rows(table))
        return grade_table.grade_batch(batch, options, progress)

    monkeypatch.setattr("graspforce.datasets.parts.grade_batch", changing)
    with pytest.raises(gf.InvalidFileError, match="changed while"):
        grade(source, tmp_path / "out", rows_per_part=100)
    assert list((tmp_path / "out").glob("*.parquet")) == []


def test_a_part_with_rows_of_another_part_or_another_run_is_refused(source, table, tmp_path):
    out, other = tmp_path / "out", tmp_path / "other"
    grade(source, out)
    pq.write_table(other_rows(table), tmp_path / "b.parquet")
    grade(tmp_path / "b.parquet", other)
    right = (out / FIRST).read_bytes()
    (out / FIRST).write_bytes((out / SECOND).read_bytes())
    with pytest.raises(gf.ResumeError, match=rf"{FIRST}: does not hold the rows from row 0 of a\.parquet"):
        grade(source, out)
    (out / FIRST).write_bytes((other / FIRST).read_bytes())
    with pytest.raises(gf.ResumeError, match="does not hold the rows"):
        grade(source, out)
    pq.write_table(pq.read_table(out / SECOND).replace_schema_metadata(None), out / FIRST)
    with pytest.raises(gf.ResumeError, match="does not hold the rows"):
        grade(source, out)
    (out / FIRST).write_bytes(right)
    assert grade(source, out).graded_parts == 0


@pytest.mark.parametrize("links", [1, 2])
def test_files_behind_links_in_loops_are_graded_once(source, table, tmp_path, links):
    folder = source.parent
    for k in range(links):
        (folder / f"loop{k}").symlink_to(folder)
    (folder / "copy.parquet").symlink_to(source)
    os.link(source, folder / "same.parquet")
    (folder / "nowhere.parquet").symlink_to(folder / "nowhere.parquet")
    begin = time.monotonic()
    for number, pattern in enumerate(("**/*.parquet", "*/*.parquet", "", "**")):
        out = tmp_path / f"out{number}"
        assert gf.grade(folder / pattern, out, criteria="sum").rows == ROWS
        assert pq.read_table(out).column("id").equals(table.column("id"))
    assert time.monotonic() - begin < 20


def test_links_in_loops_are_errors_of_the_library(source, tmp_path):
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for given, out in ((loop, tmp_path / "out"), (source, loop), (source, loop / "below")):
        with pytest.raises(gf.GraspForceError, match="loop"):
            grade(given, out)


ODD = ["[]", "{}", "null", "[" * 100_000, '{"files": 5}', '{"files": [5], "rows_per_part": 20}', "\xff",
       '{"files": [{"name": 1}], "rows_per_part": 20}', '{"options": [], "files": [], "rows_per_part": 20}',
       '{"files": [{"name": "a"}], "rows_per_part": 0}', "1" * 5000]  # fmt: skip


@pytest.mark.parametrize("content", ODD, ids=range(len(ODD)))
def test_an_odd_manifest_is_refused_and_may_be_replaced(source, tmp_path, content):
    out = tmp_path / "out"
    grade(source, out)
    (out / "_grade.json").write_text(content, "latin-1")
    before = state(out)
    with pytest.raises(gf.ResumeError, match=r"_grade\.json: .*overwrite=True"):
        grade(source, out)
    assert state(out) == before
    assert grade(source, out, overwrite=True).graded_parts == 3


def test_a_manifest_that_is_no_file_is_an_error_of_the_library(source, tmp_path):
    for name, make in (("folder", lambda path: path.mkdir()), ("link", lambda path: path.symlink_to(path))):
        out = tmp_path / name
        out.mkdir()
        make(out / "_grade.json")
        for overwrite in (False, True):
            with pytest.raises(gf.GraspForceError, match=r"_grade\.json"):
                grade(source, out, overwrite=overwrite)


READ_ONLY = """
import sys, graspforce as gf
print(gf.grade(sys.argv[1], sys.argv[2], criteria="sum", rows_per_part=20).graded_parts)
"""


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
def test_a_finished_run_in_a_folder_that_cannot_be_written_to_does_nothing(source, tmp_path, monkeypatch):
    out = tmp_path / "out"
    grade(source, out)
    out.chmod(0o555)
    if os.geteuid() == 0:
        # Permissions do not bind the superuser: the lock is refused by hand.
        def refused(*_given, **_named):
            raise PermissionError(13, "Permission denied", str(out / ".lock"))

        monkeypatch.setattr("filelock.FileLock.acquire", refused)
    assert grade(source, out).graded_parts == 0
    with pytest.raises(gf.ResumeError, match="edges"):
        grade(source, out, edges=6)
    with pytest.raises(gf.InvalidInputError, match=r"out: .* is not writable"):
        grade(source, out, edges=6, overwrite=True)
    out.chmod(0o755)
    (out / SECOND).unlink()
    out.chmod(0o555)
    with pytest.raises(gf.InvalidInputError, match=f"is not writable, and {SECOND} is missing"):
        grade(source, out)


def test_an_error_of_the_caller_s_own_function_passes_as_it_is(source, tmp_path):
    def broken(_done, _total):
        raise BrokenPipeError("mine")

    with pytest.raises(BrokenPipeError, match="mine"):
        grade(source, tmp_path / "out", progress=broken)


def test_a_file_where_the_folder_should_be_made_is_an_error_of_the_library(source):
    with pytest.raises(gf.GraspForceError, match="Not a directory"):
        grade(source, source / "out")
