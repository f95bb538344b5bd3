"""Under a memory limit a call that is too large raises; the interpreter goes on."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support import limited_memory

import graspforce as gf

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux")

# Arguments, call, and megabytes that suffice for it.
CALLS = {
    "solve_many": ("np.zeros((1_000_000, 3))", "distributor.solve_many(given)", 400),
    "solve_many in parallel": (
        "np.zeros((1_000_000, 3))", "distributor.solve_many(given, parallel=True)", 400,
    ),
    "float32": ("np.zeros((1_000_000, 3), np.float32)", "distributor.solve_many(given)", 400),
    "resistance": ("np.full((1_000_000, 3), np.inf)", "grasp.resistance(given)", 0),
    "TriangleTree": (
        "np.random.default_rng(0).normal(size=(1000, 3)), np.arange(900_000).reshape(-1, 3) % 1000",
        "TriangleTree(*given)", 400,
    ),
    "closest": (
        "TriangleTree(np.eye(3), [(0, 1, 2)]), np.zeros((1_000_000, 3))", "given[0].closest(given[1])", 600,
    ),
    "quality_many": (
        "np.zeros((400_000, 2, 2))", "gf.quality_many(given, given)", 0,
    ),
    "errors": ("gf.quality_many(*np.zeros((2, 200_000, 1, 2)))", "given.errors", 400),
    "pickle": ("gf.quality_many(*np.zeros((2, 200_000, 1, 2)))", "given.__reduce__()", 400),
    # More than the heap may have left over from what was freed before.
    "columns": (
        "gf.quality_many(*np.zeros((2, 400_000, 1, 2)))", "[given.rho for _ in range(50)]", 400,
    ),
}  # fmt: skip

# Kinds whose memory is taken in many pieces: its sum is tried beforehand.
SWEPT = {
    "errors": ("np.zeros((2, 100_000, 1, 2))", "gf.quality_many(*given).errors"),
    "batch to_dict": ("gf.quality_many(*np.zeros((2, 100_000, 1, 2)))", "given.to_dict()"),
    "enumerated": (
        "gf.Grasp(*around(5), edges=9)",
        "gf.ForceDistributor(given, method='enumerated').solve([0, 0, -1, 0, 0, 0])",
    ),
    "minkowski_sum": ("gf.Grasp(*around(5), edges=9)", "given.minkowski_sum()"),
    "soft fingers": ("around(16)", "gf.Grasp(*given, edges=300, torsion=0.1)"),
    "grasp": ("around(60_000)", "gf.Grasp(*given, edges=5)"),
    "given forces": (
        "(*around(3), [np.tile([1.0, 0, 0], (60_000, 1))] * 3)",
        "gf.Grasp(*given[:2], extreme_forces=given[2])",
    ),
    "to_dict": ("gf.Grasp(*around(60_000), edges=5)", "given.to_dict()"),
    "quality": ("gf.Grasp(*around(60_000), edges=5)", "given.quality('sum', rtol=0.5)"),
    "gradient": ("gf.Grasp(*around(200_000), edges=3)", "given._gradient('sum')"),
    "solve": ("gf.Grasp(*around(20_000), edges=5)", "gf.ForceDistributor(given).solve([0, 0, -1, 0, 0, 0])"),
    "nearest": (
        "gf.ForceDistributor(gf.Grasp(*around(20_000), edges=5))", "given.nearest([0, 0, -1e7, 0, 0, 0])",
    ),
    "nearest of many": (
        "gf.ForceDistributor(gf.Grasp(*around(20_000), edges=5))",
        "given.solve_many(np.full((1, 6), -1e7), infeasible='nearest')",
    ),
    "set_limits": (
        "gf.ForceDistributor(gf.Grasp(*around(20_000), edges=5))", "given.set_limits(np.full(20_000, 2.0))",
    ),
    "candidates": (
        "np.random.default_rng(0).normal(size=(20_000, 4, 3))", "CandidateSearch(3).best(given, -given)",
    ),
    "pickle": ("distributor.solve_many(np.zeros((300_000, 3)))", "copy.deepcopy(given)"),
}  # fmt: skip


@pytest.fixture(scope="module")
def tried():
    """Return a function that makes a call with some megabytes after others, until they suffice."""
    threads = {"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # A module, for files of the standard library and of these tests have the same names.
    command = [sys.executable, "-m", "support.limited_memory"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, **threads},
        cwd=Path(limited_memory.__file__).parents[1],
    ) as running:  # fmt: skip

        def run(given, call, rooms):
            running.stdin.write(json.dumps([given, call, rooms]) + "\n")
            running.stdin.flush()
            return json.loads(running.stdout.readline())

        yield run
        running.stdin.close()


def refused(told):
    return told.startswith(("TooLargeError", "MemoryError", "_ArrayMemoryError"))


@pytest.mark.parametrize("name", SWEPT)
def test_whatever_the_limit_an_allocation_that_fails_is_an_error(name, tried):
    found = tried(*SWEPT[name], (3, 12, 30, 60, 120, 500, 1000))
    for room, code, told in found:
        assert code == 0, (room, told)
        assert refused(told) or told == "answered", (room, told)
    assert told == "answered", "a gigabyte does not suffice"


@pytest.mark.parametrize("name", CALLS)
def test_what_does_not_fit_into_memory_is_an_error_and_the_process_goes_on(name, tried):
    given, call, enough = CALLS[name]
    found = tried(given, call, (2, 16, *([enough] if enough else [])))
    for room, code, told in found:
        assert code == 0, (room, told)
        assert refused(told) or room != 2, told
    assert told == "answered" or not enough


def test_the_error_is_of_the_library_and_a_memory_error():
    assert issubclass(gf.TooLargeError, gf.GraspForceError)
    assert issubclass(gf.TooLargeError, MemoryError)
