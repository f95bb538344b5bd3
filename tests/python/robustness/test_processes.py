"""The interface under multiprocessing: forked and spawned children answer as their parent does."""

import multiprocessing
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest
from support.random_grasps import random_grasp

import graspforce as gf

CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
GRASP = gf.Grasp(CORNERS + np.array([0.1, 0.2, 0.0]), -CORNERS, friction=0.7)
BATCH = [
    np.stack([random_grasp(seed, 3, 4, 8)[name] for seed in range(64)]) for name in ("positions", "normals")
]
WRENCHES = np.random.default_rng(0).normal(size=(600, 6))


def disc(angles):
    outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return 0.1 * outward, -outward


def everything(grasp=GRASP):
    """Compute what a worker might, on all cores where that is possible."""
    distributor = gf.ForceDistributor(grasp)
    return (
        gf.quality_many(*BATCH).lower.tolist(),
        distributor.solve_many(WRENCHES, parallel=True).sigma_max.tolist(),
        distributor.solve(WRENCHES[0]).forces.tolist(),
        grasp.quality("sum").rho,
        gf.plan(disc, [0.0, 2.0], 0.5, 0.05, [(0, 1), (1, 4)], friction=0.6).params.tolist(),
        gf.plan_global(disc, [(0, 1), (1, 4)], gap=0.2, friction=0.6).params.tolist(),
    )


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize("method", sorted(set(multiprocessing.get_all_start_methods()) - {"forkserver"}))
def test_children_answer_as_their_parent_does_although_its_threads_have_run(method):
    expected = everything()
    context = multiprocessing.get_context(method)
    with context.Pool(2) as pool:
        for found in pool.map_async(everything, [GRASP] * 4).get(timeout=120):
            assert found == expected
    assert everything() == expected


FORKED_TWICE = """
import os, sys
sys.path.insert(0, {tests!r})
from test_processes import everything

expected = everything()
for generation in range(3):
    child = os.fork()
    if child:
        _, status = os.waitpid(child, 0)
        assert everything() == expected
        os._exit(os.waitstatus_to_exitcode(status))
    assert everything() == expected
os._exit(7)
"""


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="forks")
def test_a_child_of_a_child_has_threads_too(request):
    code = FORKED_TWICE.format(tests=str(request.path.parent))
    assert subprocess.run([sys.executable, "-c", code], timeout=120, check=False).returncode == 7


FORKED_IN_USE = """
import copy, os, sys, threading, time
sys.path.insert(0, {tests!r})
from test_processes import GRASP, WRENCHES
import numpy as np
import graspforce as gf

distributor = gf.ForceDistributor(GRASP)
expected = distributor.solve(WRENCHES[0]).sigma_max

def work():
    while True:
        try:
            return distributor.solve_many(np.tile(WRENCHES, (2000, 1)))
        except gf.BusyError:
            pass

worker = threading.Thread(target=work)
worker.start()
while True:
    try:
        distributor.solve(WRENCHES[0])
    except gf.BusyError:
        break
child = os.fork()
if child == 0:
    try:
        distributor.solve(WRENCHES[0])
    except gf.BusyError:
        os._exit(7 if copy.copy(distributor).solve(WRENCHES[0]).sigma_max == expected else 8)
    os._exit(9)
_, status = os.waitpid(child, 0)
os._exit(os.waitstatus_to_exitcode(status))
"""


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="forks")
def test_a_distributor_that_was_in_use_during_a_fork_is_busy_in_the_child_and_its_copy_is_not(request):
    code = FORKED_IN_USE.format(tests=str(request.path.parent))
    assert subprocess.run([sys.executable, "-c", code], timeout=60, check=False).returncode == 7


def results():
    quality = GRASP.quality("max")
    flat = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    return {
        "Grasp": GRASP,
        "Quality": quality,
        "Gradient": quality.gradient,
        "MinkowskiSum": flat.minkowski_sum(),
        "QualityBatch": gf.quality_many(*BATCH),
        "ForceDistributor": gf.ForceDistributor(GRASP, "sum", rtol=1e-8),
        "Measures": GRASP.measures(),
        "PlacementNoise": gf.PlacementNoise(position_std=0.1),
        "Plan": gf.plan(disc, [0.0, 2.0], 0.5, 0.05, [(0, 1), (1, 4)], friction=0.6),
        "InfeasibleWrenchError": gf.InfeasibleWrenchError("no"),
        "InvalidGraspError": gf.InvalidGraspError("no"),
    }


def spelled(result):
    return type(result).__name__, repr(result)


@pytest.mark.parametrize("name", results())
def test_what_is_sent_to_a_child_arrives(name):
    sent = results()[name]
    assert spelled(pickle.loads(pickle.dumps(sent))) == spelled(sent)


def test_a_thread_of_the_child_may_compute_on_all_cores():
    found = []
    worker = threading.Thread(target=lambda: found.append(everything()))
    worker.start()
    worker.join(timeout=60)
    assert found == [everything()]
