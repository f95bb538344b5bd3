"""
Two hands grasp five objects
============================

`graspforce.plan_hand` finds pose, contacts and squeeze for the Allegro hand with four fingers and the Shadow
hand with five. Each plan is then shaken in simulation: pushes of ten times the weight along six axes.
"""

import matplotlib.pyplot as plt
import numpy as np
import trimesh
from trimesh import creation

import graspforce as gf
from graspforce.plotting import draw_hand


def mug():
    handle = creation.torus(0.025, 0.006)
    handle.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0], [0, 0, 0]))
    handle.apply_translation([0.045, 0, 0])
    body = trimesh.boolean.union([creation.cylinder(0.036, 0.09), handle], engine="manifold")
    hollow = creation.cylinder(0.032, 0.09).apply_translation([0, 0, 0.006])
    return trimesh.boolean.difference([body, hollow], engine="manifold")


def bottle():
    outline = [(0, -0.08), (0.028, -0.08), (0.028, 0.02), (0.012, 0.05), (0.012, 0.08), (0, 0.08)]
    return creation.revolve(outline, sections=32)


OBJECTS = {
    "box": creation.box((0.05, 0.05, 0.09)),
    "ball": creation.icosphere(2, 0.035),
    "bottle": bottle(),
    "ring": creation.torus(0.035, 0.012),
    "mug": mug(),
}
HANDS = {"Allegro": gf.hands.preset("allegro-right"), "Shadow": gf.hands.preset("shadow")}

figure = plt.figure(figsize=(12, 6), layout="constrained")
for row, (name, hand) in enumerate(HANDS.items()):
    for column, (kind, mesh) in enumerate(OBJECTS.items()):
        plan = gf.plan_hand(hand, mesh, best=1).best
        trial = gf.hands.shake(plan, mesh, seconds=1.0)
        axes = figure.add_subplot(2, 5, 5 * row + column + 1, projection="3d")
        draw_hand(axes, plan, (mesh.vertices, mesh.faces))
        axes.set_title(f"{name}, {kind}\n{int(trial.held.sum())} of 6 pushes held", fontsize=11)
        print(
            f"{name}, {kind}: slips at {plan.onset:.2f} N, off by {plan.contact_error * 1e3:.2f} mm, "
            f"moved at most {trial.displacement.max() * 1e3:.1f} mm"
        )
figure.set_label(
    "Ten pictures: the Allegro and the Shadow hand hold a box, a ball, a bottle, a ring and a mug"
)
