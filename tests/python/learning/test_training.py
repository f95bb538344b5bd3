"""The training examples learn: the quality of their grasps grows to that of a search."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[3] / "examples" / "learning"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["train_jax", "train_torch"])
def test_the_quality_of_the_grasps_grows(name):
    pytest.importorskip(name.removeprefix("train_"), reason="make learning installs it")
    _, curve = example(name).train(60)
    assert np.mean(curve[-10:]) > 0.35
    assert np.mean(curve[-10:]) > np.mean(curve[:5]) + 0.1


def test_a_network_comes_near_a_search_and_draws_it(tmp_path):
    pytest.importorskip("jax", reason="make learning installs it")
    picture = tmp_path / "training.png"
    command = [EXAMPLES / "train_jax.py", "--steps", "150", "--starts", "1", "--plot", picture]
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines()][-5:]
    for *_, network, searched in rows:
        assert float(network) > 0.8 * float(searched)
    assert picture.stat().st_size > 10_000
