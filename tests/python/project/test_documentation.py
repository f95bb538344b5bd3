"""What README and documentation print: commands that run, links that lead somewhere, all public names."""

import importlib
import inspect
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import graspforce as gf

ROOT = Path(__file__).parents[3]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.rst")),
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "guides").glob("*.rst")),
]

INSTALLS, WAITS, LONG, CI = "installs", "serves until it is ended", "takes minutes", "is what CI runs itself"
CLUSTER = "needs a cluster"
SIMULATED = "needs MuJoCo; tests/python/adapters/test_controller_examples.py runs it"
TRAINED = "needs JAX; tests/python/learning runs it"
HANDS = "needs MuJoCo; tests/python/hands/test_grasps.py runs it"
NOT_RUN = {
    "pip install .": INSTALLS,
    "pip install '.[all]'": INSTALLS,
    "graspforce --install-completion": INSTALLS,
    "graspforce view pinched_egg.yaml --wrenches lift.csv": WAITS,
    "graspforce view best.json": WAITS,
    "graspforce view plan.json": WAITS,
    "pip install '.[hands,cli,plot]'": INSTALLS,
    "graspforce plan-hand allegro-right egg.off --unit mm --out plan.json --plot plan.png": HANDS,
    "graspforce plan-hand my_hand.yaml egg.off --unit mm": HANDS,
    "graspforce shake plan.json --closing": HANDS,
    "python benches/hands.py": LONG,
    "python benches/hands.py --sizes 8 --only shadow --servo 1": LONG,
    "python benches/hands.py --seed 2": LONG,
    "python benches/holds.py": LONG,
    "pip install --group objects --group simulators": INSTALLS,
    "python benches/hands.py --sizes 8 --only four --ablations": LONG,
    "make build": CI,
    "source .venv/bin/activate": INSTALLS,
    "python tools/first_steps.py": LONG,
    "cd examples": "is where the test runs commands",
    "make demo": CI,
    "make test": CI,
    "make lint": CI,
    "make docs": CI,
    "make capi": CI,
    "make capi PREFIX=/usr/local": INSTALLS,
    "make header": CI,
    "make bench": LONG,
    "make compare": LONG,
    "make fuzz": LONG,
    "make fuzz FUZZ_SECONDS=600": LONG,
    "HOSTILE_EXAMPLES=1500 pytest tests/python/robustness/test_hostile_arguments.py": LONG,
    "HOSTILE_EXAMPLES=150 pytest tests/python/files/test_hostile_files.py": LONG,
    "LEAK_SHARE=1 pytest tests/python/robustness/test_memory.py": LONG,
    "PYTHONMALLOC=malloc valgrind python tests/python/support/every_binding.py": "needs Valgrind",
    'RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=target/asan PATH="target/tools/bin:$PATH" cargo fuzz run '
    "--sanitizer address forces target/fuzz/corpus/forces -- -runs=0": LONG,
    "pip install '.[datasets]'": INSTALLS,
    "pip install '.[dask]'": INSTALLS,
    "dask scheduler": WAITS,
    "RAYON_NUM_THREADS=8 dask worker HEAD:8786 --nworkers 2 --nthreads 1": CLUSTER,
    "graspforce grade /shared/grasps --out /shared/graded --scheduler tcp://HEAD:8786": CLUSTER,
    "python benches/grade.py": LONG,
    "python benches/growth.py": LONG,
    "python benches/force_sweep.py": LONG,
    "python benches/facets.py solids": LONG,
    "python benches/global_search.py": LONG,
    "python benches/global_search.py --meshes": LONG,
    "cargo bench --bench control_latency": LONG,
    "python force_controller.py --plot force_controller.png": SIMULATED,
    "python fourth_foot.py": SIMULATED,
    "cargo bench --bench force_latency": LONG,
    "cargo bench --bench quality -- gradients": LONG,
    "cargo test --test laws hostile": CI,
    "pip install '.[torch]'": INSTALLS,
    "python train_jax.py --plot training.png": TRAINED,
    "make surrogates": LONG,
    "python -m benches.surrogates": LONG,
    "python -m benches.surrogates --peers": LONG,
    "python benches/forces_many.py": LONG,
    "python benches/smoothing.py": LONG,
    "python -m benches.compare.fine_pyramids": LONG,
    "python -m benches.trust": LONG,
    "python -m benches.trust cone_histories": LONG,
    "python -m benches.trust large_forces": LONG,
    "python -m benches.trust nearest": LONG,
}
"""Commands that a test cannot run, and why."""


def commands():
    """Every command with its page's name, in the order it is printed: in blocks for shells, and in text."""
    found = []
    for page in PAGES:
        text = page.read_text()
        blocks = [
            *re.findall(r"```(?:sh|bash|console)\n(.*?)```", text, re.DOTALL),
            *re.findall(r"code-block:: (?:sh|bash|console)\n\n((?: {3}.*\n|\n)+)", text),
        ]
        lines = [line.strip().removeprefix("$ ") for block in blocks for line in block.splitlines()]
        programs = "python|graspforce|make|pip|cargo|pytest|valgrind"
        lines += re.findall(rf"`+((?:[A-Z_]+=\S+ )*(?:{programs}) [^`]+)`", text)
        for line in lines:
            command = " ".join(line.partition("  #")[0].partition(" # ")[0].split())
            # Options without values describe a command and are none.
            if command and not re.search(r"[A-Z]{3,}$|\.\.\.", command):
                found.append((page.stem, command))
    return list(dict.fromkeys(found))


def attacks():
    """Return the command of each row of a table below ``pytest FILE -k WORDS``."""
    found = []
    for section in re.split(r"^#+ ", (ROOT / "docs" / "trust.md").read_text(), flags=re.MULTILINE):
        if file := re.search(r"`pytest (\S+) -k WORDS`", section):
            words = re.findall(r"\| `([^`]+)` \|$", section, re.MULTILINE)
            found += [("trust", f"pytest {file[1]} -k {word}") for word in words]
    return found


COMMANDS = commands()
TESTS = [*(pair for pair in COMMANDS if pair[1].startswith("pytest ")), *attacks()]
# What several pages print runs once, where it is printed first.
FIRST = {command: page for page, command in reversed(COMMANDS)}
RUN = [(page, command) for page, command in COMMANDS if FIRST[command] == page and command not in NOT_RUN]
RUN = [pair for pair in RUN if pair not in TESTS]


def test_the_list_of_commands_that_are_not_run_is_no_longer_than_it_must_be():
    assert set(NOT_RUN) - {command for _, command in COMMANDS} == set()
    assert len(RUN) > 15


@pytest.mark.parametrize(("page", "command"), TESTS, ids=[f"{page}: {command}" for page, command in TESTS])
def test_a_test_that_the_documentation_names_exists(page, command):
    _, file, *chosen = shlex.split(command)
    files = sorted((ROOT / file).rglob("test_*.py")) if (ROOT / file).is_dir() else [ROOT / file]
    tests = [
        test for each in files for test in re.findall(r"^def (test_\w+)", each.read_text(), re.MULTILINE)
    ]
    words = re.split(r" or | and ", chosen[1]) if chosen[:1] == ["-k"] else []
    for word in words:
        assert any(word in test for test in tests), f"{page}: no test of {file} is named by {word}"


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """Return a copy of the folder of examples, in which one command finds what another has written."""
    return shutil.copytree(ROOT / "examples", tmp_path_factory.mktemp("docs") / "examples")


@pytest.mark.parametrize(("page", "command"), RUN, ids=[f"{page}: {command}" for page, command in RUN])
def test_a_command_of_the_documentation_runs_as_printed(page, command, examples):
    words = shlex.split(command)
    if words[0] == "graspforce":
        words = [sys.executable, "-m", *words]
    elif words[0] == "python":
        words = [sys.executable, *(str(ROOT / w) if w.startswith("benches/") else w for w in words[1:])]
    else:
        pytest.fail(f"{page}: {words[0]} is neither run nor listed with a reason")
    target = words.index(">") if ">" in words else len(words)
    done = subprocess.run(
        words[:target],
        cwd=examples,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr


def targets(page):
    """Files that a page refers to, relative to it."""
    text = page.read_text()
    yield from re.findall(r"\]\(((?!https?:|#)[^)\s]+)\)", text)
    yield from re.findall(r"\.\. (?:include|literalinclude|image):: (\S+)", text)
    yield from (f"{name}.rst" for name in re.findall(r":doc:`[^`]*?([^`<>\s]+)>?`", text))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_that_a_page_refers_to_exist(page):
    for name in targets(page):
        if "_generated" in name:
            continue  # written while the pages are built
        if drawn := re.match(r"/?gallery/(?:images/sphx_glr_)?(plot_\w+?)(?:_\d{3})?\.\w+$", name):
            assert (ROOT / "examples" / "gallery" / f"{drawn[1]}.py").exists(), name
            continue
        base = ROOT / "docs" if name.startswith("/") else page.parent
        path = base / name.lstrip("/").partition("#")[0]
        assert path.exists() or path.with_suffix(".md").exists(), f"{page.name}: {name}"


def test_links_to_other_sites_are_secure_and_few():
    sources = [*PAGES, *(ROOT / "python").rglob("*.py"), *(ROOT / "examples").rglob("*.py")]
    links = {link for page in sources for link in re.findall(r"https?://[^\s`>)\"'}]+", page.read_text())}
    foreign = {link for link in links if "127.0.0.1" not in link}
    assert all(link.startswith("https://") for link in foreign)
    assert len(foreign) <= 12


def test_every_public_name_is_in_the_reference():
    assert set(gf.__all__) - shown_names() - {"surfaces", "hands", "__version__"} == set()


@pytest.mark.parametrize("module", ["surfaces", "hands", "datasets", "files", "plotting", "viewer"])
def test_every_public_name_of_a_module_is_in_the_reference(module):
    names = importlib.import_module(f"graspforce.{module}").__all__
    shown = shown_names()
    assert [name for name in names if f"{module}.{name}" not in shown and name not in shown] == []


def shown_names():
    """Names in the tables of the reference, below graspforce."""
    return set(re.findall(r"^   ([a-zA-Z][\w.]+)$", (ROOT / "docs" / "api.rst").read_text(), re.MULTILINE))


def public_members(value):
    for name, member in vars(value).items():
        if not name.startswith("_") and (inspect.isroutine(member) or isinstance(member, staticmethod)):
            yield name


@pytest.mark.parametrize("name", [name for name in gf.__all__ if isinstance(getattr(gf, name), type)])
def test_every_method_and_attribute_of_a_class_is_on_its_page(name, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_extensions"))
    pages = importlib.import_module("api_pages")
    value = getattr(gf, name)
    described = [each for names, _, _ in pages.attributes_of(value.__doc__) for each in names.split(", ")]
    assert set(public_members(value)) <= {*pages.members_of("graspforce", name), *described}
