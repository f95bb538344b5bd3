"""The examples of `graspforce.torch`, `graspforce.jax` and of their page run."""

import doctest
import importlib
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[3] / "docs" / "guides" / "learning.rst"


@pytest.mark.parametrize("package", ["torch", "jax"])
def test_the_examples_of_the_module_run(package):
    pytest.importorskip(package, reason="make learning installs it")
    module = importlib.import_module(f"graspforce.{package}")
    result = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
    assert result.attempted > 10


def test_the_examples_of_the_page_run():
    for package in ("torch", "jax"):
        pytest.importorskip(package, reason="make learning installs it")
    result = doctest.testfile(str(PAGE), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
    assert result.attempted > 5
