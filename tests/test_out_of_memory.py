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
