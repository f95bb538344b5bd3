"""What the viewer draws: cones, polytopes and forces on one scale."""

import numpy as np
import pytest

import graspforce as gf

viser = pytest.importorskip("viser", reason="viser is not installed: pip install 'graspforce[viewer]'")

from support.viewed_grasps import BEYOND, cup, feet, showing

from graspforce.viewer import panel


@pytest.fixture
def drawn(monkeypatch):
    """Return the points and colours of the arrows that a page shows, and the vertices of its cones."""
    shown = {}
    arrows, meshes = viser.SceneApi.add_arrows, viser.SceneApi.add_mesh_simple
    remove = viser.SceneNodeHandle.remove

    def arrow(scene, name, points, color, **options):
        shown[name] = np.array(points)[0], color
        return arrows(scene, name, points, color, **options)

    def mesh(scene, name, vertices, *arguments, **options):
        shown[name] = np.array(vertices)
        return meshes(scene, name, vertices, *arguments, **options)

    def removed(handle):
        shown.pop(handle.name, None)
        remove(handle)

    monkeypatch.setattr(viser.SceneApi, "add_arrows", arrow)
    monkeypatch.setattr(viser.SceneApi, "add_mesh_simple", mesh)
    monkeypatch.setattr(viser.SceneNodeHandle, "remove", removed)
    return shown


def test_the_page_says_and_draws_what_stays_unbalanced(drawn):
    with showing(feet(), wrenches=BEYOND) as viewer:
        assert "unbalanced" not in viewer._controls.numbers.content
        assert "/unbalanced" not in drawn
        for row, said in ((1, "6 N, 2 N m"), (2, " N, ")):
            viewer._controls.row.value = row
            viewer.update()
            assert "unbalanced" in viewer._controls.numbers.content
            assert said in viewer._controls.numbers.content
            (tail, head), _ = drawn["/unbalanced"]
            rest = viewer.state.forces(row).residual[:3]
            np.testing.assert_allclose(head - tail, viewer._drawing.metres_per_newton * rest, atol=1e-9)


def cone_length(grasp, drawn, contact):
    return ((grasp.positions[contact] - drawn[f"/cones/{contact}"]) @ grasp.normals[contact]).max()


def test_a_force_at_its_limit_is_as_long_as_its_cone_and_none_has_no_arrow(drawn):
    normals = np.array([(1.0, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
    grasp = gf.Grasp(-0.05 * normals, normals, friction=0.0, max_normal_force=[10, 20, 20, 20])
    pushes = [[-10.0, 0, 0, 0, 0, 0], [-15.0, 0, 0, 0, 0, 0], [0.0] * 6]
    with showing(grasp, wrenches=pushes) as viewer:
        for row, (length, color) in enumerate([(1.0, panel.FORCE), (1.5, panel.OVERLOAD), (0.0, None)]):
            viewer._controls.row.value = row
            viewer.update()
            arrows = {name for name in drawn if name.startswith("/forces/")}
            assert arrows == ({"/forces/0"} if length else set())
            cone = cone_length(grasp, drawn, 0)
            if length:
                (tail, head), shown = drawn["/forces/0"]
                np.testing.assert_allclose(head, grasp.positions[0], atol=1e-12)
                np.testing.assert_allclose(head - tail, length * cone * normals[0], atol=1e-9)
                assert shown == color
        # The largest limit has the longest cone; others are shorter on the same scale.
        lengths = [cone_length(grasp, drawn, i) for i in range(4)]
        np.testing.assert_allclose(lengths, 0.03 * np.array([0.5, 1, 1, 1]), rtol=1e-6)


@pytest.mark.parametrize("size", [None, 0.01, 1.0, 500.0])
def test_cones_are_as_long_as_the_object_allows_whatever_the_forces_given(size, drawn):
    forces = [[(1, 0.3, 0), (1, -0.3, 0.3), (1, 0, -0.3)], [(0.5, 0, 0)], [(0.25, 0.1, 0), (-1, 0, 0)]]
    given = {} if size is None else {"extreme_forces": [size * np.array(rows) for rows in forces]}
    grasp = cup(**given)
    with showing(grasp):
        longest = 0.3 * np.ptp(grasp.positions, axis=0).max()
        for i, share in enumerate([1, 1, 1] if size is None else [1, 0.5, 0.25]):
            depths = (grasp.positions[i] - drawn[f"/cones/{i}"]) @ grasp.normals[i]
            assert depths.max() == pytest.approx(share * longest)


def test_given_forces_are_drawn_as_the_hull_that_they_span(drawn):
    limits = gf.torque_limited_forces(np.eye(3), [1.0, 2.0, 3.0], 0.5, 100.0)
    grasp = cup(extreme_forces=[limits] * 3)
    with showing(grasp) as viewer:
        assert viewer._controls.friction.disabled
        assert "extreme forces" in viewer._controls.friction.hint
        for i, tip in enumerate(grasp.positions):
            shape = (tip - drawn[f"/cones/{i}"]) @ grasp.frames[i].T / viewer._drawing.metres_per_newton
            for z in np.random.default_rng(0).normal(size=(50, 3)):
                reach = max(0.0, (np.array(limits) @ z).max())
                # Corners of a small distance about the tip let flat sets have a hull.
                small = 0.02 * np.linalg.norm(z) * np.max(limits)
                assert reach - 1e-5 <= (shape @ z).max() <= max(reach, small) + 1e-5


def test_a_disturbance_that_only_turns_is_a_ring_about_its_axis(drawn):
    pinch = gf.Grasp([(-0.05, 0, 0), (0.05, 0, 0)], [(1, 0, 0), (-1, 0, 0)], friction=0.5)
    with showing(pinch) as viewer:
        assert "/worst" not in drawn
        viewer._drawing.weakest(pinch, np.array([0, 0, 0, -1.0, 0, 0]))
        (tail, head), color = drawn["/ring tip"]
        assert color == panel.WORST
        assert np.cross(tail, head - tail)[0] > 0.9 * np.linalg.norm(tail) * np.linalg.norm(head - tail)
        viewer._drawing.weakest(pinch, np.array([0, 0, 1.0, 0, 0, 0]))
        assert "/ring tip" not in drawn
        assert drawn["/worst"][0][1][2] < 0
