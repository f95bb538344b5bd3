"""The viewer: its state without a page, and its page in a real browser."""

import http.server
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import graspforce as gf

viser = pytest.importorskip("viser", reason="viser is not installed: pip install 'graspforce[viewer]'")
trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: pip install 'graspforce[viewer]'")

from graspforce.viewer import ViewState, view

ANGLES = np.deg2rad([0, 120, 240])
OUTWARD = np.stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES], axis=1)
WRENCHES = [[0, 0, -5 - k, 0, 0, 0] for k in range(8)]


def cup(**options):
    return gf.Grasp(
        0.04 * OUTWARD, -OUTWARD, friction=0.6, max_normal_force=20.0, length_scale=0.04, **options
    )


def cylinder():
    mesh = trimesh.creation.cylinder(0.04, 0.1, sections=64)
    return mesh.vertices, mesh.faces


def test_sliders_are_factors_of_the_grasp_as_given():
    state = ViewState(cup())
    state.scale(friction=0.5, limits=3.0)
    state.scale(friction=0.5, limits=2.0)
    expected = gf.Grasp(
        0.04 * OUTWARD, -OUTWARD, friction=0.3, max_normal_force=40.0, length_scale=0.04
    ).quality("max")
    assert state.quality("max").epsilon == pytest.approx(expected.epsilon, rel=1e-9)


def test_a_moved_contact_stays_on_the_mesh_and_keeps_the_sliders():
    state = ViewState(cup(), cylinder())
    state.scale(friction=1.5, limits=1.0)
    went = state.move(1, [0.0, 0.2, 0.02])
    np.testing.assert_allclose(went, [0, 0.04, 0.02], atol=1e-3)
    np.testing.assert_allclose(state.grasp.normals[1], [0, -1, 0], atol=0.1)
    np.testing.assert_allclose(state.grasp.friction, 0.9)


def test_forces_are_those_of_the_chosen_row():
    state = ViewState(cup(), wrenches=WRENCHES)
    np.testing.assert_allclose(state.forces(3).world_forces.sum(axis=0), [0, 0, 8], atol=1e-9)
    expected = max(np.linalg.norm(state.forces(row).forces, axis=1).max() for row in range(len(WRENCHES)))
    assert state.largest_force() == pytest.approx(expected)
    assert ViewState(cup()).forces(0) is None
    state.scale(friction=1e-6, limits=1.0)
    assert np.isfinite(state.forces(3).forces).all()


def feet():
    corners = [(0.2, 0.1, 0), (0.2, -0.1, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0)]
    return gf.Grasp(corners, [(0, 0, 1)] * 4, friction=0.5, max_normal_force=20.0)


BEYOND = [[0, 0, -40, 0, 0, 0], [0, 0, 6, 0, 0, 2], [30, 0, -40, 0, 0, 0]]
"""A load that feet balance, one that lifts them off, and one that pushes them beyond their friction."""


def test_wrenches_that_nothing_balances_have_the_nearest_forces():
    state = ViewState(feet(), wrenches=BEYOND)
    assert [state.forces(row).balanced for row in range(3)] == [True, False, False]
    np.testing.assert_allclose(state.forces(1).forces, 0, atol=1e-9)
    np.testing.assert_allclose(state.forces(1).residual, BEYOND[1], atol=1e-9)
    for row in range(3):
        expected = gf.ForceDistributor(feet()).nearest(BEYOND[row])
        np.testing.assert_allclose(state.forces(row).residual, expected.residual, atol=1e-9)
        np.testing.assert_allclose(state.forces(row).forces, expected.forces, atol=1e-9)
    drawn = [np.linalg.norm(state.forces(row).forces, axis=1).max() for row in range(3)]
    drawn += [np.linalg.norm(state.forces(row).residual[:3]) for row in (1, 2)]
    assert state.largest_force() == pytest.approx(max(drawn))


def test_the_page_says_and_draws_what_stays_unbalanced(monkeypatch):
    arrows = {}
    draw = viser.SceneApi.add_arrows

    def record(scene, name, points, *arguments, **options):
        arrows[name] = np.array(points)
        return draw(scene, name, points, *arguments, **options)

    monkeypatch.setattr(viser.SceneApi, "add_arrows", record)
    viewer = view(feet(), wrenches=BEYOND, port=18083)
    try:
        assert "unbalanced" not in viewer._controls.numbers.content
        np.testing.assert_array_equal(arrows["/unbalanced"], np.zeros((1, 2, 3)))
        for row, shown in ((1, "**unbalanced** 6 N, 2 N m"), (2, "**unbalanced** ")):
            viewer._controls.row.value = row
            viewer.update()
            assert shown in viewer._controls.numbers.content
            (tail, head), rest = arrows["/unbalanced"][0], viewer.state.forces(row).residual[:3]
            np.testing.assert_allclose(head - tail, viewer._metres_per_newton * rest, atol=1e-9)
        assert np.ptp(arrows["/forces"], axis=1).max() > 0
    finally:
        viewer.stop()


def test_given_forces_are_not_scaled():
    extreme = [[(1, 0.3, 0), (1, -0.3, 0.3), (1, 0, -0.3)]] * 3
    state = ViewState(cup(extreme_forces=extreme))
    before = state.quality("max").epsilon
    state.scale(friction=2.0, limits=2.0)
    assert not state.has_cones
    assert state.quality("max").epsilon == before


@pytest.mark.parametrize("size", [None, 0.01, 1.0, 500.0])
def test_cones_are_as_long_as_the_object_allows_whatever_the_forces_given(size, monkeypatch):
    rims = {}
    draw = viser.SceneApi.add_mesh_simple

    def record(scene, name, vertices, *arguments, **options):
        rims[name] = vertices
        return draw(scene, name, vertices, *arguments, **options)

    monkeypatch.setattr(viser.SceneApi, "add_mesh_simple", record)
    forces = [[(1, 0.3, 0), (1, -0.3, 0.3), (1, 0, -0.3)], [(0.5, 0, 0)], [(0.25, 0.1, 0), (-1, 0, 0)]]
    given = {} if size is None else {"extreme_forces": [size * np.array(rows) for rows in forces]}
    grasp = cup(**given)
    viewer = view(grasp, port=18082)
    viewer.stop()
    longest = 0.3 * np.ptp(grasp.positions, axis=0).max()
    shares = [1, 1, 1] if size is None else [1, 0.5, 0.25]
    for i, share in enumerate(shares):
        tip, *rim = rims[f"/cones/{i}"]
        assert (tip - rim) @ grasp.normals[i] == pytest.approx(np.full(len(rim), share * longest))


def test_what_cannot_be_shown_is_refused():
    with pytest.raises(gf.InvalidInputError, match="planar"):
        ViewState(gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]))
    with pytest.raises(gf.InvalidInputError, match="wrenches"):
        ViewState(cup(), wrenches=[1, 2, 3])


@pytest.fixture(scope="module")
def opened():
    """Return a running viewer and its page in a browser."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium is installed")
    viewer = view(cup(), cylinder(), WRENCHES, port=18080)
    flags = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 800}, color_scheme="light")
        page.goto(viewer.address)
        page.get_by_text("epsilon max").wait_for(timeout=60_000)
        yield viewer, page
        browser.close()
    viewer.stop()


@pytest.fixture
def page(opened):
    return opened[1]


def shown_epsilon(page):
    return float(re.search(r"epsilon max\s*([-+.\de]+)", page.inner_text("body"))[1])


def wait_for(condition, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "the page did not follow"
        time.sleep(0.1)


def test_the_page_shows_the_quality_and_a_scene(page, tmp_path):
    assert shown_epsilon(page) == pytest.approx(cup().quality("max").epsilon, rel=1e-5)
    time.sleep(2)
    picture = page.screenshot(path=tmp_path / "viewer.png")
    assert len(picture) > 20_000


def test_a_slider_changes_the_shown_epsilon(page):
    before = shown_epsilon(page)
    slider = page.get_by_role("slider").nth(1)
    slider.focus()
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    wait_for(lambda: shown_epsilon(page) != before)
    stronger = gf.Grasp(0.04 * OUTWARD, -OUTWARD, friction=0.6, max_normal_force=24.0, length_scale=0.04)
    wait_for(lambda: shown_epsilon(page) == pytest.approx(stronger.quality("max").epsilon, rel=1e-5))


def test_playing_moves_through_the_wrenches(page):
    slider = page.get_by_role("slider").nth(2)
    before = slider.get_attribute("aria-valuenow")
    page.get_by_role("checkbox").first.click()
    wait_for(lambda: slider.get_attribute("aria-valuenow") != before)
    page.get_by_role("checkbox").first.click()


def pixel(camera, point):
    """Where a point (3,) of the scene is in the 1280 x 800 page."""
    w, x, y, z = camera.wxyz
    # Columns of the camera's rotation: right, down, forward.
    right = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
    down = [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)]
    ahead = np.cross(right, down)
    away = point - camera.position
    focal = 400 / np.tan(camera.fov / 2)
    return [640 + focal * (right @ away) / (ahead @ away), 400 + focal * (down @ away) / (ahead @ away)]


def test_dragging_a_contact_changes_the_shown_epsilon(opened):
    viewer, page = opened
    (camera,) = [client.camera for client in viewer._server.get_clients().values()]
    before, start = shown_epsilon(page), viewer.state.grasp.positions[0]
    up = np.array([0, 0, 1.0])
    handle = start + 0.007 * up  # on the arrow that moves the contact up and down
    path = np.linspace(pixel(camera, handle), pixel(camera, handle + 0.02 * up), 8)
    page.mouse.move(*path[0])
    time.sleep(1)
    page.mouse.down()
    shown = []
    for place in path:
        page.mouse.move(*place)
        time.sleep(0.2)
        shown.append(shown_epsilon(page))
    wait_for(lambda: shown_epsilon(page) < before)
    assert len(set(shown)) > 2, "epsilon did not follow while the contact was dragged"
    page.mouse.up()
    moved = viewer.state.grasp.positions[0] - start
    np.testing.assert_allclose(moved, [0, 0, 0.02], atol=2e-3)


def test_a_contact_dragged_off_the_surface_goes_back_to_it(opened):
    viewer, page = opened
    (camera,) = [client.camera for client in viewer._server.get_clients().values()]
    start = viewer.state.grasp.positions[0].copy()
    # The arrow of the x axis, along the normal: away from the cylinder.
    outward = np.array([1.0, 0, 0])
    handle, away = start + 0.007 * outward, start + 0.03 * outward
    page.mouse.move(*pixel(camera, handle))
    time.sleep(1)
    page.mouse.down()
    for place in np.linspace(pixel(camera, handle), pixel(camera, away), 6):
        page.mouse.move(*place)
        time.sleep(0.2)
    page.mouse.up()
    wait_for(lambda: np.allclose(viewer._handles[0].position, viewer.state.grasp.positions[0]))
    assert np.hypot(*viewer.state.grasp.positions[0, :2]) == pytest.approx(0.04, abs=1e-3)


def test_forces_move_with_the_wrench_that_is_scrubbed_to(opened):
    viewer, page = opened
    shown = []
    slider = page.get_by_role("slider").nth(2)
    slider.focus()
    for key in ("Home", "End"):
        page.keyboard.press(key)
        row = 0 if key == "Home" else len(WRENCHES) - 1
        wait_for(lambda row=row: viewer._controls.row.value == row)
        share = viewer.state.forces(row).sigma_max
        wait_for(lambda share=share: f"up to {100 * share:.3g} %" in page.inner_text("body"))
        shown.append(share)
    assert shown[0] < shown[1]


def test_another_page_in_the_same_browser_cannot_connect(opened):
    viewer, page = opened

    class OtherPage(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_):
            pass

    script = """address => new Promise(done => {
        const socket = new WebSocket(address, ["viser-v%s"]);
        socket.onopen = () => done("open");
        socket.onerror = () => done("refused");
    })"""
    token = viewer.address.partition("?")[2]
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), OtherPage) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        other = page.context.browser.new_context()
        visited = other.new_page()
        # The cookie of the viewer's page goes to all ports of the host; other ports are other origins.
        elsewhere = f"http://127.0.0.1:{server.server_address[1]}/"
        for where, tried in ((viewer.address, "open"), (elsewhere, "refused")):
            visited.goto(where)
            for query in ("", f"/?{token}"):
                address = f"ws://127.0.0.1:{viewer.port}{query}"
                assert visited.evaluate(script % viser.__version__, address) == tried
        other.close()
        server.shutdown()


def test_the_command_serves_until_it_is_interrupted(tmp_path):
    examples = Path(__file__).parents[3] / "examples"
    command = [
        sys.executable,
        "-m",
        "graspforce",
        "view",
        str(examples / "pinched_egg.yaml"),
        "--port",
        "18081",
    ]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        assert re.match(r"http://127\.0\.0\.1:\d+/\?token=\S{32}  ", running.stderr.readline())
        running.send_signal(signal.SIGINT)
        assert running.wait(timeout=20) == 0
