"""Ctrl-C ends every long call within a fifth of a second, whatever it computes."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import graspforce as gf

CALLS = Path(__file__).parents[1] / "support" / "interrupted.py"

PROMPT = 0.2

RAISING = [
    "quality",
    "true_cone_quality",
    "many_forces_of_one_contact",
    "gradient",
    "closure",
    "measures",
    "quality_many",
    "quality_many_hard",
    "resistance",
    "solve_many",
    "solve_many_parallel",
    "solve_enumerated",
    "reduce_points",
    "minkowski_sum",
    "closest_points",
    "reproduce",
]

# Searches that have found something give it back, marked as `stopped` by the interrupt.
RETURNING = ["plan", "plan_multistart", "plan_global", "placement", "refine"]


def latency(call):
    """How a call ended, and how long after Ctrl-C: the least of three, for the machine may be busy."""
    found = []
    for _ in range(3):
        child = subprocess.run(
            [sys.executable, str(CALLS), call], capture_output=True, text=True, timeout=60, check=False
        )
        assert child.returncode == 0, child.stderr
        outcome, seconds = child.stdout.split()
        found.append((float(seconds), outcome))
        if found[-1][0] < PROMPT:
            break
    return min(found)


@pytest.mark.alone
@pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
@pytest.mark.parametrize(
    ("call", "expected"),
    [*((call, "raised") for call in RAISING), *((call, "interrupted") for call in RETURNING)],
)
def test_a_long_call_ends_soon_after_ctrl_c(call, expected):
    seconds, outcome = latency(call)
    assert seconds < PROMPT
    assert outcome == expected


@pytest.mark.parametrize("search", ["plan", "plan_multistart", "plan_global", "refine"])
def test_a_search_that_has_found_nothing_yet_raises(search):
    def surface(_):
        signal.raise_signal(signal.SIGINT)

    bounds = [(0, 3), (0, 3)]
    calls = {
        "plan": lambda: gf.plan(surface, [1, 2], 0.5, 0.1, bounds),
        "plan_multistart": lambda: gf.plan_multistart(surface, bounds, 0.5, 0.1),
        "plan_global": lambda: gf.plan_global(surface, bounds),
        "refine": lambda: gf.refine(surface, [1, 2], bounds),
    }
    with pytest.raises(KeyboardInterrupt):
        calls[search]()


def forever(call):
    """Call again and again."""
    while True:
        call()


HANDLED = """
import signal, threading, os, time
import numpy as np
import graspforce as gf

outward = np.vstack([np.eye(3), -np.eye(3)])
pinch = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
hard = gf.Grasp(outward, -outward, friction=0.8, edges=None, torsion=0.05)
distributor = gf.ForceDistributor(gf.Grasp(outward, -outward, edges=64))
seen = []

def handler(*_):
    seen.append(pinch.quality().epsilon)
    seen.append(hard.quality(rtol=0.5).closure)
    seen.append(gf.quality_many([outward], [-outward]).closure.tolist())

signal.signal(signal.SIGINT, handler)
threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
before = {call}
until = time.monotonic() + 0.6
while time.monotonic() < until:
    assert {call} == before
assert len(seen) == 3 and seen[1] == "force", seen
print("same")
"""


@pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
@pytest.mark.parametrize(
    "call",
    [
        "hard.quality(rtol=1e-5).upper",
        "gf.quality_many([outward] * 64, [-outward] * 64).epsilon.tolist()",
        "distributor.solve_many(np.ones((2000, 6))).sigma_max.tolist()",
        "distributor.solve_many(np.ones((2000, 6)), parallel=True).sigma_max.tolist()",
    ],
)
def test_a_signal_handler_may_compute_in_the_middle_of_a_call_and_changes_nothing(call):
    code = HANDLED.replace("{call}", call)
    child = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert child.stdout == "same\n", child.stderr


@pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
def test_ctrl_c_leaves_computations_of_other_threads_alone():
    outward = np.vstack([np.eye(3), -np.eye(3)])
    grasp = gf.Grasp(outward, -outward, friction=0.8, edges=None, torsion=0.05)
    expected = grasp.quality(rtol=1e-4).upper
    found, failed = [], []

    def compute():
        try:
            until = time.monotonic() + 0.6
            while time.monotonic() < until:
                found.append(grasp.quality(rtol=1e-4).upper)
        except BaseException as error:  # noqa: BLE001 - the test is that there is none
            failed.append(error)

    worker = threading.Thread(target=compute)
    worker.start()
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        forever(lambda: grasp.quality(rtol=1e-6))
    worker.join()
    assert not failed
    assert set(found) == {expected}


def test_a_call_after_an_interrupted_one_answers_as_ever():
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    expected = grasp.quality().epsilon
    for _ in range(20):
        try:
            signal.raise_signal(signal.SIGINT)
            grasp.quality()
        except KeyboardInterrupt:
            pass
        assert grasp.quality().epsilon == expected
