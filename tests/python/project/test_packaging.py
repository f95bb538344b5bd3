"""What is shipped: a light import, and a wheel that needs nothing but NumPy."""

import os
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

SOLVE_ONE = """
import graspforce as gf
grasp = gf.Grasp([(-1, 0), (1, 0), (0, 1)], [(1, 0), (-1, 0), (0, -1)], friction=0.5, max_normal_force=10)
assert grasp.quality("max").rho < 0
solution = gf.ForceDistributor(grasp).solve([0, -3, 0])
assert solution.within_limits
assert abs((grasp.grasp_matrix @ solution.forces.ravel() - [0, 3, 0])).max() < 1e-9
print(gf.__version__)
"""


def clean_environment():
    """Return what a user's shell has: none of this test run's paths."""
    ours = ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONHOME")
    return {name: value for name, value in os.environ.items() if name not in ours}


def test_importing_loads_nothing_optional():
    optional = [
        "matplotlib",
        "scipy",
        "trimesh",
        "manifold3d",
        "mujoco",
        "dask",
        "typer",
        "rich",
        "pydantic",
        "yaml",
        "viser",
        "pyarrow",
        "pandas",
        "filelock",
    ]
    code = f"import sys, graspforce; print([m for m in {optional!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.alone
def test_importing_takes_little_longer_than_numpy():
    code = "import time, numpy; t = time.perf_counter(); import graspforce; print(time.perf_counter() - t)"
    run = [sys.executable, "-c", code]
    # The fastest of several: what else the machine does is not what is asked.
    seconds = [float(subprocess.run(run, capture_output=True, check=True).stdout) for _ in range(7)]
    assert min(seconds) < 0.060


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Return the wheel that GRASPFORCE_WHEEL names, or else one built for the purpose."""
    if named := os.environ.get("GRASPFORCE_WHEEL"):
        return (ROOT / named).resolve(strict=True)
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "tools/build_extension.py", "build", "--release", "--out", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def bare_python(wheel, tmp_path_factory):
    """Make an interpreter that has the wheel, NumPy, and nothing else."""
    folder = tmp_path_factory.mktemp("bare")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True, env=clean_environment())
    python = folder / "bin" / "python"
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel]
    subprocess.run(install, check=True, env=clean_environment())
    return python


def run_bare(python, *arguments, cwd, code=0):
    done = subprocess.run(
        [python, *arguments], cwd=cwd, capture_output=True, text=True, check=False, env=clean_environment()
    )
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done


def test_the_wheel_serves_every_python_from_3_11_and_is_typed(wheel):
    assert "-cp311-abi3-" in wheel.name
    names = zipfile.ZipFile(wheel).namelist()
    assert {"graspforce/py.typed", "graspforce/_core.pyi"} <= set(names)
    assert all(name.startswith(("graspforce/", "graspforce-")) for name in names)


def test_the_wheel_carries_the_licences_of_all_it_is_built_from(wheel):
    with zipfile.ZipFile(wheel) as archive:
        carried = {Path(name).name: archive.read(name) for name in archive.namelist() if "/licenses/" in name}
    for name in ("LICENSE", "THIRD_PARTY_NOTICES"):
        assert carried[name] == (ROOT / name).read_bytes()


def test_the_extension_module_holds_no_path_of_the_machine_that_built_it(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (module,) = [name for name in archive.namelist() if re.search(r"/_core\..*(so|pyd)$", name)]
        binary = archive.read(module)
    cargo = Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")
    for folder in (Path.home(), cargo, ROOT, Path(tempfile.gettempdir())):
        assert str(folder / "_").encode()[:-1] not in binary, folder
    # What is left says which crate panicked.
    assert b"registry/src" not in binary
    assert b"clarabel-" in binary


def test_the_wheel_brings_numpy_and_nothing_else(bare_python, tmp_path):
    listed = run_bare(bare_python, "-m", "pip", "list", "--format=freeze", cwd=tmp_path).stdout
    installed = {line.split("==")[0].split(" @")[0] for line in listed.splitlines()}
    assert installed - {"pip", "setuptools"} == {"graspforce", "numpy"}


def test_the_bare_wheel_measures_a_grasp_and_balances_a_wrench(bare_python, tmp_path):
    assert run_bare(bare_python, "-c", SOLVE_ONE, cwd=tmp_path).stdout.strip()


def test_the_bare_wheel_reproduces_the_racket(bare_python, tmp_path):
    assert "Table 1" in run_bare(bare_python, "-m", "graspforce", "reproduce", "racket", cwd=tmp_path).stdout


def test_the_bare_wheel_says_what_other_commands_need(bare_python, tmp_path):
    for command in ("quality", "forces", "plan"):
        done = run_bare(bare_python, "-m", "graspforce", command, "cup.yaml", cwd=tmp_path, code=1)
        assert "graspforce[cli]" in done.stderr
    assert "graspforce[cli]" in run_bare(bare_python, "-m", "graspforce", cwd=tmp_path, code=2).stdout


@pytest.mark.parametrize(("module", "extra"), [("plotting", "plot"), ("files", "cli"), ("viewer", "viewer")])
def test_the_bare_wheel_says_what_a_module_needs(bare_python, tmp_path, module, extra):
    code = f"""
import graspforce as gf
try:
    import graspforce.{module}
except gf.MissingExtraError as error:
    print(error)
"""
    assert f"graspforce[{extra}]" in run_bare(bare_python, "-c", code, cwd=tmp_path).stdout


def test_the_bare_wheel_says_what_datasets_need(bare_python, tmp_path):
    code = """
import graspforce as gf
try:
    gf.grade("grasps.parquet", "out")
except gf.MissingExtraError as error:
    print(error)
"""
    assert "graspforce[datasets]" in run_bare(bare_python, "-c", code, cwd=tmp_path).stdout


def test_the_bare_wheel_says_what_figures_need(bare_python, tmp_path):
    arguments = ["-m", "graspforce", "reproduce", "racket", "--out", "pictures"]
    assert "graspforce[plot]" in run_bare(bare_python, *arguments, cwd=tmp_path, code=1).stderr
