"""Memory: repeated calls leak nothing, large input takes a small multiple of itself, absurd sizes nothing.

LEAK_SHARE=1 runs the calls as often as `repeated` says, a million times for those of control loops.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from support import repeated

import graspforce as gf

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")

SHARE = float(os.environ.get("LEAK_SHARE", "0.1"))

# The online loop is cheap enough to be called a million times always.
SHARES = {"solve_into": 1.0}


@pytest.fixture(scope="module")
def counted():
    """Return a function that makes calls in a process of their own: their number, and the growth in MB."""
    with subprocess.Popen(
        [sys.executable, repeated.__file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as running:

        def run(name, share):
            running.stdin.write(f"{name} {share}\n")
            running.stdin.flush()
            times, growth = running.stdout.readline().split()
            return int(times), float(growth)

        yield run
        running.stdin.close()


@pytest.mark.parametrize("name", repeated.CALLS)
def test_repeated_calls_keep_no_memory(name, counted):
    times, growth = counted(name, max(SHARE, SHARES.get(name, 0.0)))
    # One forgotten float in each of the watched calls; or, where those are too few to show in what the system
    # counts, a megabyte: of twenty thousand calls a hundred bytes each.
    assert growth < max(1.0, times * 4e-6), f"{growth} MB in {times} calls"


MEASURED = """
import resource, sys
import numpy as np
import graspforce as gf

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

rng = np.random.default_rng(0)
gf.quality_many(rng.normal(size=(8, 3, 2)), rng.normal(size=(8, 3, 2)))
given = {given}
size = sum(array.nbytes for array in given) / 1e6
before = peak()
result = {call}
print((peak() - before) / size)
"""


@pytest.mark.parametrize(
    ("given", "call", "limit"),
    [
        (
            "[rng.normal(size=(400_000, 3, 2)) for _ in range(2)]",
            "gf.quality_many(*given)",
            # Both arrays once more, and what is known of each grasp.
            7.0,
        ),
        (
            "[rng.normal(size=(400_000, 3))]",
            "gf.ForceDistributor(gf.Grasp([(1, 0), (-1, 0.5)], [(-1, 0), (1, 0)])).solve_many(given[0])",
            # Wrenches once more, six components of forces, two sums.
            5.0,
        ),
        (
            "[rng.normal(size=(300_000, 3, 2)).astype('f4') for _ in range(2)]",
            "gf.quality_many(*given)",
            # In single precision the input itself is half as large.
            14.0,
        ),
    ],
    ids=["quality_many", "solve_many", "single precision"],
)
def test_a_large_batch_takes_a_small_multiple_of_its_input(given, call, limit):
    code = MEASURED.replace("{given}", given).replace("{call}", call)
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert child.returncode == 0, child.stderr
    assert float(child.stdout) < limit


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
import numpy as np
import graspforce as gf

corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
repeated = lambda *shape: np.broadcast_to(0.5, shape)
for line in sys.stdin:
    try:
        eval(line)
        print("answered", flush=True)
    except (gf.GraspForceError, MemoryError) as error:
        print(type(error).__name__, error, flush=True)
"""

ABSURD = {
    "edges": "gf.Grasp(corners, -corners, edges=2**40)",
    "edges of soft fingers": "gf.Grasp(corners, -corners, edges=65_536, torsion=0.1)",
    "a million contacts": "gf.Grasp(repeated(2**20, 3), repeated(2**20, 3))",
    "contacts without end": "gf.Grasp(repeated(2**40, 3), repeated(2**40, 3))",
    "grasps without end": "gf.quality_many(repeated(2**40, 4, 3), repeated(2**40, 4, 3))",
    "wrenches without end": "gf.Grasp(corners, -corners).resistance(repeated(2**40, 6))",
    "points without end": "gf.Grasp(corners, -corners, edges=4000).minkowski_sum(max_points=2**100)",
    "more points than memory": "gf.Grasp(corners, -corners, edges=100).minkowski_sum(max_points=2**100)",
    "placements": "gf.PlacementNoise(samples=2**50).quality(corners[None], -corners[None])",
    "starts": "gf.plan_multistart(lambda p: None, [(0, 1)], 0.5, 0.1, starts=2**50)",
    "samples": "gf.ForceDistributor(gf.Grasp(corners, -corners), samples=repeated(2**40, 6))",
}


def test_absurd_sizes_are_refused_and_take_no_memory():
    child = subprocess.run(
        [sys.executable, "-c", LIMITED], input="\n".join(ABSURD.values()), capture_output=True, text=True,
        timeout=60, check=False,
    )  # fmt: skip
    assert child.returncode == 0, child.stderr
    for name, told in zip(ABSURD, child.stdout.splitlines(), strict=True):
        assert told.startswith(("Invalid", "TooLarge")), (name, told)
        assert len(told) < 1000


def test_the_largest_grasp_fits_in_a_gigabyte():
    code = (
        "import pathlib, re, resource; resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))\n"
        "import numpy as np, graspforce as gf\n"
        "o = np.random.default_rng(0).normal(size=(16, 3))\n"
        "g = gf.Grasp(o, -o, edges=65_536, friction=0.7)\n"
        "assert g.quality(rtol=0.1).closure == 'force'\n"
        "gf.ForceDistributor(g).solve([0, 0, -1, 0, 0, 0])\n"
        # Of this program alone: what getrusage calls a maximum begins with that of the test runner.
        "status = pathlib.Path('/proc/self/status').read_text()\n"
        "print(int(re.search(r'VmHWM:\\s*([0-9]+)', status)[1]) / 1024)\n"
    )
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert child.returncode == 0, child.stderr
    assert float(child.stdout) < 1024


def test_errors_are_short_whatever_was_given():
    grasp = gf.Grasp(*repeated.PAIR)
    calls = [grasp.resistance, lambda wrong: gf.refine(repeated.refused, wrong, wrong)]
    for wrong in (["x"] * 10**6, np.zeros(10**6), list(range(10**6)), "x" * 10**6):
        for call in calls:
            with pytest.raises(gf.InvalidInputError) as caught:
                call(wrong)
            assert len(str(caught.value)) < 1000
