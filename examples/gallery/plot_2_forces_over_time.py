"""
Forces along a trajectory
=========================

A cup is lifted and shaken. At every moment the forces have the least maximum over the fingers. The script
also measures the time of each call.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf
from graspforce.plotting import draw_forces, draw_latencies

grasp = gf.Grasp(
    positions=[(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)],
    normals=[(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0)],
    friction=0.6,
    max_normal_force=[20.0, 12.0, 12.0],
)
times = np.linspace(0, 4, 2000)
still = np.zeros_like(times)
shaking = 4 * np.sin(2 * np.pi * times)
wrenches = np.stack([shaking, 3 * np.cos(3 * times), -8 - shaking, still, still, still], axis=1)

distributor = gf.ForceDistributor(grasp, "max")
normal_forces, seconds = [], []
for wrench in wrenches:
    start = time.perf_counter()
    solution = distributor.solve(wrench)
    seconds.append(time.perf_counter() - start)
    normal_forces.append(solution.forces[:, 0])

figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
draw_forces(axes, normal_forces, [20.0, 12.0, 12.0], times=times)
figure.set_label("Normal forces of three fingers over four seconds, with their limits")

# %%
# The time of one call from Python, on the machine that built this page.

figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
draw_latencies(axes, seconds)
figure.set_label("Histogram of the time of one call, with its median and percentiles")
