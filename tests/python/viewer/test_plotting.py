"""Figures hold what they were asked to draw, need no display, and refuse what they cannot draw."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

import graspforce as gf
from graspforce import plotting
from graspforce._internal.normal_limits import normal_limits

ANGLES = np.deg2rad([90, 210, 330])
RIM = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
POSITIONS = np.array([(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)])


def planar(**options):
    return gf.Grasp(RIM, -RIM, **{"friction": 0.2, **options})


def spatial(**options):
    return gf.Grasp(POSITIONS, -POSITIONS, friction=0.6, **options)


def flat_axes():
    return Figure().subplots()


def solid_axes():
    return Figure().add_subplot(projection="3d")


def test_figures_leave_pyplot_and_the_display_alone(tmp_path):
    code = """
import sys
import graspforce as gf
from graspforce.plotting import grasp_figure
grasp_figure(gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])).savefig("pinch.pdf")
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env={"PATH": ""}, check=True)


def test_a_force_past_its_limit_is_red_and_cut():
    axes = flat_axes()
    plotting.draw_planar_grasp(axes, planar(), [(0.5, 0), (3, 0), (0, 0)], metres_per_newton=0.1)
    within, past = axes.texts
    assert within.arrow_patch.get_edgecolor() != past.arrow_patch.get_edgecolor()
    assert np.linalg.norm(np.subtract(past.xyann, past.xy)) == pytest.approx(0.15)


def test_a_cone_is_as_long_as_its_limit_and_as_wide_as_its_friction():
    axes = flat_axes()
    plotting.draw_planar_grasp(axes, planar(max_normal_force=5), metres_per_newton=0.1)
    tip, one, other, _ = axes.patches[0].get_xy()
    np.testing.assert_allclose(tip, RIM[0], atol=1e-15)
    assert (one + other)[1] / 2 - tip[1] == pytest.approx(0.5)
    assert np.linalg.norm(one - other) == pytest.approx(2 * 0.2 * 0.5)


def test_the_ball_touches_the_nearest_facet():
    axes = solid_axes()
    grasp = planar(length_scale=0.5)
    *_, touch = plotting.draw_wrench_polytopes(axes, grasp)
    point = np.array(touch.get_data_3d()).ravel()
    assert np.linalg.norm(point) == pytest.approx(grasp.quality("max").epsilon)


def test_a_spatial_grasp_is_drawn_on_its_mesh():
    vertices = np.vstack([np.eye(3), np.zeros(3)])
    mesh = (vertices, [(0, 1, 2), (0, 3, 1)])
    forces = np.array([(0.5, 0, 0), (2, 0, 0), (0, 0, 0)])
    drawn = plotting.draw_spatial_grasp(solid_axes(), spatial(), forces, mesh=mesh)
    assert len(drawn) == 1 + 3 + 2 + 1


@pytest.mark.parametrize("options", [{"edges": None}, {"torsion": 0.01}, {"torsion": 0.01, "edges": None}])
def test_true_cones_and_soft_fingers_are_drawn_too(options):
    grasp = spatial(**options)
    forces = (
        gf.ForceDistributor(spatial()).solve([0, 0, -1, 0, 0, 0]).forces if grasp.force_dim == 3 else None
    )
    assert len(plotting.grasp_figure(grasp, forces).axes) == 1


def test_forces_over_time_share_or_own_their_limits():
    assert len(plotting.draw_forces(flat_axes(), np.ones((4, 3)), 2.0)) == 3 + 1
    assert len(plotting.draw_forces(flat_axes(), np.ones((4, 3)), [2, 2, 3], times=range(4))) == 3 + 2


def test_a_quality_figure_has_polytopes_only_where_they_exist():
    assert len(plotting.quality_figure(planar()).axes) == 2
    assert len(plotting.quality_figure(planar(friction=0)).axes) == 1
    assert len(plotting.quality_figure(spatial()).axes) == 1


@pytest.mark.parametrize(
    "draw",
    [
        lambda: plotting.draw_planar_grasp(flat_axes(), spatial()),
        lambda: plotting.draw_spatial_grasp(solid_axes(), planar()),
        lambda: plotting.draw_wrench_polytopes(solid_axes(), spatial()),
        lambda: plotting.draw_wrench_polytopes(solid_axes(), planar(friction=0)),
        lambda: plotting.draw_planar_grasp(flat_axes(), planar(), [(1, 2, 3)]),
        lambda: plotting.draw_forces(flat_axes(), np.ones(4), 1),
        lambda: plotting.draw_forces(flat_axes(), np.ones((4, 2)), [1, 2, 3]),
        lambda: plotting.draw_forces(flat_axes(), np.ones((4, 2)), 1, times=[1]),
        lambda: plotting.draw_latencies(flat_axes(), [0.0]),
        lambda: plotting.draw_latencies(flat_axes(), []),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw):
    with pytest.raises(gf.InvalidInputError):
        draw()


@pytest.mark.parametrize("case", ["soft", "unsorted", "cone"])
def test_fans_are_convex_and_keep_the_friction_margin(case):
    options = {"soft": {"torsion": 0.2, "edges": 6}, "cone": {"edges": None, "friction_margin": 2.0}}.get(
        case, {}
    )
    if case == "unsorted":
        square = [[2, 1, 1], [1, -0.5, -0.5], [2, 1, -1], [2, -1, 1], [1, 0.1, 0]]
        options["extreme_forces"] = [square] * 3
    grasp = spatial(**options)
    for fan, frame in zip(plotting.planar.cone_fans(grasp), grasp.frames, strict=True):
        forces = fan @ frame.T
        slopes = forces[:, 1:] / forces[:, :1]
        sides = np.roll(slopes, -1, axis=0) - slopes
        turns = (
            sides[:, 0] * np.roll(sides, -1, axis=0)[:, 1] - sides[:, 1] * np.roll(sides, -1, axis=0)[:, 0]
        )
        assert (turns > 0).all()
        assert len(fan) == {"soft": 6, "unsorted": 4, "cone": 16}[case]
        if case == "cone":
            assert np.hypot(*slopes.T) == pytest.approx(0.3)
    assert plotting.draw_spatial_grasp(solid_axes(), grasp)


def test_planar_fans_of_unsorted_forces_do_not_cross():
    forces = [[[1, 0.1], [1, -0.5], [2, 1], [1, 0]]] * 3
    grasp = gf.Grasp(RIM, -RIM, extreme_forces=forces)
    for fan, frame in zip(plotting.planar.cone_fans(grasp), grasp.frames, strict=True):
        slopes = [t / n for n, t in fan @ frame.T]
        assert slopes == sorted(slopes)
    assert normal_limits(grasp).tolist() == [2, 2, 2]
