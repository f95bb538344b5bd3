"""
Batches and gradients
=====================

`graspforce.quality_many` measures thousands of grasps with their gradients in one call. Here 400 grasps
of an ellipsoid climb together from random starts. Each step moves all contacts along the gradient and back to
the surface.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf

GRASPS, STEPS = 400, 30
axes_of_egg = np.array([0.05, 0.04, 0.03])
random = np.random.default_rng(3)


def onto_egg(positions):
    """Return the nearest points along rays from the centre, and the normals into the egg."""
    unit = positions / axes_of_egg
    unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
    return unit * axes_of_egg, -unit / axes_of_egg


positions, normals = onto_egg(random.normal(size=(GRASPS, 4, 3)))
began, climbed = time.perf_counter(), []
for step in range(STEPS):
    batch = gf.quality_many(
        positions, normals, friction=0.7, length_scale=0.04, criterion="sum", gradient=True
    )
    climbed.append(batch.epsilon)
    uphill = batch.gradient.positions
    uphill = uphill / np.maximum(np.linalg.norm(uphill, axis=(1, 2), keepdims=True), 1e-12)
    positions, normals = onto_egg(positions + 0.01 * (1 - step / STEPS) * uphill)
seconds = time.perf_counter() - began
climbed = np.array(climbed)
print(f"{GRASPS * STEPS} grasps with gradients in {seconds:.2f} s")
print(f"closed: {np.mean(climbed[0] > 0):.0%} at first, {np.mean(climbed[-1] > 0):.0%} at last")

# %%
# An open grasp has a negative epsilon, whose gradient leads towards closure. So all can climb.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", width_ratios=(3, 2))
left.plot(climbed[:, :150], color="#1f5f99", lw=0.5, alpha=0.25)
left.plot(np.median(climbed, axis=1), color="#d1762b", lw=2.5, label="median")
left.axhline(0, color="#8a9099", lw=0.8)
left.set(xlabel="step", ylabel="epsilon by the sum", title="150 of 400 grasps")
left.legend(frameon=False, loc="lower right")
bins = np.linspace(climbed[0].min(), climbed.max(), 40)
right.hist(climbed[0], bins, color="#8a9099", alpha=0.7, label="at random")
right.hist(climbed[-1], bins, color="#1f5f99", alpha=0.8, label="after 30 steps")
right.set(xlabel="epsilon by the sum", ylabel="grasps", title="force closure right of 0")
right.legend(frameon=False, loc="upper left")
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.set_label(
    "Left: epsilon of 150 grasps climbs over 30 steps. Right: histograms before and after the climb"
)
