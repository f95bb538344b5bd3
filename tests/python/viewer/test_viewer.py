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

from support.viewed_grasps import BEYOND, OUTWARD, WRENCHES, cup, feet, showing

from graspforce.viewer import ViewState, view


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
    assert ViewState(cup()).forces(0) is None
    state.scale(friction=1e-6, limits=1.0)
    assert np.isfinite(state.forces(3).forces).all()


def test_wrenches_that_nothing_balances_have_the_nearest_forces():
    state = ViewState(feet(), wrenches=BEYOND)
    assert [state.forces(row).balanced for row in range(3)] == [True, False, False]
    np.testing.assert_allclose(state.forces(1).forces, 0, atol=1e-9)
    np.testing.assert_allclose(state.forces(1).residual, BEYOND[1], atol=1e-9)
    for row in range(3):
        expected = gf.ForceDistributor(feet()).nearest(BEYOND[row])
        np.testing.assert_allclose(state.forces(row).residual, expected.residual, atol=1e-9)
        np.testing.assert_allclose(state.forces(row).forces, expected.forces, atol=1e-9)


def test_given_forces_are_not_scaled():
    extreme = [[(1, 0.3, 0), (1, -0.3, 0.3), (1, 0, -0.3)]] * 3
    state = ViewState(cup(extreme_forces=extreme))
    before = state.quality("max").epsilon
    state.scale(friction=2.0, limits=2.0)
    assert not state.has_cones
    assert state.quality("max").epsilon == before


def test_what_cannot_be_shown_is_refused():
    with pytest.raises(gf.InvalidInputError, match="planar"):
        ViewState(gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]))
    with pytest.raises(gf.InvalidInputError, match="wrenches"):
        ViewState(cup(), wrenches=[1, 2, 3])
    with pytest.raises(gf.InvalidInputError, match=r"times: 1 s in row 2"):
        ViewState(cup(), wrenches=WRENCHES[:3], times=[0, 1, 1])


def test_a_port_that_is_taken_is_named():
    with showing(cup(), port=0) as viewer:
        taken = pytest.raises(gf.InvalidInputError, match=f"port: {viewer.port} is taken")
        with taken:
            view(cup(), port=viewer.port)
    refused = pytest.raises(gf.InvalidInputError, match=r"host: cannot listen at '192\.0\.2\.1'")
    with refused, pytest.warns(UserWarning, match="anyone on the network"):
        view(cup(), host="192.0.2.1", port=0)


def test_the_slider_of_a_trajectory_is_its_time():
    times = [0.0, 0.1, 0.2, 0.5, 0.6, 0.7, 0.8, 1.2]
    with showing(cup(), wrenches=WRENCHES, times=times) as viewer:
        row = viewer._controls.row
        assert (row.label, row.min, row.max) == ("time (s)", 0.0, 1.2)
        for value, number in ((0.0, 0), (0.44, 3), (1.2, 7)):
            row.value = value
            assert viewer._solution().external_wrench.tolist() == WRENCHES[number]
        row.value = 1.19
        viewer._controls.advance(viewer.state, 0.05)
        assert row.value == 0.0


def test_what_files_are_called_is_text_on_the_page_and_no_markup():
    with showing(cup(), title="<script>cup</script>.yaml") as viewer:
        page = viewer.html()
        assert "<script>cup" not in page
        assert "<title>&lt;script&gt;cup&lt;/script&gt;.yaml</title>" in page


@pytest.fixture(scope="module")
def opened():
    """Return a running viewer and its page in a browser."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium is installed")
    viewer = view(cup(), cylinder(), WRENCHES, title="cup.yaml", port=18080)
    flags = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 800}, color_scheme="light")
        page.goto(viewer.address)
        page.get_by_text("epsilon max").first.wait_for(timeout=60_000)
        yield viewer, page
        browser.close()
    viewer.stop()


ROW, LIMITS = 0, 2
"""Places of sliders on the page."""


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
    slider = page.get_by_role("slider").nth(LIMITS)
    slider.focus()
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    wait_for(lambda: shown_epsilon(page) != before)
    stronger = gf.Grasp(0.04 * OUTWARD, -OUTWARD, friction=0.6, max_normal_force=24.0, length_scale=0.04)
    wait_for(lambda: shown_epsilon(page) == pytest.approx(stronger.quality("max").epsilon, rel=1e-5))


def test_playing_moves_through_the_wrenches(page):
    slider = page.get_by_role("slider").nth(ROW)
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
    slider = page.get_by_role("slider").nth(ROW)
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


def test_the_shared_file_opens_without_a_server(opened, tmp_path):
    viewer, page = opened
    with page.expect_download() as download:
        page.get_by_role("button", name="Save as HTML").click()
    assert download.value.suggested_filename == "cup.html"
    download.value.save_as(tmp_path / "cup.html")
    context = page.context.browser.new_context(offline=True)
    alone = context.new_page()
    wrong = []
    alone.on("pageerror", lambda error: wrong.append(error))  # noqa: PLW0108 - playwright marks functions
    alone.goto((tmp_path / "cup.html").as_uri())
    alone.locator("canvas").first.wait_for(timeout=60_000)
    assert alone.title() == "cup.yaml"
    assert shown_epsilon(alone) == pytest.approx(viewer.state.quality("max").epsilon, rel=1e-5)
    assert "unbalanced force" in alone.inner_text("body")
    context.close()
    assert wrong == []
    assert all(handle.visible for handle in viewer._handles)


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
