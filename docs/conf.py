"""Sphinx configuration: pages, and a gallery and command output that are made while building."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mathjax

import graspforce

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_extensions"))
from social_card import draw_card  # noqa: E402 - from the folder above

EXAMPLES = HERE.parent / "examples"

project = "graspforce"
author = copyright = "The graspforce developers"  # noqa: A001 - Sphinx's own name
version = release = graspforce.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "sphinxext.opengraph",
    "myst_parser",
    "api_pages",
]
templates_path = ["_templates"]
suppress_warnings = ["config.cache"]  # the templates call a function, which Sphinx cannot store
# A page from disk shows its formulas, too: the script lies beside it.
mathjax_path = "mathjax/tex-svg.js"
mathjax3_config = {"options": {"enableMenu": False}}
default_role = "py:obj"
# A name of this package must lead somewhere; in backquotes stand parameters and other packages' names, too.
nitpicky = True
nitpick_ignore_regex = [("py:class", ".*"), ("py:obj", r"(?!graspforce\b).*")]
exclude_patterns = ["_build", "_generated"]
html_theme = "furo"
html_title = f"graspforce {version}"
html_theme_options = {"sidebar_hide_name": False}
html_static_path = ["_static", "_generated/static"]
html_css_files = ["pages.css"]
html_favicon = "_static/favicon.svg"
# DOCS_URL is where the pages will be, with a slash at its end: social networks need whole addresses.
html_baseurl = ogp_site_url = os.environ.get("DOCS_URL", "")
ogp_image = "_static/card.png"
ogp_image_alt = "A ball held by three contacts, with friction cones and forces"
ogp_social_cards = {"enable": False}

# Gigabytes, of which the pages show nothing.
autodoc_mock_imports = ["torch", "jax"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_custom_sections = ["Attributes"]  # api_pages makes a table of it

sphinx_gallery_conf = {
    "examples_dirs": [str(EXAMPLES / "gallery")],
    "gallery_dirs": ["gallery"],
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_signature": False,
    "abort_on_example_error": True,
    "plot_gallery": True,
    "capture_repr": (),
    "image_scrapers": ("labelled_figures.labelled",),
    "remove_config_comments": True,
}

COMMANDS = {
    "racket": ["reproduce", "racket", "--out", str(HERE / "_generated")],
    "tile": ["reproduce", "tile"],
    "quality": ["quality", "cup.yaml"],
    "forces": ["forces", "cup.yaml", "--wrench", "0,0,-5,0,0,0"],
    "trajectory": ["forces", "cup.yaml", "--wrenches", "lift.csv"],
    "plan": ["plan", "disc.yaml"],
    "egg": ["plan", "egg.yaml", "--plot", str(HERE / "_generated" / "egg.png")],
    "help": ["--help"],
}
SCRIPTS = {
    "force_controller": ["force_controller.py", "--plot", str(HERE / "_generated" / "force_controller.png")],
    "fourth_foot": ["fourth_foot.py"],
    "landing": ["landing.py"],
    "costs": [str(HERE.parent / "benches" / "costs.py")],
}
TIMED = "costs"  # runs alone


def copy_mathjax() -> None:
    """Lay the script of formulas, and its licence, beside the other static files."""
    package = Path(mathjax.__file__).parent / "static" / "mathjax"
    target = HERE / "_generated" / "static" / "mathjax"
    target.mkdir(parents=True, exist_ok=True)
    for name in ("es5/tex-svg.js", "LICENSE"):
        shutil.copy(package / name, target)


def print_commands(_app: object) -> None:
    """Run every command and script that a page shows: the page shows what they print today."""
    folder = HERE / "_generated"
    folder.mkdir(exist_ok=True)
    programs = {name: ["-m", "graspforce", *arguments] for name, arguments in COMMANDS.items()} | SCRIPTS

    def run(name: str) -> None:
        command = [sys.executable, *programs[name]]
        done = subprocess.run(command, cwd=EXAMPLES, capture_output=True, text=True, check=True)
        text = "\n".join(line.rstrip() for line in done.stdout.splitlines())
        (folder / f"{name}.txt").write_text(text + "\n", encoding="utf-8")

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(run, [name for name in programs if name != TIMED]))
    run(TIMED)


def setup(app):  # noqa: ANN001, ANN201 - Sphinx's hook
    """Register what happens before pages are read."""
    copy_mathjax()
    draw_card(HERE / "_generated" / "static" / "card.png")
    app.connect("builder-inited", print_commands)
