"""The controllers of the examples in MuJoCo, and the bound on forces while a limit is a ramp."""

import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import graspforce as gf

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install --group simulators")

EXAMPLES = Path(__file__).parents[3] / "examples"
STANDING = runpy.run_path(str(EXAMPLES / "fourth_foot.py"))


def test_the_controller_holds_the_tile_and_a_constant_squeeze_of_equal_effort_loses_it(tmp_path):
    picture = tmp_path / "controller.png"
    command = [sys.executable, "force_controller.py", "--seconds", "0.3", "--plot", str(picture)]
    done = subprocess.run(command, cwd=EXAMPLES, capture_output=True, text=True, check=True)
    rows = dict(line.split("  ", 1) for line in done.stdout.splitlines()[2:])
    assert "lost after" in rows.pop("constant squeeze, equal effort")
    assert len(rows) == 4
    assert all(float(row.split()[0]) < 0.05 for row in rows.values())
    assert picture.stat().st_size > 20_000


@pytest.mark.parametrize("step", [2.0, 0.5])
def test_a_ramp_keeps_the_change_of_the_forces_within_the_bound(step):
    feet = np.column_stack([STANDING["FEET"], np.zeros(4)])
    grasp = gf.Grasp(feet, [(0, 0, 1)] * 4, friction=0.6, edges=None)
    bound = STANDING["largest_jump"](grasp, STANDING["LAST"], step)
    at_once, ramp = (STANDING["touch_down"](raised, seconds=1.0) for raised in (STANDING["LIMIT"], step))
    assert 0.8 * bound < ramp < bound < at_once


def test_forces_move_no_farther_than_the_bound_while_other_contacts_are_inside_their_cones():
    random = np.random.default_rng(5)
    checked = largest = 0
    while checked < 300:
        feet = np.column_stack([random.uniform(-1, 1, (5, 2)), 0.1 * random.normal(size=5)])
        normals = random.normal(size=(5, 3)) * 0.2 + (0, 0, 1)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        grasp = gf.Grasp(
            feet, normals, friction=[*random.uniform(1.5, 3, 4), 0.5], max_normal_force=1e3, edges=None
        )
        load = np.array([*random.normal(0, 20, 2), -150, *random.normal(0, 20, 3)])
        legs = gf.ForceDistributor(grasp, "squares", limits=True)
        step, last = random.uniform(0.1, 5), None
        bound = STANDING["largest_jump"](grasp, 4, step)
        for limit in np.arange(12) * step:
            legs.set_limits([1e3, 1e3, 1e3, 1e3, limit])
            try:
                solution = legs.solve(load)
            except gf.InfeasibleWrenchError:
                last = None
                continue
            others = solution.forces[:4]
            inside = (np.hypot(others[:, 1], others[:, 2]) < grasp.friction[:4] * others[:, 0] - 1e-9).all()
            if not inside:
                last = None
                continue
            if last is not None:
                checked += 1
                share = np.linalg.norm(solution.forces - last) / bound
                largest = max(largest, share)
                assert share < 1 + 1e-6
            last = solution.forces
    assert largest > 0.8
