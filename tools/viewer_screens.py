"""Take the pictures of the viewer that the documentation shows: ``python tools/viewer_screens.py``.

Needs the extras ``viewer`` and ``hands``, playwright and a Chromium on the path.
"""

import io
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import trimesh
from PIL import Image
from playwright.sync_api import Browser, sync_playwright

import graspforce as gf
from graspforce.files import load_grasp, load_wrenches
from graspforce.viewer import Viewer, view

ROOT = Path(__file__).parents[1]
SIZE = {"width": 1280, "height": 800}
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]


def egg() -> Viewer:
    """Return a viewer of an egg between three fingers."""
    file = load_grasp(ROOT / "examples" / "pinched_egg.yaml")
    lift = load_wrenches(ROOT / "examples" / "lift.csv", 6)
    return view(file.grasp, file.object_mesh(), lift.wrenches, times=lift.times, title=file.path.name, port=0)


def hand() -> Viewer:
    """Return a viewer of a planned grasp."""
    box = trimesh.creation.box((0.05, 0.05, 0.09))
    plan = gf.plan_hand(gf.hands.preset("allegro-right"), box, best=1).best
    return view(plan, (box.vertices, box.faces), title="plan.json", port=0)


def take(browser: Browser, make: Callable[[], Viewer], name: str, *, dark: bool) -> None:
    """Write the picture of a viewer."""
    viewer = make()
    page = browser.new_page(viewport=SIZE)
    page.goto(viewer.address)
    page.get_by_text("epsilon max").first.wait_for(timeout=60_000)
    if dark:
        page.get_by_role("checkbox").last.click()
    notice = page.locator(".mantine-Notification-closeButton")  # of rendering without a graphics card
    notice.first.click()
    time.sleep(10)
    picture = Image.open(io.BytesIO(page.screenshot(timeout=120_000))).convert("RGB")
    picture.save(ROOT / "docs" / "_static" / name, optimize=True)
    page.close()
    viewer.stop()


with sync_playwright() as playwright:
    path = shutil.which("chromium") or shutil.which("google-chrome")
    browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
    take(browser, egg, "viewer.png", dark=False)
    take(browser, egg, "viewer-dark.png", dark=True)
    take(browser, hand, "viewer-hand.png", dark=False)
    take(browser, hand, "viewer-hand-dark.png", dark=True)
    browser.close()
