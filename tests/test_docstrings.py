"""Every example in a docstring and in the README runs and prints what it says."""

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import pytest

import graspforce
from graspforce import _core

ROOT = Path(__file__).parents[1]
MODULES = sorted(
    m.name
    for m in pkgutil.iter_modules(graspforce.__path__, "graspforce.")
    if m.name != "graspforce.__main__"
)


@pytest.mark.parametrize("name", ["graspforce", *(m for m in MODULES if m != "graspforce._core")])
def test_examples_of_the_python_modules_run(name):
    result = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0


def compiled_docstrings():
    """Docstrings of the extension module's classes, methods and functions, which doctest does not find."""
    for name, item in vars(_core).items():
        if name.startswith("_"):
            continue
        yield name, item.__doc__
        if isinstance(item, type):
            for member, value in vars(item).items():
                if not member.startswith("_"):
                    yield f"{name}.{member}", value.__doc__


@pytest.mark.parametrize(("name", "text"), list(compiled_docstrings()), ids=lambda value: str(value)[:40])
def test_examples_of_the_extension_module_run(name, text):
    assert text, f"{name} has no docstring"
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    assert doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test).failed == 0


def test_the_examples_of_the_readme_run():
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, "README.md", "exec"), {})
