"""The picture that social networks show beside a link to the pages."""

import numpy as np
import trimesh
from matplotlib.figure import Figure

import graspforce as gf
from graspforce.plotting import draw_spatial_grasp


def draw_card(path):
    """Draw the name, what it is, and a grasp with the forces that hold it: 1200 x 630 pixels."""
    angles = np.deg2rad([15, 130, 250])
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    grasp = gf.Grasp(0.035 * outward, -outward, friction=0.5, max_normal_force=10.0, length_scale=0.035)
    hold = gf.ForceDistributor(grasp).solve([0, 0, -6, 0, 0, 0])
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.035)
    figure = Figure(figsize=(12, 6.3))
    axes = figure.add_axes((0.5, 0.0, 0.5, 1.0), projection="3d")
    draw_spatial_grasp(axes, grasp, hold.forces, mesh=(ball.vertices, ball.faces))
    axes.set_axis_off()
    figure.text(0.06, 0.6, "graspforce", fontsize=46, weight="bold", color="#22262b")
    lines = "Grasp quality, contact planning and\nforce distribution for multifingered hands.\nProven bounds."
    figure.text(0.06, 0.34, lines, fontsize=19, color="#3a4149", linespacing=1.5)
    figure.savefig(path, dpi=100)
