"""Figures hold what they were asked to draw, need no display, and refuse what they cannot draw."""

import io
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

import graspforce as gf
from graspforce import plotting
from graspforce._internal.normal_limits import normal_limits
from graspforce.paper.shown_iterates import shown_iterates
from graspforce.plotting import views

try:
    import trimesh
except ModuleNotFoundError:
    trimesh = None

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


BALL = [trimesh.creation.icosphere(subdivisions=3, radius=0.05)] if trimesh else []


def fibonacci(count, radius=0.05):
    k = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1 - 2 * k / count), np.pi * (1 + 5**0.5) * k
    outward = np.stack(
        [np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)], axis=1
    )
    return radius * outward, -outward


def legend_of(figure):
    (legend,) = figure.legends
    return " | ".join(text.get_text() for text in legend.get_texts())


@pytest.mark.parametrize("view", [(25.0, -60.0), (80.0, 10.0), (-40.0, 170.0)])
def test_a_ball_hides_exactly_the_contacts_on_its_far_side(view):
    pytest.importorskip("trimesh")
    positions, normals = fibonacci(60)
    toward = views.axes_of(*view)[2] @ -normals.T
    sure = np.abs(toward) > 0.2
    seen = views.hidden(positions, normals, BALL[0].vertices[BALL[0].faces], view)
    assert (seen == (toward < 0))[sure].all()


def test_the_view_shows_all_contacts_where_some_view_does():
    pytest.importorskip("trimesh")
    box = trimesh.creation.box((0.06, 0.04, 0.12))
    corners = box.vertices[box.faces]
    for points, normals in (
        ([(-0.03, 0, 0.02), (0.03, 0, 0.02)], [(1, 0, 0), (-1, 0, 0)]),
        ([(0, 0.02, 0), (0.03, 0, 0), (0, 0, 0.06)], [(0, -1, 0), (-1, 0, 0), (0, 0, -1)]),
    ):
        places, inward = np.array(points), np.array(normals, dtype=float)
        view = views.best_view(places, inward, corners)
        assert not views.hidden(places, inward, corners, view).any()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 12])
@pytest.mark.parametrize("on_mesh", [False, True])
def test_a_spatial_grasp_fills_the_canvas_and_names_what_is_behind(count, on_mesh):
    pytest.importorskip("trimesh")
    positions, normals = fibonacci(count)
    grasp = gf.Grasp(positions, normals, friction=0.3, length_scale=0.05)
    mesh = (BALL[0].vertices, BALL[0].faces) if on_mesh else None
    qualities = [grasp.quality(name, rtol=0.1) for name in ("max", "sum")]
    figure = plotting.quality_figure(grasp, qualities, title="ball", mesh=mesh)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=40)
    image = imread(io.BytesIO(picture.getvalue()))[:, :, :3].min(axis=2)
    rows, columns = (np.flatnonzero((image < 0.98).any(axis=axis)) for axis in (1, 0))
    assert np.ptp(rows) > 0.9 * image.shape[0]
    assert np.ptp(columns) > 0.8 * image.shape[1]
    assert "max" in figure.get_suptitle()
    assert "sum" in figure.get_suptitle()
    assert {t.get_text() for t in figure.axes[0].texts} == {str(i) for i in range(count)}
    view = figure.axes[0].elev, figure.axes[0].azim
    behind = np.flatnonzero(views.hidden(positions, normals, mesh and mesh[0][mesh[1]], view))
    assert ("behind the object" in legend_of(figure)) == (len(behind) > 0)


@pytest.mark.parametrize("factor", [0.05, 1.0, 400.0])
def test_the_largest_force_is_a_fixed_share_of_the_object_and_red_past_its_limit(factor):
    grasp = planar(max_normal_force=1.0, friction=0.5)
    solution = gf.ForceDistributor(grasp).solve([0, -factor, 0])
    figure = plotting.solution_figure(solution)
    arrows = [t for t in figure.axes[0].texts if t.get_text() == ""]
    lengths = [np.linalg.norm(np.subtract(t.xyann, t.xy)) for t in arrows]
    assert max(lengths) == pytest.approx(0.36 * np.ptp(RIM, axis=0).max())
    assert ("past its limit" in legend_of(figure)) == (not solution.within_limits)
    largest = np.linalg.norm(solution.forces, axis=1).max()
    assert f"{largest:.4g} N" in legend_of(figure)


def test_a_wrench_far_from_its_origin_is_drawn_as_the_same_wrench():
    near = plotting.panels.DrawnWrench(np.array([1.0, 2.0, 3.0]), "k", "")
    grasp = planar(length_scale=1.0)
    moved = gf.Grasp(np.add(RIM, [50, 0]), -RIM, origin=[0, 0], length_scale=1.0)
    about = np.array([1.0, 2.0, 3.0 + 50 * 2.0])  # the same force, with its torque about the far origin
    far = plotting.panels.DrawnWrench(about, "k", "")
    middle = (RIM.min(axis=0) + RIM.max(axis=0)) / 2
    at_middle = planar(length_scale=1.0, origin=middle)
    shifted = near.wrench - [0, 0, middle[0] * 2.0 - middle[1] * 1.0]
    expected = plotting.panels._lines(at_middle, plotting.panels.DrawnWrench(shifted, "k", ""), RIM)
    for one, other in zip(plotting.panels._lines(moved, far, np.add(RIM, [50, 0])), expected, strict=True):
        np.testing.assert_allclose(one - [50, 0], other, atol=1e-9)
    assert len(plotting.panels._lines(grasp, near, RIM)) == 2


def test_equal_forces_over_time_share_a_line_of_dashes():
    turn = np.linspace(0, 6, 50)
    columns = np.stack([np.sin(turn), np.sin(turn), np.cos(turn), np.sin(turn)], axis=1) + 1
    axes = flat_axes()
    lines = plotting.draw_forces(axes, columns, 3.0)[:4]
    assert [line.get_linestyle() for line in lines] == ["-", "--", "-", "--"]
    assert all(line.get_linestyle() == "-" for line in axes.get_legend().get_lines()[:4])


def test_forces_that_are_equal_for_a_while_share_dashes_for_that_while():
    turn = np.linspace(0, 6, 200)
    apart = np.where(turn < 2, 0.0, (turn - 2) * 0.3)
    axes = flat_axes()
    lines = plotting.draw_forces(axes, np.stack([1 + turn, 1 + turn + apart], axis=1), 9.0)
    solid, dashed = [line for line in axes.lines if line.get_color() == lines[1].get_color()]
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    shown = np.isfinite(dashed.get_ydata())
    assert shown[turn < 2].all()
    assert not shown[turn > 2.5].any()
    assert (shown | np.isfinite(solid.get_ydata())).all()


@pytest.mark.parametrize("about", [0, 1, 2])
def test_arrows_are_drawn_where_they_can_be_read(about):
    pytest.importorskip("trimesh")
    corners = BALL[0].vertices[BALL[0].faces]
    positions, normals = fibonacci(3)
    axis = np.eye(3)[about]
    turn = np.linspace(0, 5, 40)
    ring = 0.02 * (
        np.outer(np.cos(turn), np.eye(3)[about - 2]) + np.outer(np.sin(turn), np.eye(3)[about - 1])
    )
    for arrow in (np.stack([0 * axis, 0.03 * axis]), ring):
        view = views.best_view(positions, normals, corners, [arrow])
        assert views.side_on(arrow, view) > 0.45
    assert views.side_on(ring, (0.0, 0.0)) == pytest.approx(float(about == 0), abs=1e-9)


def test_notebooks_show_figures_of_grasps_qualities_forces_and_plans():
    grasp = planar(friction=0.5)
    rim = gf.surfaces.ellipse(1, 1)
    plan = gf.plan(
        gf.surfaces.contacts_on(rim, rim), [0, 2], step=0.5, tolerance=0.2, bounds=[(0, 1), (1, 4)]
    )
    for shown in (grasp, grasp.quality("max"), gf.ForceDistributor(grasp).solve([0, -1, 0]), plan):
        assert shown.plot(title="here")._repr_png_().startswith(b"\x89PNG")


def test_iterates_that_hardly_change_have_no_panel():
    step = np.ones(1)
    rows = [(0.0, 1), (1.0, -1), (2.0, -1.99), (3.0, -2.0), (3.0, -2.0)]
    history = tuple(gf.Iterate(np.array([x]), rho, step) for x, rho in rows)
    assert [k for k, _ in shown_iterates(history, 8)] == [0, 1, 3]
    assert [k for k, _ in shown_iterates(history, 2)] == [0, 3]
    assert [k for k, _ in shown_iterates(history[:1], 8)] == [0]
