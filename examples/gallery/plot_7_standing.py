"""
Where a body may stand
======================

A support region holds the centre of mass of a body if its contacts are to hold it. On uneven ground it is
not the polygon of the feet: friction lets slanted feet push against each other, and limits cut corners off.
"""

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf

walker = gf.Grasp(
    [(0.35, 0.2, 0.0), (0.3, -0.2, 0.12), (-0.3, 0.25, 0.05), (-0.35, -0.2, -0.1)],
    [(0.3, 0, 1), (-0.2, 0.3, 1), (0.1, -0.4, 1), (0.2, 0.2, 1)],
    friction=0.5,
    max_normal_force=200.0,
    edges=None,
)
plate = gf.Grasp(
    [(0.05, 0, 0), (-0.03, 0.04, 0), (-0.03, -0.04, 0)], [(0, 0, 1)] * 3, max_normal_force=[4, 6, 6]
)


def draw(axes, grasp, region, title):
    axes.fill(*region.inner.T, color="#1f5f99", alpha=0.15)
    for polygon, style, name in ((region.outer, "--", "outer polygon"), (region.inner, "-", "inner polygon")):
        closed = np.vstack([polygon, polygon[:1]])
        axes.plot(*closed.T, style, color="#1f5f99", linewidth=1, label=name)
    axes.plot(*grasp.positions[:, :2].T, "o", color="#30343b", label="contacts")
    axes.set(title=title, aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axes.spines[["top", "right"]].set_visible(False)


figure, axes = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
walking = gf.support_region(walker, weight=300.0, gap=1e-2)
draw(axes[0], walker, walking, "A walker of 300 N, 200 N a foot")
served = gf.support_region(plate, weight=10.0)
draw(axes[1], plate, served, "A plate of 10 N on three fingers")
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
figure.set_label("Seen from above: contacts, and the region where the centre of mass may be")
print(walking)
print(served)

# %%
# Feet of a humanoid are rectangles. An acceleration moves the region.

feet = gf.Grasp(**gf.patch([(0, -0.1, 0), (0, 0.1, 0)], (0, 0, 1), 0.11, 0.05, max_normal_force=900.0))
for forward in (0.0, 0.5, 1.0):
    region = gf.support_region(feet, 500.0, acceleration=(forward, 0, 0), height=0.8)
    print(f"{forward:.1f} m/s^2: x from {region.inner[:, 0].min():.3f} to {region.inner[:, 0].max():.3f} m")
