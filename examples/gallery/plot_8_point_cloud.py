"""
From a point cloud to a grasp
=============================

Three contacts are chosen among the points that a depth camera saw: :doc:`/guides/perception` explains each
step. Colours are the best quality that any candidate with this point reaches.
"""

import matplotlib.pyplot as plt
import numpy as np
import trimesh

import graspforce as gf
from graspforce.plotting import draw_spatial_grasp

rng = np.random.default_rng(0)
capsule = trimesh.creation.capsule(height=0.06, radius=0.025)
points, faces = trimesh.sample.sample_surface(capsule, 2000, seed=0)
outward = capsule.face_normals[faces] + rng.normal(scale=0.05, size=(2000, 3))
points = points + rng.normal(scale=5e-4, size=(2000, 3))
inward = -outward / np.linalg.norm(outward, axis=1, keepdims=True)

triples = rng.integers(len(points), size=(200000, 3))
sides = np.linalg.norm(points[triples] - points[np.roll(triples, 1, axis=1)], axis=2)
facing = np.linalg.norm(inward[triples].sum(axis=1), axis=1)
triples = triples[(sides.min(axis=1) > 0.02) & (facing < 0.7)]

options = {"friction": 0.6, "max_normal_force": 10.0, "length_scale": 0.04, "origin": points.mean(axis=0)}
quick = gf.quality_many(points[triples], inward[triples], criterion="sum", **options)
best = triples[np.argsort(quick.epsilon)[::-1][:50]]
final = gf.quality_many(points[best], inward[best], criterion="max", **options)
chosen = best[final.epsilon.argmax()]
grasp = gf.Grasp(points[chosen], inward[chosen], **options)
print(f"{len(triples)} candidates; the best resists {final.epsilon.max():.2f} N in its worst direction")

# %%

reached = np.zeros(len(points))
np.maximum.at(reached, triples.ravel(), np.repeat(quick.epsilon, 3))
figure = plt.figure(figsize=(6.4, 5), layout="constrained")
axes = figure.add_subplot(projection="3d")
draw_spatial_grasp(axes, grasp, labels=True)
shown = axes.scatter(*points.T, c=reached, s=5, cmap="viridis", alpha=0.7, depthshade=False)
figure.colorbar(shown, shrink=0.6, label="best epsilon by the sum with this point (N)")
axes.set_axis_off()
figure.set_label(
    "A noisy point cloud of a capsule, coloured by quality, and the best three contacts with their cones"
)
