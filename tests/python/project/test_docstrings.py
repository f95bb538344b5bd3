"""Every example in a docstring and in the README runs and prints what it says."""

import contextlib
import doctest
import importlib
import io
import pkgutil
import re
from pathlib import Path

import pytest

import graspforce
from graspforce import _core

ROOT = Path(__file__).parents[3]
MODULES = sorted(
    m.name
    for m in pkgutil.walk_packages(graspforce.__path__, "graspforce.")
    if m.name != "graspforce.__main__"
)


# What examples of a module or a page use beyond what the development build installs.
NEEDED = {
    "graspforce.adapters.mujoco": "mujoco",
    "graspforce.adapters.drake": "pydrake",
    "graspforce.adapters.pinocchio": "pinocchio",
    "graspforce.jax": "jax",
    "graspforce.torch": "torch",
    "graspforce.torch.operators": "torch",
    "simulators": "mujoco",
    "learning": "torch",
    "own_hand": "mink",
    "graspforce.plotting.hand": "mink",
    **{f"graspforce.hands.{m}": "mink" for m in ("hand", "known_hands", "planner", "reaching", "trial")},
}


@pytest.mark.parametrize("name", ["graspforce", *(m for m in MODULES if m != "graspforce._core")])
def test_examples_of_the_python_modules_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    if name in NEEDED:
        pytest.importorskip(NEEDED[name])
    result = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0


def compiled_docstrings():
    """Docstrings of the extension module's classes, methods and functions, which doctest does not find."""
    for name, item in vars(_core).items():
        if name.startswith("_"):
            continue
        yield name, item.__doc__
        for member, value in vars(item).items() if isinstance(item, type) else ():
            # An attribute of a result may be explained by its class, in the section of attributes.
            if not member.startswith("_") and not explained(member, item.__doc__):
                yield f"{name}.{member}", value.__doc__


def explained(attribute, text):
    return re.search(rf"^(\w+, )*{attribute}(, \w+)* : ", text or "", re.MULTILINE)


@pytest.mark.parametrize(
    ("name", "text"), [pytest.param(name, text, id=name) for name, text in sorted(compiled_docstrings())]
)
def test_examples_of_the_extension_module_run(name, text):
    assert text, f"{name} has no docstring"
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    assert doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test).failed == 0


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *(ROOT / "docs").glob("*.md")], ids=lambda page: page.stem
)
def test_the_examples_of_markdown_pages_run(page):
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    assert blocks or page.stem != "README"
    for block in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(block, page.name, "exec"), {})
        promised = re.findall(r"# prints: (.*)", block)
        assert not promised or printed.getvalue().splitlines() == promised


@pytest.mark.parametrize(
    "page",
    [*(ROOT / "docs").glob("*.rst"), *(ROOT / "docs" / "guides").glob("*.rst")],
    ids=lambda page: page.stem,
)
def test_the_examples_of_the_documentation_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if page.stem in NEEDED:
        pytest.importorskip(NEEDED[page.stem])
    result = doctest.testfile(str(page), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
