"""The C interface, by programs of C and C++: its answers, its errors, its memory and its threads.

The programs are in `tests/c`. They are compiled with all warnings as errors. They are linked with the shared
library as `pkg-config` says, or with the static one.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.random_grasps import random_grasp

import graspforce as gf

ROOT = Path(__file__).parents[3]
SOURCES = ROOT / "tests" / "c"
WARNINGS = ["-Wall", "-Wextra", "-pedantic", "-Werror"]

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the programs are for Linux"),
    pytest.mark.skipif(
        not all(map(shutil.which, ("cargo", "gcc", "g++"))), reason="needs cargo, gcc and g++"
    ),
]


def run(*command, **options):
    """Return what a command prints; one that fails shows what it said."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, **options
    )
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


@pytest.fixture(scope="session")
def prefix(tmp_path_factory):
    """Return a folder into which the library was installed, and which was moved afterwards."""
    built, moved = (tmp_path_factory.mktemp("capi") / name for name in ("built", "moved"))
    # As the tests of Rust have it, which saves compiling it twice.
    run(sys.executable, ROOT / "tools" / "build_c_library.py", "--debug", "--prefix", built)
    built.rename(moved)
    return moved


@pytest.fixture(scope="session")
def flags(prefix):
    """Return what pkg-config answers; where it is not installed, the same by hand."""
    by_hand = [f"-I{prefix / 'include'}", f"-L{prefix / 'lib'}", "-lgraspforce"]
    if not shutil.which("pkg-config"):
        return by_hand
    environment = {**os.environ, "PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig")}
    asked = run("pkg-config", "--cflags", "--libs", "graspforce", env=environment).split()
    assert {Path(flag[2:]).resolve() for flag in asked[:2]} == {prefix / "include", prefix / "lib"}
    assert asked[2:] == by_hand[2:]
    return asked


@pytest.fixture
def compiled(prefix, flags, tmp_path):
    """Return a function that compiles a program of `tests/c` with the shared or the static library."""

    def build(name, compiler="g++", standard="-std=c++14", static=False):
        program = tmp_path / name.split(".")[0]
        library = (
            [prefix / "lib" / "libgraspforce.a", "-ldl"]
            if static
            else [*flags, f"-Wl,-rpath,{prefix / 'lib'}"]
        )
        source = [SOURCES / name, f"-I{prefix / 'include'}", "-o", program, "-pthread"]
        run(compiler, standard, *WARNINGS, "-O1", *source, *library, "-lm")
        return program

    return build


@pytest.mark.parametrize("static", [False, True])
def test_the_header_is_c99_and_both_libraries_link(compiled, static):
    answer = run(compiled("header.c", "gcc", "-std=c99", static=static))
    assert answer.startswith(f"graspforce {gf.__version__}: sigma 0.25")


@pytest.mark.parametrize("standard", ["-std=c++11", "-std=c++14", "-std=c++20"])
def test_the_header_is_cpp_of_any_standard(prefix, standard):
    header = prefix / "include" / "graspforce.h"
    run("g++", standard, *WARNINGS, "-fsyntax-only", "-include", header, "-x", "c++", os.devnull)


def test_errors_name_the_argument_the_contact_and_the_value(compiled):
    assert "checks" in run(compiled("errors.cpp"))


def test_threads_share_grasps_and_get_right_answers_or_busy(compiled):
    assert "busy" in run(compiled("threads.cpp"))


@pytest.mark.parametrize("static", [False, True])
def test_the_calls_of_the_loop_take_no_memory_and_no_lock_and_make_no_system_call(compiled, static):
    printed = run(compiled("system_calls.cpp", static=static), 200 if static else 800)
    assert printed.count(" 0 allocations, 0 releases, 0 locks") == len(printed.splitlines())


def test_the_library_gives_away_its_functions_alone(prefix):
    symbols = run("nm", "-D", "--defined-only", prefix / "lib" / "libgraspforce.so")
    assert all(re.fullmatch(r"[0-9a-f]+ T gf_\w+", line) for line in symbols.splitlines()), symbols


@pytest.mark.skipif(not shutil.which("cmake"), reason="needs CMake")
@pytest.mark.parametrize("target", ["graspforce", "static"])
def test_cmake_finds_the_installed_library(prefix, tmp_path, target):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\n"
        "project(user LANGUAGES C)\n"
        f"find_package(graspforce {gf.__version__} REQUIRED)\n"
        f"add_executable(user {SOURCES / 'header.c'})\n"
        f"target_link_libraries(user PRIVATE graspforce::{target} m)\n"
    )
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", tmp_path / "build")
    assert "sigma 0.25" in run(tmp_path / "build" / "user")


class Case:
    """A grasp with what is asked about it, as Python's arguments and as the program's numbers."""

    def __init__(self, seed, objective=None):
        rng = np.random.default_rng(seed)
        dim = 2 if seed % 5 == 0 else 3
        count = int(rng.integers(2, 7))
        arguments = random_grasp(seed, dim, count, 8)
        edges = [0] * count if seed % 3 == 0 else [int(n) for n in rng.integers(4, 12, count)]
        torsion = rng.uniform(0.01, 0.1, count) * (dim == 3 and seed % 4 == 0)
        rows = [int(n) for n in rng.integers(3, 9, count)] if seed % 7 == 3 and not objective else [0] * count
        columns = 2 if dim == 2 else 4
        extreme = [rng.uniform([0.5] + [-1.0] * (columns - 1), 1.0, (n, columns)) for n in rows]
        options = {
            "origin": rng.normal(size=dim),
            "length_scale": float(rng.uniform(0.1, 2.0)),
            "friction_margin": float(rng.uniform(1.0, 1.5)),
        }
        self.objective = objective or ("sum" if seed % 2 else "max")
        self.weight = float(rng.choice([0.0, 0.1])) if self.objective == "max" else 0.0
        self.min_normal = None if seed % 6 or any(rows) or objective else rng.uniform(0.0, 0.1, count)
        self.wrenches = rng.normal(size=(6, 3 * dim - 3))
        given = extreme if any(rows) else None
        kinds = {"edges": None if 0 in edges else edges, "torsion": torsion if torsion.any() else None}
        self.grasp = gf.Grasp(**{**arguments, **kinds}, **options, extreme_forces=given)
        # References well inside the cones, so that the least squares follow from linear equations.
        self.weights = rng.uniform(0.5, 2.0, count)
        self.reference = 1e3 * (np.arange(self.grasp.force_dim) == 0) * np.ones((count, 1))
        self.slack = np.diag(rng.uniform(0.5, 2.0, self.grasp.wrench_dim)) if seed % 2 else None
        numbers = [dim, count, self.grasp.force_dim]
        tangents = arguments.get("tangents", np.zeros((count, dim)))
        for i in range(count):
            numbers += [*arguments["positions"][i], *arguments["normals"][i], *tangents[i]]
            numbers += [arguments["friction"][i], arguments["max_normal_force"][i], torsion[i], edges[i]]
            numbers += [rows[i], *extreme[i].ravel()]
        numbers += [*options["origin"], options["length_scale"], options["friction_margin"]]
        numbers += [["max", "sum", "squares"].index(self.objective), self.weight]
        numbers += [-1] * count if self.min_normal is None else [*self.min_normal]
        if self.objective == "squares":
            numbers += [*self.weights, *self.reference.ravel()]
            numbers += [0] if self.slack is None else [1, *self.slack.ravel()]
        numbers += [len(self.wrenches), *self.wrenches.ravel()]
        self.numbers = " ".join(repr(float(number)) for number in numbers)

    def sigma(self, solution):
        """Return what is minimised."""
        if self.objective == "sum":
            return solution.sigma_sum
        return solution.sigma_max + self.weight * solution.sigma_sum

    def norm(self, wrench):
        """Return the norm in which the nearest wrench is nearest."""
        torque = self.grasp.wrench_dim // 2 if self.grasp.wrench_dim == 6 else 2
        return np.hypot(
            np.linalg.norm(wrench[:torque]), np.linalg.norm(wrench[torque:]) / self.grasp.length_scale
        )

    def least_distance(self, wrench, residual):
        """Return a lower bound of the distance, by the half-space that the residual is orthogonal to."""
        grasp, torque = self.grasp, self.grasp.wrench_dim // 2 if self.grasp.wrench_dim == 6 else 2
        scale = np.where(np.arange(grasp.wrench_dim) < torque, 1.0, grasp.length_scale)
        normal = -residual / scale
        normal /= np.linalg.norm(normal)
        pushes = (grasp.primitive_wrenches / scale) @ normal
        reach = sum(max(0.0, part.max()) for part in np.split(pushes, np.cumsum(grasp.num_edges)[:-1]))
        return normal @ (-wrench / scale) - reach

    def least_squares(self, wrench):
        """Return the forces and the residual of the linear equations."""
        matrix = self.grasp.grasp_matrix
        inverse = matrix / np.repeat(self.weights, self.grasp.force_dim)
        rest = -wrench - matrix @ self.reference.ravel()
        dual = inverse @ matrix.T + (0.0 if self.slack is None else np.linalg.inv(self.slack))
        forces = self.reference.ravel() + inverse.T @ np.linalg.lstsq(dual, rest, rcond=None)[0]
        return forces.reshape(self.reference.shape), wrench + matrix @ forces


class Printed:
    """The numbers of one line of the program, from left to right."""

    def __init__(self, line):
        self.left = list(map(float, line.split()))

    def take(self, *shape):
        """Return the next numbers in a shape, or one number."""
        count = int(np.prod(shape))
        taken, self.left = np.array(self.left[:count]), self.left[count:]
        return taken.reshape(shape) if shape else float(taken[0])


def answered(compiled, cases):
    """Return what the program prints of each case."""
    printed = run(compiled("answers.cpp"), input="\n".join(case.numbers for case in cases))
    return zip(cases, map(Printed, printed.splitlines()), strict=True)


def check_solved(case, printed, wrench, distributor):
    """Compare a status, and forces or witness, with those of the Python library; return both statuses."""
    grasp, status = case.grasp, gf.Status(int(printed.take()))
    try:
        expected = distributor.solve(wrench)
    except gf.InfeasibleWrenchError as error:
        assert status is gf.Status.INFEASIBLE
        np.testing.assert_allclose(printed.take(grasp.wrench_dim), error.direction, atol=1e-9)
        return status, None
    assert status is gf.Status.SOLVED
    scale = np.abs(expected.forces).max()
    for _ in range(2):
        np.testing.assert_allclose(
            printed.take(*expected.forces.shape), expected.forces, rtol=0, atol=1e-9 * scale
        )
    assert printed.take() == pytest.approx(case.sigma(expected), rel=1e-9)
    assert printed.take() <= 1e-9
    assert np.abs(printed.take(grasp.wrench_dim)).max() <= 1e-9 * np.abs(wrench).max()
    return status, expected


def check_nearest(case, printed, wrench, balanced):
    """Check nearest forces: the balanced ones where they keep the limits, elsewhere no wrench is nearer."""
    grasp, shape = case.grasp, (case.grasp.num_contacts, case.grasp.force_dim)
    answers = [(printed.take(), printed.take(*shape)) for _ in range(2)]
    residual = printed.take(grasp.wrench_dim)
    for distance, forces in answers:
        # What is left of forces far larger than the wrench is rounding.
        scale = 1e-9 * max(np.abs(forces).max(), 1.0)
        np.testing.assert_allclose(
            wrench + grasp.grasp_matrix @ forces.ravel(), residual, rtol=0, atol=1e2 * scale
        )
        assert distance == pytest.approx(case.norm(residual), rel=1e-6, abs=1e2 * scale)
        if balanced is not None and balanced.sigma_max < 1 - 1e-6:
            np.testing.assert_allclose(forces, balanced.forces, rtol=0, atol=1e2 * scale)
        elif case.min_normal is None and distance > 1e-3 and (grasp.num_edges > 0).all():
            assert distance == pytest.approx(case.least_distance(wrench, residual), rel=1e-6)


def test_answers_are_those_of_the_python_library(compiled):
    statuses = set()
    for case, printed in answered(compiled, [Case(seed) for seed in range(60)]):
        grasp = case.grasp
        np.testing.assert_array_equal(printed.take(*grasp.grasp_matrix.shape), grasp.grasp_matrix)
        np.testing.assert_array_equal(printed.take(*grasp.frames.shape), grasp.frames)
        options = {"weight": case.weight, "min_normal": case.min_normal}
        distributor = gf.ForceDistributor(grasp, case.objective, **options)
        for wrench in case.wrenches:
            status, balanced = check_solved(case, printed, wrench, distributor)
            check_nearest(case, printed, wrench, balanced)
            statuses.add(status)
        for criterion in ("max", "sum"):
            expected = grasp.quality(criterion, external_wrench=case.wrenches[-1])
            bracket = [expected.epsilon, expected.lower, expected.upper]
            assert list(printed.take(3)) == pytest.approx(bracket, rel=1e-9)
            assert ["force", "partial", "none"][int(printed.take())] == expected.closure
            np.testing.assert_allclose(printed.take(grasp.wrench_dim), expected.direction, atol=1e-6)
        assert printed.left == []
    assert statuses == {gf.Status.SOLVED, gf.Status.INFEASIBLE}


def test_least_squares_far_inside_the_cones_follow_from_linear_equations(compiled):
    solved = 0
    for case, printed in answered(compiled, [Case(seed, "squares") for seed in range(40)]):
        grasp, shape = case.grasp, case.reference.shape
        printed.take(*grasp.grasp_matrix.shape)
        printed.take(*grasp.frames.shape)
        for wrench in case.wrenches:
            forces, residual = case.least_squares(wrench)
            if gf.Status(int(printed.take())) is not gf.Status.SOLVED:
                printed.take(grasp.wrench_dim)
            else:
                # Linear equations have the answer where it lies inside all cones.
                friction = grasp.friction / grasp.friction_margin
                inside = np.linalg.norm(forces[:, 1:3], axis=1) < 0.6 * friction * forces[:, 0]
                if grasp.force_dim < 4 and inside.all():
                    solved += 1
                    for _ in range(2):
                        np.testing.assert_allclose(printed.take(*shape), forces, rtol=0, atol=1e-5)
                    objective = (case.weights[:, None] * (forces - case.reference) ** 2).sum() / 2
                    objective += 0.0 if case.slack is None else residual @ case.slack @ residual / 2
                    assert printed.take() == pytest.approx(objective, rel=1e-6)
                    printed.take()
                    np.testing.assert_allclose(printed.take(grasp.wrench_dim), residual, atol=1e-5)
                else:
                    printed.take(2 * forces.size + 2 + grasp.wrench_dim)
            printed.take(2 * forces.size + 2 + grasp.wrench_dim)
    assert solved > 20
