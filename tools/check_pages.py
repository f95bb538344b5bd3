"""Check the built pages in Chromium: nothing wider than the screen, alt texts, contrast, no code line cut at 1280 px.

Run as ``python tools/check_pages.py docs/_build/html``. Each page is laid out at three widths, light and dark. The
rules are those of axe-core. With ``--screens FOLDER`` it also writes a picture of every page, width and theme.
"""

import argparse
import os
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from pathlib import Path

WIDTHS = (400, 1280, 1920)
THEMES = ("light", "dark")
RULES = [
    "image-alt",
    "svg-img-alt",
    "color-contrast",
    "link-name",
    "button-name",
    "duplicate-id-aria",
    "list",
    "label",
]

# Elements that reach past the right edge, the page's own scroll bars aside.
TOO_WIDE = """() => {
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth <= width) return [];
  return [...document.querySelectorAll("article *")].filter(e => {
    for (let up = e.parentElement; up; up = up.parentElement)
      if (["auto", "scroll", "hidden"].includes(getComputedStyle(up).overflowX)) return false;
    return e.getBoundingClientRect().right > width + 1;
  }).map(e => e.outerHTML.slice(0, 120)).slice(0, 3).concat(["the page is " + document.documentElement.scrollWidth]);
}"""
CUT = """() => [...document.querySelectorAll("div.highlight pre")].filter(e => e.scrollWidth > e.clientWidth + 1)
  .map(e => e.innerText.split("\\n").reduce((a, b) => a.length > b.length ? a : b))"""
NOT_LOADED = """() => [...document.images].filter(e => e.complete && !e.naturalWidth && e.checkVisibility())
  .map(e => e.src)"""
NOT_SET = "() => document.querySelectorAll('mjx-merror, .math:not(:has(mjx-container))').length"
AXE = """rules => axe.run(document, {runOnly: {type: "rule", values: rules}, resultTypes: ["violations"]}).then(r =>
  r.violations.flatMap(v => v.nodes.map(n => v.id + ": " + n.html.slice(0, 160) + "  " + (n.any[0] || {}).message)))"""


def chromium():
    """Return the path of a Chromium, or None."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((path for path in map(shutil.which, names) if path), None)


def faults(pages, root, screens):
    """Return the faults of some pages, each with its page, width and theme."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - said below when it is missing

    axe = (Path(find_spec("axe_playwright_python").origin).parent / "axe.min.js").read_text(encoding="utf-8")
    found = []
    with sync_playwright() as playwright:
        flags = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=chromium(), args=flags)
        tab = browser.new_page()
        for path in pages:
            name = path.relative_to(root).as_posix()
            tab.goto(path.as_uri())
            if tab.query_selector(".math"):
                tab.wait_for_function("() => window.MathJax && MathJax.startup && MathJax.startup.promise")
                tab.evaluate("() => MathJax.startup.promise.then(() => 0)")
                found += [
                    f"{name}: {count} formulas are not set" for count in [tab.evaluate(NOT_SET)] if count
                ]
            tab.evaluate(axe)
            for theme in THEMES:
                tab.emulate_media(color_scheme=theme)
                for width in WIDTHS:
                    tab.set_viewport_size({"width": width, "height": 1080 if width > 1280 else 800})
                    where = f"{name}, {width} px, {theme}"
                    if theme == "light":
                        found += [f"{where}: too wide: {each}" for each in tab.evaluate(TOO_WIDE)]
                    if width == 1280:
                        found += [f"{where}: {each}" for each in tab.evaluate(AXE, RULES)]
                        found += [f"{where}: not loaded: {each}" for each in tab.evaluate(NOT_LOADED)]
                    if width == 1280 and theme == "light":
                        found += [f"{where}: line cut: {each}" for each in tab.evaluate(CUT)]
                    if screens:
                        picture = f"{name.removesuffix('.html').replace('/', '-')}-{width}-{theme}.png"
                        tab.screenshot(path=screens / picture, full_page=True)
        browser.close()
    return found


def main():
    """Check all pages and print what is wrong; the exit code says whether something is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="*", help="pattern of page names, such as 'guides/*'")
    parser.add_argument("--screens", type=Path, help="folder for pictures of the pages")
    options = parser.parse_args()
    if chromium() is None:
        print("the pages were not checked: Chromium is not installed", file=sys.stderr)
        return 0
    root = options.folder.resolve()
    pages = sorted(p for p in root.rglob("*.html") if "_static" not in p.parts and p.match(options.only))
    if options.screens:
        options.screens.mkdir(parents=True, exist_ok=True)
    shares = [pages[first::2] for first in range(2)]
    with ProcessPoolExecutor(2) as pool:
        found = sorted(
            each for share in pool.map(faults, shares, [root] * 2, [options.screens] * 2) for each in share
        )
    print("\n".join(found) or f"{len(pages)} pages have no faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
