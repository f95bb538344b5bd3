"""
Soft fingers
============

A fingertip that deforms resists torque about its normal. Two hard fingers never hold an object: it turns
about the line through them. Two soft ones do, and epsilon grows with the torsional coefficient.
"""

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf

contacts = {"positions": [(-0.04, 0, 0), (0.04, 0, 0)], "normals": [(1, 0, 0), (-1, 0, 0)]}
contacts |= {"friction": 0.6, "max_normal_force": 20.0, "length_scale": 0.04, "edges": None}

coefficients = np.linspace(0, 0.02, 21)
pinch = [gf.Grasp(**contacts, torsion=gamma).quality("max").epsilon for gamma in coefficients]

# %%
# Right: what one contact can give at a normal force of 1 N. Torque and friction share the ellipse.

figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.6), layout="constrained")
left.plot(1e3 * coefficients, pinch, "o-", ms=4, color="#1f5f99")
left.set(
    xlabel="torsional coefficient (mm)", ylabel="epsilon (N)", ylim=(0, None), title="two fingers, 20 N each"
)
turn = np.linspace(0, 2 * np.pi, 200)
for gamma, colour in ((0.002, "#3b8ea5"), (0.005, "#1f5f99"), (0.01, "#d1762b")):
    right.plot(0.6 * np.cos(turn), 1e3 * gamma * np.sin(turn), color=colour, label=f"{1e3 * gamma:.0f} mm")
right.set(xlabel="friction force (N)", ylabel="torque (N mm)", title="one contact at 1 N")
right.legend(frameon=False, title="coefficient", loc="center left", bbox_to_anchor=(1, 0.5))
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.set_label(
    "Left: epsilon of a pinch rises with the torsional coefficient. Right: ellipses of friction and torque"
)
