"""Sphinx configuration: pages, and a gallery and command output that are made while building."""

import subprocess
import sys
from pathlib import Path

from matplotlib.sphinxext import mathmpl

import graspforce

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"

project = "graspforce"
author = copyright = "The graspforce developers"  # noqa: A001 - Sphinx's own name
version = release = graspforce.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "matplotlib.sphinxext.mathmpl",
    "sphinx_gallery.gen_gallery",
    "myst_parser",
]
mathmpl_fontsize = 12.5
mathmpl_srcset = ["2x"]
default_role = "py:obj"
# A name of this package must lead somewhere; in backquotes stand parameters and other packages' names, too.
nitpicky = True
nitpick_ignore_regex = [("py:class", ".*"), ("py:obj", r"(?!graspforce\b).*")]
exclude_patterns = ["_build", "_generated"]
html_theme = "furo"
html_title = f"graspforce {version}"
html_theme_options = {"sidebar_hide_name": False}
html_static_path = ["_static"]
html_css_files = ["blocks.css"]

# Gigabytes, of which the pages show nothing.
autodoc_mock_imports = ["torch", "jax"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_use_ivar = True

sphinx_gallery_conf = {
    "examples_dirs": [str(EXAMPLES / "gallery")],
    "gallery_dirs": ["gallery"],
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_signature": False,
    "abort_on_example_error": True,
    "plot_gallery": True,
    "capture_repr": (),
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
}


def print_commands(_app: object) -> None:
    """Run every command and script that a page shows: the page shows what they print today."""
    folder = HERE / "_generated"
    folder.mkdir(exist_ok=True)
    programs = {name: ["-m", "graspforce", *arguments] for name, arguments in COMMANDS.items()} | SCRIPTS
    for name, arguments in programs.items():
        command = [sys.executable, *arguments]
        done = subprocess.run(command, cwd=EXAMPLES, capture_output=True, text=True, check=True)
        text = "\n".join(line.rstrip() for line in done.stdout.splitlines())
        (folder / f"{name}.txt").write_text(text + "\n", encoding="utf-8")


def setup(app):  # noqa: ANN001, ANN201 - Sphinx's hook
    """Register what happens before pages are read."""
    app.connect("builder-inited", print_commands)
    # Formulas as pictures: a page from disk shows them without a script from the network.
    app.add_role("math", mathmpl.math_role, override=True)
    app.add_directive("math", mathmpl.MathDirective, override=True)
