"""Under a memory limit a call that is too large raises; the interpreter goes on."""

import subprocess
import sys

import pytest

import graspforce as gf

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux")

# The limit is set a little above what the process uses with its arguments in place.
LIMITED = """
import pathlib, re, resource
import numpy as np
import graspforce as gf
from graspforce._core import TriangleTree

MIB = 1 << 20
grasp = gf.Grasp([(1, 0), (-1, 0.5)], [(-1, 0), (1, 0)])
distributor = gf.ForceDistributor(grasp)
angles = np.linspace(0, 2 * np.pi, 4, endpoint=False)
circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
gf.quality_many(circle[None], -circle[None])
given = {given}
status = pathlib.Path("/proc/self/status").read_text()
used = int(re.search(r"VmSize:\\s*([0-9]+)", status)[1]) * 1024
resource.setrlimit(resource.RLIMIT_AS, (used + {room} * MIB,) * 2)
try:
    {call}
    print("answered")
except MemoryError as error:
    print(type(error).__name__, error)
assert grasp.quality().closure in ("force", "partial", "none")
"""

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
    "columns": ("gf.quality_many(*np.zeros((2, 400_000, 1, 2)))", "given.rho, given.lower", 100),
}  # fmt: skip


# Kinds whose memory is taken in many pieces: its sum is tried beforehand.
LARGE = """
import numpy as np

def around(contacts):
    outward = np.random.default_rng(0).normal(size=(contacts, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    return outward, -outward

"""

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
    "solve": ("gf.Grasp(*around(20_000), edges=5)", "gf.ForceDistributor(given).solve([0, 0, -1, 0, 0, 0])"),
    "pickle": (
        "distributor.solve_many(np.zeros((300_000, 3)))", "__import__('copy').deepcopy(given)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SWEPT)
def test_whatever_the_limit_an_allocation_that_fails_is_an_error(name):
    given, call = SWEPT[name]
    for room in (3, 12, 30, 60, 120, 500):
        code = LIMITED.replace("{given}", given).replace("{call}", call).replace("{room}", str(room))
        child = subprocess.run(
            [sys.executable, "-c", LARGE + code], capture_output=True, text=True, timeout=60, check=False,
            env={"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        assert child.returncode == 0, (room, child.stderr[-2000:])
        if child.stdout == "answered\n":
            return
        assert child.stdout.startswith(("TooLargeError", "MemoryError", "_ArrayMemoryError")), child.stdout
    pytest.fail("half a gigabyte does not suffice")


@pytest.mark.parametrize("name", CALLS)
def test_what_does_not_fit_into_memory_is_an_error_and_the_process_goes_on(name):
    given, call, enough = CALLS[name]
    for room in (2, 16, *([enough] if enough else [])):
        code = LIMITED.replace("{given}", given).replace("{call}", call).replace("{room}", str(room))
        child = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False,
            env={"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        assert child.returncode == 0, (room, child.stderr[-2000:])
        if room == enough:
            assert child.stdout == "answered\n"
        elif room == 2:
            assert child.stdout.startswith(("TooLargeError", "MemoryError", "_ArrayMemoryError")), (
                child.stdout
            )


def test_the_error_is_of_the_library_and_a_memory_error():
    assert issubclass(gf.TooLargeError, gf.GraspForceError)
    assert issubclass(gf.TooLargeError, MemoryError)
