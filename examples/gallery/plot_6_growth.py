"""
Growth of cost with the number of contacts
==========================================

The Minkowski sum of m contacts with l edges has :math:`(l + 1)^m - 1` points. The support oracle never lists
them, so the cost of quality and forces grows slowly.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf

random = np.random.default_rng(7)
EDGES, GRASPS = 8, 9


def random_grasp(contacts):
    """Return a force-closure grasp on an ellipsoid."""
    while True:
        outward = random.normal(size=(contacts, 3))
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        axes = np.array([1.0, 0.8, 0.6])
        grasp = gf.Grasp(outward * axes, -outward / axes, friction=0.6, edges=EDGES)
        if grasp.is_force_closure:
            return grasp


def median_milliseconds(call, grasps):
    """Return the median time of a call over grasps."""
    times = []
    for grasp in grasps:
        began = time.perf_counter()
        call(grasp)
        times.append(1e3 * (time.perf_counter() - began))
    return np.median(times)


contacts = np.array([3, 4, 5, 6, 8, 10, 12])
grasps = {m: [random_grasp(m) for _ in range(GRASPS)] for m in contacts}
weight = [0, 0, -1, 0, 0, 0.1]
calls = {
    "quality, max": lambda grasp: grasp.quality("max"),
    "quality, sum": lambda grasp: grasp.quality("sum"),
    "forces, first wrench": lambda grasp: gf.ForceDistributor(grasp).solve(weight),
}
times = {name: [median_milliseconds(call, grasps[m]) for m in contacts] for name, call in calls.items()}
supports = [np.median([grasp.quality("max").supports for grasp in grasps[m]]) for m in contacts]
for m, used in zip(contacts, supports, strict=True):
    print(f"{m} contacts: {used:.0f} support points of {(EDGES + 1) ** m - 1:,}")

# %%
# Left: the points of the Minkowski sum, and those that the polytope computed. Right: the time on this
# machine. The enumeration ends at two million points, where `graspforce.Grasp.minkowski_sum` refuses.

figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.4), layout="constrained")
left.semilogy(
    contacts, (EDGES + 1.0) ** contacts - 1, "o-", ms=4, color="#d1762b", label="in the Minkowski sum"
)
left.semilogy(contacts, supports, "o-", ms=4, color="#1f5f99", label="computed")
left.set(xlabel="contacts", ylabel="points")
listed = [m for m in contacts if (EDGES + 1) ** m < 2e6]
enumerated = [median_milliseconds(lambda grasp: grasp.minkowski_sum(), grasps[m][:3]) for m in listed]
for (name, column), color in zip(times.items(), ("#1f5f99", "#3b8ea5", "#4a8f5c"), strict=True):
    right.semilogy(contacts, column, "o-", ms=4, color=color, label=name)
right.semilogy(listed, enumerated, "o-", ms=4, color="#d1762b", label="listing all points")
right.set(xlabel="contacts", ylabel="time (ms)")
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
figure.set_label("Points and milliseconds over the number of contacts, on logarithmic scales")
