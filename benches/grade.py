"""How fast a dataset is graded, with how much memory, and whether it survives being killed.

One million random grasps of 4 to 6 contacts and 8 edges (fewer with ``--rows``) are graded by each criterion
and by both; then again by runs that are killed twice, and on a local Dask cluster that loses a worker. All
parts must be the same bytes.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import distributed
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import graspforce as gf

ROWS_PER_PART = 50_000

GRADE = """
import sys, graspforce as gf
found = gf.grade(sys.argv[1], sys.argv[2], criteria=sys.argv[3].split(","), rows_per_part=int(sys.argv[4]))
print(found.rows_per_second, found.peak_bytes, found.statuses, found.closures, sep="|")
"""


def dataset(rows: int, seed: int = 1) -> pa.Table:
    """Return contacts spread over ellipsoids of 2 to 8 cm, normals near their own."""
    rng = np.random.default_rng(seed)
    contacts = rng.integers(4, 7, rows)
    offsets = np.concatenate([[0], np.cumsum(contacts)]).astype(np.int32)
    total = int(offsets[-1])
    outward = rng.normal(size=(total, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    positions = outward * np.repeat(rng.uniform(0.02, 0.08, (rows, 3)), contacts, axis=0)
    normals = -outward + 0.2 * rng.normal(size=(total, 3))

    def lists(values: np.ndarray) -> pa.Array:
        flat = pa.array(values.ravel())
        inner = flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
        return pa.ListArray.from_arrays(offsets, inner)

    return pa.table(
        {
            "id": np.arange(rows),
            "positions": lists(positions),
            "normals": lists(normals),
            "friction": lists(rng.uniform(0.3, 1.0, total)),
            "max_normal_force": lists(rng.uniform(1.0, 20.0, total)),
            "length_scale": np.full(rows, 0.05),
        }
    )


def command(source: Path, out: Path, criteria: str, rows_per_part: int) -> list[str]:
    return [sys.executable, "-c", GRADE, str(source), str(out), criteria, str(rows_per_part)]


def graded_parts(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in out.glob("part-*.parquet")}


def wait_for(out: Path, parts: int) -> None:
    while len(list(out.glob("part-*.parquet"))) < parts:
        time.sleep(0.05)


def throughput(source: Path, folder: Path, rows: int, rows_per_part: int) -> None:
    names = ("criteria", "grasps / s", "grasps / core second", "core hours / million", "peak memory (MiB)")
    print(f"| {' | '.join(names)} |\n{'|---' * len(names)}|")
    for criteria in ("max", "sum", "max,sum"):
        before = os.times()
        out = folder / criteria
        text = subprocess.check_output(command(source, out, criteria, rows_per_part), text=True)
        after = os.times()
        cpu = after.children_user + after.children_system - before.children_user - before.children_system
        speed, peak, statuses, closures = text.strip().split("|")
        memory = int(peak) / 2**20
        hours = cpu / 3600 * 1e6 / rows
        print(f"| {criteria} | {float(speed):,.0f} | {rows / cpu:,.0f} | {hours:.3f} | {memory:.0f} |")
    print(f"\n{statuses}, closures {closures}")


def killed_twice(source: Path, folder: Path, rows_per_part: int, parts: int) -> None:
    out = folder / "killed"
    for share in (0.25, 0.6):
        with subprocess.Popen(command(source, out, "max,sum", rows_per_part)) as run:
            wait_for(out, int(share * parts) + 1)
            time.sleep(0.2)
            run.send_signal(signal.SIGKILL)
        print(f"killed after {len(list(out.glob('part-*.parquet')))} of {parts} parts")
    subprocess.run(command(source, out, "max,sum", rows_per_part), check=True, stdout=subprocess.DEVNULL)
    assert graded_parts(out) == graded_parts(folder / "max,sum")
    print("resumed: the same bytes as the run that was not killed")


def on_a_cluster(source: Path, folder: Path, rows_per_part: int, parts: int) -> None:
    out = folder / "cluster"
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        workers = list(client.run(os.getpid).values())

        def kill_one() -> None:
            wait_for(out, parts // 4 + 1)
            os.kill(workers[0], signal.SIGKILL)
            print(f"worker killed after {len(list(out.glob('part-*.parquet')))} of {parts} parts")

        killer = threading.Thread(target=kill_one)
        killer.start()
        found = gf.grade(source, out, rows_per_part=rows_per_part, client=client)
        killer.join()
    assert graded_parts(out) == graded_parts(folder / "max,sum")
    print(
        f"Dask, {found.rows_per_second:,.0f} grasps a second, a worker lost: the same bytes as the local run"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000, help="grasps in the dataset")
    rows = parser.parse_args().rows
    rows_per_part = min(ROWS_PER_PART, max(rows // 20, 1))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = folder / "grasps.parquet"
        # One row group, as pyarrow writes by default up to a million rows.
        pq.write_table(dataset(rows), source, row_group_size=rows)
        size = source.stat().st_size / 2**20
        print(f"{rows:,} grasps, 4 to 6 contacts, 8 edges, {size:.0f} MiB; {os.cpu_count()} cores\n")
        parts = -(-rows // rows_per_part)
        throughput(source, folder, rows, rows_per_part)
        killed_twice(source, folder, rows_per_part, parts)
        on_a_cluster(source, folder, rows_per_part, parts)


if __name__ == "__main__":
    main()
