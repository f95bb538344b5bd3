"""Sixteen threads over the whole interface: the answers of one thread, or a typed error, and never a wait."""

import contextlib
import copy
import os
import pickle
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from support.random_grasps import random_grasp

import graspforce as gf
from graspforce._core import CandidateSearch

THREADS = 16


def at_once(tasks):
    """Run all tasks, each in a thread of its own, started together."""
    barrier = threading.Barrier(len(tasks))

    def run(task):
        barrier.wait()
        return task()

    with ThreadPoolExecutor(len(tasks)) as pool:
        return [future.result(timeout=60) for future in [pool.submit(run, task) for task in tasks]]


CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
GRASP = gf.Grasp(CORNERS + np.array([0.1, 0.2, 0.0]), -CORNERS, friction=0.7)
CONE = gf.Grasp(CORNERS + np.array([0.2, 0.1, 0.0]), -CORNERS, friction=0.7, edges=None)
FLAT = gf.Grasp(**random_grasp(3, 2, 4, 8))
WRENCHES = np.random.default_rng(0).normal(size=(64, 6))


def disc(angles):
    outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return 0.1 * outward, -outward


def plan():
    return gf.plan(disc, [0.0, 2.0], step=0.5, tolerance=1e-2, bounds=[(0, 1), (1, 4)], friction=0.6)


BATCH = [
    np.stack([random_grasp(seed, 3, 4, 8)[name] for seed in range(40)]) for name in ("positions", "normals")
]

# Lambdas, so that what is called is computed anew by each thread.
CALLS = {
    "quality of a shared grasp": lambda: GRASP.quality("max").rho,
    "quality of true cones": lambda: CONE.quality("sum").rho,
    "quality in the plane": lambda: FLAT.quality("max").wrench.tolist(),
    "gradient": lambda: GRASP.quality("max").gradient.positions.tolist(),
    "closure": lambda: (GRASP.is_force_closure, FLAT.is_force_closure),
    "resistance": lambda: GRASP.resistance(WRENCHES).tolist(),
    "measures": lambda: GRASP.measures().isotropy,
    "minkowski": lambda: FLAT.minkowski_sum().wrenches.tolist(),
    "batch": lambda: gf.quality_many(*BATCH).rho.tolist(),
    "plan": lambda: plan().params.tolist(),
    "global plan": lambda: gf.plan_global(disc, [(0, 1), (1, 4)], gap=0.1, friction=0.6).params.tolist(),
    "refinement": lambda: gf.refine(disc, [0.0, 3.0], [(0, 1), (1, 4)], friction=0.6).params.tolist(),
    "own distributor": lambda: gf.ForceDistributor(GRASP).solve_many(WRENCHES).sigma_max.tolist(),
    "parallel rows": lambda: (
        gf.ForceDistributor(GRASP).solve_many(WRENCHES, parallel=True).sigma_max.tolist()
    ),
    "joint torques": lambda: gf.torque_limited_forces([[0.1], [0], [0]], [0.5], edges=4).tolist(),
    "pickles": lambda: pickle.loads(pickle.dumps(GRASP)).grasp_matrix.tolist(),
    "pictures": lambda: (GRASP.to_dict(), GRASP._repr_html_(), repr(GRASP)),
}


@pytest.mark.parametrize("name", CALLS)
def test_sixteen_threads_get_the_answer_of_one(name):
    call = CALLS[name]
    expected = call()
    for found in at_once([call] * THREADS):
        assert found == expected


def test_different_calls_at_once_get_the_answers_of_each():
    expected = [call() for call in CALLS.values()]
    assert at_once(list(CALLS.values())) == expected


@pytest.mark.parametrize("grasp", [GRASP, CONE], ids=["linear", "cone"])
def test_a_shared_distributor_answers_rightly_or_is_busy(grasp):
    distributor = gf.ForceDistributor(grasp, rtol=1e-6)
    expected = [gf.ForceDistributor(grasp, rtol=1e-6).solve(w).sigma_max for w in WRENCHES]

    def solve():
        forces = np.empty((grasp.num_contacts, grasp.force_dim))
        busy = 0
        for k, wrench in enumerate(WRENCHES):
            try:
                sigma = (
                    distributor.solve_into(wrench, forces) if k % 2 else distributor.solve(wrench).sigma_max
                )
            except gf.BusyError:
                busy += 1
                continue
            assert sigma == pytest.approx(expected[k], rel=3e-6)
        return busy

    busy = at_once([solve] * THREADS)
    assert sum(busy) < THREADS * len(WRENCHES)


@pytest.mark.alone
def test_a_distributor_in_use_is_busy_at_once_and_its_copy_is_not():
    distributor = gf.ForceDistributor(GRASP)
    many = np.random.default_rng(0).normal(size=(100_000, 6))

    def work():
        while True:
            with contextlib.suppress(gf.BusyError):
                return distributor.solve_many(many)

    worker = threading.Thread(target=work)
    worker.start()
    seen = 0
    while worker.is_alive():
        start = time.perf_counter()
        try:
            distributor.solve(WRENCHES[0])
        except gf.BusyError:
            seen += 1
            assert time.perf_counter() - start < 0.1
            assert copy.copy(distributor).solve(WRENCHES[0]).sigma_max > 0
            with pytest.raises(gf.BusyError):
                distributor.update(GRASP)
            break
    worker.join()
    assert seen
    assert distributor.solve(WRENCHES[0]).sigma_max > 0


@pytest.mark.alone
@pytest.mark.parametrize(
    "call",
    [
        lambda: gf.quality_many(*[np.repeat(part, 40, axis=0) for part in BATCH]),
        lambda: gf.ForceDistributor(GRASP).solve_many(np.tile(WRENCHES, (800, 1))),
        lambda: gf.ForceDistributor(GRASP).solve_many(np.tile(WRENCHES, (800, 1)), parallel=True),
        lambda: [CONE.quality(rtol=1e-9) for _ in range(50)],
    ],
    ids=["quality_many", "solve_many", "solve_many, parallel", "quality"],
)
def test_other_threads_go_on_while_one_computes(call):
    worker = threading.Thread(target=call)
    worker.start()
    ticks = 0
    while worker.is_alive():
        ticks += 1
        time.sleep(0.002)
    # With the lock held throughout there would be one or two.
    assert ticks > 5


def test_a_planner_in_use_by_another_thread_is_busy():
    search = CandidateSearch(3)
    batch = [np.repeat(part, 50, axis=0) for part in BATCH]

    def work():
        while True:
            with contextlib.suppress(gf.BusyError):
                return search.best(*batch)

    worker = threading.Thread(target=work)
    worker.start()
    seen = False
    while worker.is_alive() and not seen:
        try:
            search.best(*(part[:1] for part in BATCH))
        except gf.BusyError:
            seen = True
    worker.join()
    assert seen


@pytest.mark.parametrize("asked", ["20000", "3", "0", "many"])
def test_thousands_of_threads_that_were_asked_for_are_bounded(asked):
    code = (
        "import os, numpy as np, graspforce as gf\n"
        "p = np.tile([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]], (100, 1, 1))\n"
        "assert (gf.quality_many(p, -p, torsion=0.1).status == 0).all()\n"
        "names = [open(f'/proc/self/task/{t}/comm').read() for t in os.listdir('/proc/self/task')]\n"
        "print(sum(name.startswith('graspforce-') for name in names))\n"
    )
    if not Path("/proc/self/task").exists():
        pytest.skip("counts threads in /proc")
    environment = {**os.environ, "RAYON_NUM_THREADS": asked}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    cores = len(os.sched_getaffinity(0))
    expected = {"20000": max(64, 4 * cores), "3": 3}
    assert int(done.stdout) == expected.get(asked, int(done.stdout))
    assert int(done.stdout) <= max(64, 4 * cores)
