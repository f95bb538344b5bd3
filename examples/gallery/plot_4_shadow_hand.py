"""
The Shadow hand closes on a block
=================================

The model is the one that gymnasium-robotics ships. While the hand closes, the contacts on the block become a
grasp at every moment; the simulator's forces are compared with the least ones that balance the same wrench.
"""

import importlib.util
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import graspforce as gf

package = Path(importlib.util.find_spec("gymnasium_robotics").origin).parent
model = mujoco.MjModel.from_xml_path(str(package / "envs/assets/hand/manipulate_block.xml"))
data = mujoco.MjData(model)
low, high = model.actuator_ctrlrange.T

times, epsilon, simulated, least = [], [], [], []
for step in range(1, 601):
    data.ctrl[:] = low + (high - low) * min(1.0, step / 500)
    data.ctrl[:2] = 0
    mujoco.mj_step(model, data)
    if step % 10:
        continue
    mujoco.mj_forward(model, data)
    try:
        reading = gf.from_mujoco(model, data, "object", max_normal_force=10.0, length_scale=0.05)
    except gf.InvalidInputError:  # nothing touches the block yet
        continue
    times.append(data.time)
    epsilon.append(reading.grasp.quality("max").epsilon)
    simulated.append(10.0 * reading.sigma_max)
    least.append(10.0 * gf.ForceDistributor(reading.grasp).solve(reading.external_wrench).sigma_max)

# %%
# Negative values say how far the contacts are from holding the block at all.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.plot(times, epsilon, color="#1f5f99")
axes.axhline(0, lw=0.8, color="#8a9099")
axes.set(xlabel="time (s)", ylabel="epsilon (N)")
axes.spines[["top", "right"]].set_visible(False)

# %%
# A simulator squeezes as its actuators say, far harder than holding the block takes.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.semilogy(times, np.maximum(simulated, 1e-4), color="#d1762b", label="MuJoCo")
axes.semilogy(times, np.maximum(least, 1e-4), color="#1f5f99", label="least maximum")
axes.set(xlabel="time (s)", ylabel="largest normal force (N)")
axes.spines[["top", "right"]].set_visible(False)
axes.legend(frameon=False)
print(f"largest of all: MuJoCo {max(simulated):.3f} N, least maximum {max(least):.3f} N")
