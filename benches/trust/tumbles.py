"""A box and a capsule that tumble in MuJoCo: least forces for the simulator's own wrench, every 10 ms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np
from benches.trust.row import Row

import graspforce as gf

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["rows", "states"]

TUMBLES = 20
SECONDS = 2.0
SHAPES = {"box": "type='box' size='0.05 0.04 0.03'", "capsule": "type='capsule' size='0.03 0.05'"}


def states(shape: str, seed: int) -> Iterator[tuple[gf.Grasp, np.ndarray]]:
    """Grasps and wrenches of one tumble."""
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom type='plane' size='2 2 1' condim='4'/><body name='object' pos='0 0 0.12'>"
        f"<freejoint/><geom {SHAPES[shape]} mass='0.5' condim='4'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    rng = np.random.default_rng([11, seed])
    turn = rng.standard_normal(4)
    data.qpos[3:7] = turn / np.linalg.norm(turn)
    data.qvel[:] = np.hstack([0.3 * rng.standard_normal(3), 5 * rng.standard_normal(3)])
    every = round(0.01 / model.opt.timestep)
    for _ in range(round(SECONDS * 100)):
        mujoco.mj_step(model, data, every)
        mujoco.mj_forward(model, data)
        try:
            reading = gf.from_mujoco(model, data, "object", max_normal_force=50.0)
        except gf.NoContactError:
            continue
        if reading.external_wrench.any():
            yield reading.grasp, reading.external_wrench


def rows(share: float) -> list[Row]:
    """Miss no state: the simulator's own forces balance its wrench."""
    found = []
    for shape in SHAPES:
        cases = missed = wrong = 0
        for seed in range(max(1, round(TUMBLES * share))):
            for grasp, wrench in states(shape, seed):
                for objective in ("max", "sum"):
                    cases += 1
                    try:
                        answer = gf.ForceDistributor(grasp, objective).solve(wrench)
                    except gf.GraspForceError:
                        missed += 1
                        continue
                    rest = np.abs(answer.residual).max()
                    wrong += bool(rest > 1e-9 * np.abs(answer.forces).sum() or answer.gap > 1e-6)
        found.append(Row(f"a {shape} tumbling in MuJoCo", cases, "MuJoCo's own forces", missed, wrong))
    return found
