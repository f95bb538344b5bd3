"""
Sum and maximum of the normal forces
====================================

A limited sum of the normalised normal forces averages over the fingers. A limited maximum adds them up. The
example follows section 3.3 of the paper, with other numbers.
"""

import matplotlib.pyplot as plt
import numpy as np

import graspforce as gf


def fingers_on_disc(count):
    """Return fingers spread evenly around a unit disc: friction 0.2, limits of 1 N."""
    angles = np.pi / 2 + 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return gf.Grasp(rim, -rim, friction=0.2, max_normal_force=1.0)


# %%
# Three fingers: the hull of the union (orange) lies inside the Minkowski sum (blue). The radius of the ball
# is the quality by the maximum. The ball touches the nearest facet at the red point.

grasp = fingers_on_disc(3)
turn = np.linspace(0, 2 * np.pi, 100)
picture = grasp.quality("max").plot(outline=np.stack([np.cos(turn), np.sin(turn)], axis=1))
picture.set_label("Three fingers on a disc; beside it two nested polytopes and the ball that touches a facet")
picture

# %%
# More fingers make the grasp stronger. Only the maximum shows it.

counts = range(3, 9)
found = {c: [fingers_on_disc(n).quality(c).epsilon for n in counts] for c in ("max", "sum")}
print("fingers   epsilon_max   epsilon_sum")
for n, largest, total in zip(counts, found["max"], found["sum"], strict=True):
    print(f"{n:7d} {largest:13.6f} {total:13.6f}")

# %%

figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.plot(counts, found["max"], "o-", color="#1f5f99", label="each finger limited (max)")
axes.plot(counts, found["sum"], "o-", color="#d1762b", label="their sum limited (sum)")
axes.set(xlabel="fingers on the disc", ylabel="epsilon (N)", ylim=(0, None))
axes.spines[["top", "right"]].set_visible(False)
axes.legend(frameon=False)
figure.set_label("Epsilon over three to eight fingers: it rises by the maximum and is constant by the sum")
