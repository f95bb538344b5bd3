"""
Gravity
=======

Epsilon asks for the worst direction. A weight acts in one. Here a pan is held at its rim by three fingers and
turned: the disturbance that it resists on top of its weight depends on how it is held.
"""

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf

angles = np.deg2rad([0, 130, 230])
outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
pan = gf.Grasp(0.12 * outward, -outward, friction=0.5, max_normal_force=30.0, length_scale=0.12)
alone = pan.quality("max").epsilon

# %%
# The weight turns once around, in the plane of the pan and across it. Distance from the centre is the largest
# disturbance in N that is resisted on top.

turns = np.linspace(0, 2 * np.pi, 121)
figure, axes = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained", subplot_kw={"projection": "polar"})
for weight, colour in ((5, "#3b8ea5"), (10, "#1f5f99"), (15, "#d1762b")):
    for place, (x, y, z) in zip(axes, ((1, 1, 0), (1, 0, 1)), strict=True):
        pull = np.stack([x * np.cos(turns), y * np.sin(turns), z * np.sin(turns), *3 * [0 * turns]], axis=1)
        left = [pan.quality("max", external_wrench=weight * along).epsilon for along in pull]
        place.plot(turns, left, color=colour, label=f"{weight} N")
for place, title in zip(
    axes, ("epsilon (N), weight in the plane of the pan", "epsilon (N), weight across the pan"), strict=True
):
    place.plot(turns, np.full_like(turns, alone), "--", color="#8a9099", label="no weight")
    place.set_title(title)
    place.set_rlabel_position(75)
axes[0].legend(loc="lower left", bbox_to_anchor=(-0.3, -0.15), frameon=False, fontsize=8, title="weight")
figure.set_label(
    "Two polar plots: the disturbance that is resisted on top of a weight of 5, 10 and 15 N, by its direction"
)
