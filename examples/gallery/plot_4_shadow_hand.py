"""
The Shadow hand closes on a block, an egg and a pen
===================================================

The models come from gymnasium-robotics. While the hand closes, the contacts on the object are read as a grasp
at every moment. The simulator's forces are compared with the least ones that balance the same wrench.
"""

import importlib.util
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import graspforce as gf

LIMIT = 10.0
OBJECTS = ("block", "egg", "pen")
folder = Path(importlib.util.find_spec("gymnasium_robotics").origin).parent / "envs/assets/hand"


def close_on(name):
    """Return times, epsilon, and the largest normal force of MuJoCo and of the least maximum."""
    model = mujoco.MjModel.from_xml_path(str(folder / f"manipulate_{name}.xml"))
    data = mujoco.MjData(model)
    low, high = model.actuator_ctrlrange.T
    rows = []
    for step in range(1, 601):
        data.ctrl[:] = low + (high - low) * min(1.0, step / 500)
        data.ctrl[:2] = 0
        mujoco.mj_step(model, data)
        if step % 10:
            continue
        mujoco.mj_forward(model, data)
        options = {"max_normal_force": LIMIT, "length_scale": 0.05}
        try:
            reading = gf.from_mujoco(model, data, "object", **options)
        except gf.NoContactError:  # nothing touches the object yet
            continue
        least = gf.ForceDistributor(reading.grasp).solve(reading.external_wrench)
        epsilon = reading.grasp.quality("max").epsilon
        rows.append((data.time, epsilon, LIMIT * reading.sigma_max, LIMIT * least.sigma_max))
    return np.array(rows).T


closing = {name: close_on(name) for name in OBJECTS}
for name, (_, _, simulated, least) in closing.items():
    print(f"{name}: largest of all: MuJoCo {simulated.max():.3f} N, least maximum {least.max():.3f} N")

# %%
# Above: quality over time. Negative values measure the distance from force closure.
# Below: the largest normal force. The actuators of the simulator squeeze far harder than holding requires.

figure, axes = plt.subplots(2, 3, figsize=(9, 4.6), layout="constrained", sharex="col", sharey="row")
for column, (name, (times, epsilon, simulated, least)) in zip(axes.T, closing.items(), strict=True):
    column[0].plot(times, epsilon, color="#1f5f99")
    column[0].axhline(0, lw=0.8, color="#8a9099")
    column[0].set_title(name)
    column[1].semilogy(times, np.maximum(simulated, 1e-4), color="#d1762b", label="MuJoCo")
    column[1].semilogy(times, np.maximum(least, 1e-4), color="#1f5f99", label="least maximum")
    column[1].set_xlabel("time (s)")
axes[0, 0].set_ylabel("epsilon (N)")
axes[1, 0].set_ylabel("largest normal force (N)")
axes[1, 0].legend(frameon=False, fontsize=8)
for ax in axes.flat:
    ax.spines[["top", "right"]].set_visible(False)
figure.set_label("Quality and largest normal force over time for a block, an egg and a pen")
