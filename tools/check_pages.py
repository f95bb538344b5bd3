"""Check the built pages in Chromium: widths, alternative texts, contrast, formulas, lines cut at 1280 px.

Run as ``python tools/check_pages.py docs/_build/html``. Each page is laid out at three widths, those of the
reference at two. The rules are those of axe-core; contrast is checked in the light and the dark theme.
``--screens FOLDER`` also writes pictures of every page, width and theme. Without a browser the pages are not
checked: a failure where the variable ``CI`` is set, a warning elsewhere.
"""

import argparse
import os
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

WIDTHS = (400, 1920, 1280)
THEMES = ("light", "dark")
RULES = ["image-alt", "svg-img-alt", "link-name", "button-name", "label", "list", "document-title"]

TOO_WIDE = """() => {
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth <= width) return [];
  const hidden = e => ["auto", "scroll", "hidden"].includes(getComputedStyle(e).overflowX);
  const clipped = e => e && (hidden(e) || clipped(e.parentElement));
  return [...document.querySelectorAll("article *")]
    .filter(e => e.getBoundingClientRect().right > width + 1 && !clipped(e.parentElement))
    .map(e => e.outerHTML.slice(0, 120)).slice(0, 3).concat([document.documentElement.scrollWidth + " px"]);
}"""
CUT = """() => [...document.querySelectorAll("div.highlight pre")]
  .filter(e => e.checkVisibility() && e.scrollWidth > e.clientWidth + 1)
  .map(e => e.innerText.split("\\n").reduce((a, b) => a.length > b.length ? a : b))"""
NOT_LOADED = """() => [...document.images]
  .filter(e => e.complete && !e.naturalWidth && e.checkVisibility()).map(e => e.src)"""
NOT_SET = "() => document.querySelectorAll('mjx-merror, .math:not(:has(mjx-container))').length"
# Contrast takes long to compute: of elements that look alike, on this page or on earlier ones, one is kept.
ONE_OF_EACH = """known => {
  const seen = new Set(known), size = seen.size;
  const style = e => e ? e.tagName + "." + e.className + e.getAttribute("style") : "";
  for (const e of document.querySelectorAll("body *:not(:has(*)):not(script, style, svg *)")) {
    const up = e.parentElement, above = up.parentElement;
    const key = [e, up, above, above.parentElement].map(style).join();
    if (seen.has(key)) e.remove(); else seen.add(key);
  }
  return [...seen].slice(size);
}"""
# A theme is drawn in the second frame after it is chosen.
AXE = """rules => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))
  .then(() => axe.run(document, {runOnly: {type: "rule", values: rules}, resultTypes: ["violations"]}))
  .then(found => found.violations.flatMap(rule => rule.nodes.map(node =>
    rule.id + ": " + node.html.slice(0, 160) + "  " + (node.any[0] || {}).message)))"""


def chromium() -> str | None:
    """Return the path of a Chromium, or None."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((path for path in map(shutil.which, names) if path), None)


def faults(pages: list[Path], root: Path, screens: Path | None) -> list[str]:
    """Return the faults of some pages, each with its page, width and theme."""
    # Not needed where Chromium is missing.
    import axe_playwright_python  # noqa: PLC0415
    from playwright.sync_api import sync_playwright  # noqa: PLC0415

    axe = Path(axe_playwright_python.__file__).with_name("axe.min.js").read_text(encoding="utf-8")
    found: list[str] = []
    with sync_playwright() as playwright:
        flags = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=chromium(), args=flags)
        scripted = browser.new_page()
        scripted.add_init_script(axe)
        # The reference has many pages of one template, without pictures: they load faster without scripts.
        plain = browser.new_page(java_script_enabled=False)
        looks: list[str] = []
        for path in pages:
            name = path.relative_to(root).as_posix()
            alike = path.parent.name == "api" and sum(name.encode()) % 10 > 0
            tab = plain if alike and 'class="math' not in path.read_text(encoding="utf-8") else scripted
            tab.goto(path.as_uri())
            if tab.query_selector(".math"):
                tab.wait_for_function("() => window.MathJax && MathJax.startup && MathJax.startup.promise")
                tab.evaluate("() => MathJax.startup.promise.then(() => 0)")
                if count := tab.evaluate(NOT_SET):
                    found.append(f"{name}: {count} formulas are not set")
            for width in WIDTHS[:: 2 if alike and not screens else 1]:
                tab.set_viewport_size({"width": width, "height": 1080 if width > 1280 else 800})
                found += [f"{name}, {width} px: too wide: {each}" for each in tab.evaluate(TOO_WIDE)]
                for theme in THEMES if screens else ():
                    tab.emulate_media(color_scheme=theme)
                    picture = f"{name.removesuffix('.html').replace('/', '-')}-{width}-{theme}.png"
                    tab.screenshot(path=screens / picture, full_page=True)
            not_loaded, cut = tab.evaluate(f"() => [({NOT_LOADED})(), ({CUT})()]")
            found += [f"{name}: not loaded: {each}" for each in not_loaded]
            found += [f"{name}: line cut: {each}" for each in cut]
            if alike:
                continue
            found += [f"{name}: {each}" for each in tab.evaluate(AXE, RULES)]
            new = tab.evaluate(ONE_OF_EACH, looks)
            looks += new
            for theme in THEMES if new else ():
                tab.emulate_media(color_scheme=theme)
                found += [f"{name}, {theme}: {each}" for each in tab.evaluate(AXE, ["color-contrast"])]
        browser.close()
    return found


def main() -> int:
    """Check all pages and print what is wrong; the exit code says whether something is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="*", help="pattern of page names, such as 'guides/*'")
    parser.add_argument("--screens", type=Path, help="folder for pictures of the pages")
    options = parser.parse_args()
    if chromium() is None:
        print("THE PAGES WERE NOT CHECKED: no Chromium; apt-get install chromium brings one", file=sys.stderr)
        return 1 if os.environ.get("CI") else 0
    root = options.folder.resolve()
    pages = sorted(p for p in root.rglob("*.html") if "_static" not in p.parts and p.match(options.only))
    if options.screens:
        options.screens.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(2) as pool:
        halves = [pool.submit(faults, pages[first::2], root, options.screens) for first in range(2)]
        found = sorted(fault for half in halves for fault in half.result())
    print("\n".join(found) or f"{len(pages)} pages have no faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
