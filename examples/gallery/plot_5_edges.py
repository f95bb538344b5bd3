"""
Edges of a friction cone
========================

A linearised cone lies inside the true cone, so epsilon is too small. The error falls with the square of the
number of edges.
"""

import matplotlib.pyplot as plt

import graspforce as gf

cup = {
    "positions": [(0.04, 0, 0), (-0.02, 0.035, 0.01), (-0.02, -0.035, -0.01), (0, 0.04, 0.02)],
    "normals": [(-1, 0, 0.1), (0.5, -0.866, 0), (0.5, 0.866, 0.2), (0, -1, -0.3)],
    "friction": 0.6,
    "max_normal_force": 20.0,
    "length_scale": 0.04,
}
true = gf.Grasp(**cup, edges=None).quality("max", rtol=1e-6)
edges = [4, 6, 8, 12, 16, 24, 32, 48, 64]
short = [1 - gf.Grasp(**cup, edges=n).quality("max").epsilon / true.epsilon for n in edges]
print(true)
for n, share in zip(edges, short, strict=True):
    print(f"{n:3d} edges: {100 * share:7.3f} % too small")

figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.loglog(edges, short, "o-", color="#1f5f99")
axes.loglog(edges, [short[0] * (edges[0] / n) ** 2 for n in edges], "--", color="#8a9099", label="1 / edges²")
axes.set(xlabel="edges", ylabel="share of epsilon missing")
axes.set_xticks(edges, [str(n) for n in edges], minor=False)
axes.set_xticks([], minor=True)
axes.spines[["top", "right"]].set_visible(False)
axes.legend(frameon=False)
figure.set_label("The missing share of epsilon over the number of edges falls with their square")
