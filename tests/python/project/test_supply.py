"""What releases are built from and tested with: pinned versions, licences, workflows pinned by commit."""

import importlib.util
import re
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
CONSTRAINTS = (ROOT / "constraints.txt").read_text().splitlines()
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def tool(name):
    """Import a script of the folder tools."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


notices, extension = tool("third_party_notices"), tool("build_extension")


def canonical(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def test_constraints_are_names_and_versions_and_nothing_else():
    for line in CONSTRAINTS:
        assert re.fullmatch(r"[a-z0-9.-]+==[0-9a-z.]+( ; [a-z_0-9.'=!<>*() ]+)?", line, re.IGNORECASE), line


def test_constraints_pin_all_that_is_installed_by_name():
    groups = PROJECT["dependency-groups"].values()
    extras = PROJECT["project"]["optional-dependencies"]
    named = [r for group in groups for r in group if isinstance(r, str)] + PROJECT["project"]["dependencies"]
    named += [r for extra, listed in extras.items() if extra != "all" for r in listed]
    wanted = {canonical(re.match(r"[\w.-]+", requirement)[0]) for requirement in named}
    assert wanted - {canonical(line.split("==")[0]) for line in CONSTRAINTS} == set()


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_actions_are_pinned_by_commit_with_their_tag_beside(path):
    used = re.findall(r"uses: (\S+)(.*)", path.read_text())
    for action, comment in used:
        if not action.startswith("./"):
            assert re.fullmatch(r"[\w/-]+@[0-9a-f]{40}", action), action
            assert re.fullmatch(r" # v\d+\.\d+\.\d+", comment), action


def test_one_commit_of_an_action_serves_all_workflows():
    text = "".join(path.read_text() for path in WORKFLOWS)
    commits = dict(re.findall(r"uses: ([\w/-]+)@([0-9a-f]{40})", text))
    assert len(commits) == len(set(re.findall(r"uses: ([\w/-]+@[0-9a-f]{40})", text)))


def crate(folder, name, files, depends=(), source="registry", licence="MIT OR Apache-2.0"):
    """Return a package and its node as cargo describes them, with its files on disk."""
    home = folder / name
    home.mkdir()
    for file, text in files.items():
        (home / file).write_text(text)
    package = {"id": name, "name": name, "version": "1.0.0", "license": licence, "source": source}
    deps = [{"pkg": other, "dep_kinds": [{"kind": kind}]} for other, kind in depends]
    return {**package, "manifest_path": str(home / "Cargo.toml")}, {"id": name, "deps": deps}


def described(*crates):
    packages, nodes = zip(*crates, strict=True)
    return {"packages": list(packages), "resolve": {"nodes": list(nodes)}}


def test_notices_name_what_is_linked_and_print_each_text_once(tmp_path):
    mit = "Copyright somebody\n\nPermission is granted"
    spaced = mit.replace("\n", "\r\n") + "  \n"
    depends = (("left", None), ("right", None), ("tests", "dev"), ("script", "build"))
    metadata = described(
        crate(tmp_path, "root", {}, depends, source=None),
        crate(tmp_path, "left", {"LICENSE-MIT": mit, "README": "hello"}, [("deep", None)], licence="MIT"),
        crate(tmp_path, "right", {"license.txt": spaced}, licence="MIT/Apache-2.0"),
        crate(tmp_path, "deep", {"COPYING": "do as you like"}, licence="Unlicense"),
        crate(tmp_path, "tests", {}),
        crate(tmp_path, "script", {}),
    )
    linked = notices.linked_crates(metadata, "root")
    assert [package["name"] for package in linked] == ["deep", "left", "right"]
    text = notices.notices(linked)
    assert text.count("Permission is granted") == text.count("do as you like") == 1
    assert "right 1.0.0: MIT OR Apache-2.0\n" in text
    assert "\nleft 1.0.0, right 1.0.0\n" in text
    assert "hello" not in text


@pytest.mark.parametrize(
    ("files", "licence", "message"),
    [({"LICENSE": "text"}, None, "states no licence"), ({"README": ""}, "MIT", "ships no text")],
)
def test_a_crate_without_a_licence_is_refused_by_name(tmp_path, files, licence, message):
    package, _ = crate(tmp_path, "bare", files, licence=licence)
    with pytest.raises(ValueError, match=f"bare 1.0.0: {message}"):
        notices.notices([package])


def test_notices_name_each_crate_of_others_that_the_lock_file_has():
    named = set(re.findall(r"^([\w-]+ \d\S+): ", notices.NOTICES.read_text(), re.MULTILINE))
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    assert len(named) > 50
    assert named <= {f"{package['name']} {package['version']}" for package in lock if "source" in package}


def test_folders_of_this_machine_are_replaced_the_inner_after_the_outer():
    flags = extension.rust_flags({"RUSTFLAGS": "-C target-cpu=native", "CARGO_HOME": "/home/me/.cargo"})
    assert flags[:2] == ["-C", "target-cpu=native"]
    folders = [flag.removeprefix("--remap-path-prefix=").split("=")[0] for flag in flags[2:]]
    assert folders[0] == str(Path.home())
    assert folders[-1] == str(ROOT)
    assert folders.index("/home/me/.cargo") < folders.index(str(Path("/home/me/.cargo/registry/src")))
    assert extension.rust_flags({"CARGO_ENCODED_RUSTFLAGS": "-C\x1fa b"})[:2] == ["-C", "a b"]


def test_the_source_distribution_holds_licences_lock_file_and_what_builds_it(tmp_path):
    command = [sys.executable, "-m", "maturin", "sdist", "--out", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (path,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"LICENSE", "THIRD_PARTY_NOTICES", "Cargo.lock", "pyproject.toml"} <= names
