"""Datasets on a Dask cluster: the rows are the local ones, and a killed worker costs none of them."""

import os
import signal
import subprocess
import sys
import threading
import time

import dask
import dask.dataframe as dd
import distributed
import pyarrow.parquet as pq
import pytest
from support.random_datasets import as_table, grasp_rows, repeated

import graspforce as gf
from graspforce.datasets.options import GradeOptions
from graspforce.datasets.parts import Part, grade_part

PARTS = 40


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster


@pytest.fixture
def client(cluster):
    with distributed.Client(cluster) as client:
        client.wait_for_workers(2)
        yield client


@pytest.fixture(scope="module")
def table():
    rows = grasp_rows(200, 2)
    rows[50]["friction"][1] = -1.0
    return repeated(as_table(rows), 200 * PARTS)


@pytest.fixture(scope="module")
def source(table, tmp_path_factory):
    path = tmp_path_factory.mktemp("dataset") / "grasps.parquet"
    pq.write_table(table, path, row_group_size=1500)
    return path


@pytest.fixture(scope="module")
def local(source):
    out = source.parent / "local"
    return out, gf.grade(source, out, rows_per_part=200)


def contents(out):
    return {path.name: path.read_bytes() for path in out.glob("part-*.parquet")}


def test_a_worker_killed_in_mid_run_costs_no_row(client, source, local, tmp_path):
    out, killed = tmp_path / "out", []
    workers = list(client.run(os.getpid).values())

    def kill_one():
        while len(list(out.glob("part-*.parquet"))) < 5:
            time.sleep(0.002)
        os.kill(workers[0], signal.SIGKILL)
        killed.append(len(list(out.glob("part-*.parquet"))))

    killer = threading.Thread(target=kill_one)
    killer.start()
    seen = []
    found = gf.grade(source, out, rows_per_part=200, client=client, progress=lambda *told: seen.append(told))
    killer.join()
    assert killed[0] < PARTS
    assert contents(out) == contents(local[0])
    assert (found.statuses, found.closures) == (local[1].statuses, local[1].closures)
    assert found.graded_rows == 200 * PARTS
    assert seen[0] == (0, 200 * PARTS)
    assert seen[-1] == (200 * PARTS, 200 * PARTS)
    client.wait_for_workers(2)
    assert workers[0] not in client.run(os.getpid).values()


def test_a_local_run_may_be_finished_on_a_cluster(client, source, local, tmp_path):
    def interrupt(done, _total):
        if done > 2000:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gf.grade(source, tmp_path / "out", rows_per_part=200, progress=interrupt)
    found = gf.grade(source, tmp_path / "out", rows_per_part=200, client=client)
    assert found.graded_parts == PARTS - 10
    assert contents(tmp_path / "out") == contents(local[0])


def test_the_command_grades_on_the_cluster_of_an_address(client, source, local, tmp_path):
    command = [sys.executable, "-m", "graspforce", "grade", str(source), "--out", "out"]
    command += ["--rows-per-part", "200", "--scheduler", client.scheduler.address]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert contents(tmp_path / "out") == contents(local[0])


def test_an_error_on_a_worker_is_the_same_error_here(client, source, tmp_path):
    gone = tmp_path / "gone.parquet"
    gone.write_bytes(source.read_bytes())

    def remove(_done, _total):
        gone.unlink(missing_ok=True)

    with pytest.raises(gf.InvalidFileError, match=r"gone\.parquet"):
        gf.grade(gone, tmp_path / "out", rows_per_part=200, client=client, progress=remove)


def test_a_worker_of_another_version_does_not_take_part(source, tmp_path):
    with pytest.raises(gf.GraspForceError, match=r"started the run 0\.0\.1"):
        grade_part(Part(0, source, 0, 10), tmp_path, GradeOptions(), "run", version="0.0.1")


def test_a_straggler_writes_nothing_into_the_folder_of_a_later_run(source, tmp_path):
    tmp_path.joinpath("_grade.json").write_text("another run")
    with pytest.raises(gf.GraspForceError, match="belongs to another run now"):
        grade_part(Part(0, source, 0, 10), tmp_path, GradeOptions(), "this run")
    assert [path.name for path in tmp_path.iterdir()] == ["_grade.json"]


def test_a_client_is_a_client(source, tmp_path):
    with pytest.raises(gf.InvalidInputError, match=r"client: 'tcp://.*is not a distributed\.Client"):
        gf.grade(source, tmp_path / "out", client="tcp://127.0.0.1:8786")


@pytest.mark.parametrize("backend", [None, "pyarrow"])
def test_a_dask_frame_is_graded_partition_by_partition(client, table, source, local, backend):
    options = {} if backend is None else {"dtype_backend": backend}
    frame = dd.read_parquet(source, split_row_groups=True, **options)
    assert frame.npartitions > 2
    graded = gf.grade(frame)
    found = client.compute(graded).result()
    expected = pq.read_table(local[0])
    assert found["number"].tolist() == table["number"].to_pylist()
    for name in expected.column_names[table.num_columns :]:
        column = found[name].astype(object).where(found[name].notna(), None)
        assert column.tolist() == expected[name].to_pylist()
    assert graded.dtypes.equals(found.dtypes)


def test_a_dask_frame_that_cannot_be_graded_is_refused_before_it_is_computed(source):
    frame = dd.read_parquet(source)
    with pytest.raises(gf.InvalidInputError, match="column friction: not among"):
        gf.grade(frame[[name for name in frame.columns if name != "friction"]])
    # Dask's default, which makes text of lists.
    with dask.config.set({"dataframe.convert-string": True}):
        text = dd.from_pandas(pq.read_table(source).slice(0, 10).to_pandas(), npartitions=1)
    with pytest.raises(gf.InvalidInputError, match=r"column positions: .*dataframe\.convert-string"):
        gf.grade(text)
