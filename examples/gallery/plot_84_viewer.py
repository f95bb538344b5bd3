"""
The viewer in the browser
=========================

``graspforce view pinched_egg.yaml --wrenches lift.csv`` shows a grasp in the browser: cones, forces over time
and the weakest disturbance. Contacts can be dragged along the surface, and the numbers follow.

.. image:: /_static/viewer.png
   :class: only-light
   :alt: An egg held by three contacts with cones and force arrows; beside it a panel with numbers and sliders

.. image:: /_static/viewer-dark.png
   :class: only-dark
   :alt: An egg held by three contacts with cones and force arrows; beside it a panel with numbers and sliders

A plan of a hand moves from the pregrasp to the squeeze: ``graspforce view plan.json``, where ``graspforce
plan-hand`` has written the plan. :doc:`/guides/own_hand` tells how.

.. image:: /_static/viewer-hand.png
   :class: only-light
   :alt: The Allegro hand around a box, with numbered contacts, a slider of its closing and forces by finger

.. image:: /_static/viewer-hand-dark.png
   :class: only-dark
   :alt: The Allegro hand around a box, with numbered contacts, a slider of its closing and forces by finger
"""

import numpy as np
import trimesh

import graspforce as gf
from graspforce.viewer import ViewState

# %%
# In Python `graspforce.viewer.view` opens the page, with arrays in place of files. What the sliders do can be
# computed without it: `graspforce.viewer.ViewState` is the grasp behind the page.

angles = np.deg2rad([0, 120, 240])
outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
grasp = gf.Grasp(0.04 * outward, -outward, friction=0.6, max_normal_force=20.0, length_scale=0.04)
cup = trimesh.creation.cylinder(radius=0.04, height=0.1)

state = ViewState(grasp, (cup.vertices, cup.faces), wrenches=[[0, 0, -5, 0, 0, 0], [4, 0, -5, 0, 0, 0]])
for friction in (0.5, 1.0, 1.5):
    state.scale(friction=friction, limits=1.0)
    largest = state.forces(1).sigma_max
    print(f"friction x {friction}: epsilon {state.quality('max').epsilon:.2f} N, {largest:.0%} of a limit")

# %%
# A dragged contact stays on the cup.

state.scale(friction=1.0, limits=1.0)
print("contact 0 goes to", state.move(0, [0.05, 0.03, 0.02]).round(3))
print(f"epsilon {state.quality('max').epsilon:.2f} N")

# sphinx_gallery_thumbnail_path = '_static/viewer.png'  # noqa: ERA001
