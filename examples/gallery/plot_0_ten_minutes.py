"""
A grasp in a notebook in ten minutes
====================================

This page is a notebook: download it at the end. It needs ``pip install '.[all]'`` in a clone. Three fingers
hold a cup. How good is the grasp, how hard must each finger press, and where would the fingers be better?
"""

import matplotlib.pyplot as plt
import numpy as np
import trimesh

import graspforce as gf
from graspforce.plotting import draw_forces

# %%
# The grasp
# ---------
# A contact is a position in m and a normal that points **into** the object. The cup has a radius of 4 cm.
# ``length_scale`` is about the radius: it makes torques comparable with forces.

angles = np.deg2rad([20, 110, 250])
outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
grasp = gf.Grasp(0.04 * outward, -outward, friction=0.5, max_normal_force=20.0, length_scale=0.04)
print(grasp)

# %%
# ``plot`` draws it, here with the cup. Qualities, forces and plans have ``plot``, too.

cup = trimesh.creation.cylinder(radius=0.04, height=0.1, sections=64)
picture = grasp.plot(mesh=cup)
picture.set_label("Three contacts on a cup, each with its friction cone")
picture

# %%
# How good is it?
# ---------------
# ``epsilon`` is the largest wrench in N that the grasp resists in its worst direction. Its bracket is proven.

quality = grasp.quality("max")
print(quality.closure, f"{quality.epsilon:.2f} N")
print("weakest along the wrench", quality.direction.round(2))
picture = quality.plot(mesh=cup)
picture.set_label("The cup with its contacts, and the weakest wrench as a straight and a curved arrow")
picture

# %%
# How hard must each finger press?
# --------------------------------
# The cup weighs 5 N. Column 0 of ``forces`` holds normal forces in N, the others friction forces.

hold = gf.ForceDistributor(grasp).solve([0, 0, -5, 0, 0, 0])
print("normal forces", hold.forces[:, 0].round(2), "N: at most", f"{hold.sigma_max:.0%} of a limit")
picture = hold.plot(mesh=cup)
picture.set_label("The cup with the contact forces that hold its weight of 5 N")
picture

# %%
# The cup is shaken sideways for a second, at 1 kHz. ``solve_many`` gives the forces of every moment.

times = np.linspace(0, 1, 1001)
push = np.stack([6 * np.sin(9 * times), 4 * np.cos(14 * times), -5 + 0 * times, *3 * [0 * times]], axis=1)
shaken = gf.ForceDistributor(grasp).solve_many(push)
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
draw_forces(axes, shaken.forces[:, :, 0], grasp.max_normal_force, times=times)
figure.set_label("Normal forces of three fingers over one second of shaking, all below their limit of 20 N")

# %%
# Where would the fingers be better?
# ----------------------------------
# `graspforce.plan` searches the angles of the fingers for the best quality, each on its part of the rim.


def on_cup(angles):
    """Return positions and normals (..., 3, 3) of fingers at these angles (..., 3)."""
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    return 0.04 * outward, -outward


found = gf.plan(
    on_cup,
    initial=angles,
    step=0.2,
    tolerance=0.005,
    bounds=[(-1, 1), (1, 3), (3, 5)],
    friction=0.5,
    max_normal_force=20.0,
    length_scale=0.04,
)
print(f"from {quality.epsilon:.2f} N to {found.quality.epsilon:.2f} N, at", np.rad2deg(found.params).round(0))

# %%

picture = found.plot(mesh=cup)
picture.set_label("Left: epsilon over the iterations. Right: the cup with evenly spread contacts")
picture

# %%
# From here: :doc:`/guides/which_number` lists what else can be asked. :doc:`/guides/mesh_planning` plans on
# a mesh of your own.
