"""
Contacts on a mesh
==================

Three soft fingers are planned anywhere on an egg. The best plans that differ are kept and refined by
gradients. :doc:`/guides/mesh_planning` does the same for a file of your own.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf
from graspforce.plotting import draw_spatial_grasp
from graspforce.surfaces import MeshSurface, contacts_on

mesh = MeshSurface("../egg.off" if Path("../egg.off").exists() else "egg.off", unit="mm")
options = {"friction": 0.5, "max_normal_force": 10.0, "torsion": 0.002, "length_scale": 0.03}
options |= {"origin": mesh.center, "min_distance": 0.01}
plans = gf.plan_multistart(mesh, contacts=3, starts=8, best=3, **options)

# %%
# The refinement takes the arranged surface: three contacts, each anywhere on the egg.

surface, bounds = contacts_on(mesh, mesh, mesh), np.tile(mesh.bounds, (3, 1))
refined = [gf.refine(surface, plan.params, bounds, max_iterations=20, **options) for plan in plans.plans]
for plan, better in zip(plans.plans, refined, strict=True):
    print(f"search {plan.quality.epsilon:.3f} N, refined {better.quality.epsilon:.3f} N")

# %%

figure = plt.figure(figsize=(10, 4), layout="constrained")
for number, better in enumerate(refined):
    axes = figure.add_subplot(1, 3, number + 1, projection="3d")
    draw_spatial_grasp(axes, better.grasp, mesh=mesh, labels=True)
    axes.set_title(f"{better.quality.epsilon:.2f} N")
    axes.set_axis_off()
figure.set_label("The three best grasps of an egg, each with three friction cones on its surface")

# %%
# The forces with which the best grasp holds a weight of 2 N.

best = refined[0].grasp
hold = gf.ForceDistributor(best).solve([0, 0, -2, 0, 0, 0])
print(f"the most loaded finger uses {hold.sigma_max:.0%} of its limit")
picture = hold.plot(mesh=mesh)
picture.set_label("The best grasp of the egg, with its friction cones and the forces that hold 2 N")
picture
