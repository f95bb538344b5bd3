"""The command line: names that attack the terminal, terminals that lack letters, folders not there."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import graspforce as gf
from graspforce._internal.printable import printable
from graspforce.cli.exit_codes import BAD_FILE, DONE, FAILED, MISUSED
from graspforce.cli.main import _bare, main

NASTY = "cup\x1b]0;owned\x07\x1b[2J\x9b31m\u202egpj\r\x7f\nOK: fine"
GREEK = "Φλιτζάνι"
CONTACTS = [
    {"position": [0.04, 0, 0], "normal": [-1, 0, 0]},
    {"position": [-0.02, 0.035, 0], "normal": [0.5, -0.866, 0]},
    {"position": [-0.02, -0.035, 0], "normal": [0.5, 0.866, 0]},
]
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2066-\u2069]")


def grasp_file(path, name, **more):
    path.write_text(json.dumps({"name": name, "friction": 0.6, "contacts": CONTACTS, **more}))
    return str(path)


def commands(path, folder):
    yield "quality", path
    yield "quality", path, "--json"
    yield "quality", path, "--plot", str(folder / "q.png")
    yield "forces", path, "--wrench", "0,0,-1,0,0,0"
    yield "forces", path, "--wrench", "0,0,-1,0,0,0", "--plot", str(folder / "f.svg")
    yield "forces", path, "--wrench", "0,0,-1,0,0,0", "--json", "--out", str(folder / "f.npz")


@pytest.mark.filterwarnings("error")
def test_names_from_files_reach_no_terminal_as_they_are(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    path = grasp_file(tmp_path / "grasp.json", NASTY)
    for command in commands(path, tmp_path):
        assert main(command) == DONE
        shown = capsys.readouterr()
        assert not OBEYED.search(shown.out + shown.err), command
        assert not any(line.startswith("OK") for line in shown.out.splitlines()), command
        if command[-1] == path:
            assert printable(NASTY)[:20] in shown.out


def test_errors_that_quote_a_file_reach_no_terminal_as_they_are(tmp_path, capsys):
    odd = tmp_path / "a\x1b[2Jb.json"
    for text in (r'{"contacts": [{"position": "\u001b[2J"}]}', "{", r'{"\u001b[31m": 1}'):
        odd.write_text(text)
        assert main(["quality", str(odd)]) == BAD_FILE
        shown = capsys.readouterr()
        assert not OBEYED.search(shown.out + shown.err)
        assert r"a\x1b[2Jb.json" in shown.err
    assert main(["quality", str(tmp_path / "none\x1b[2J.json")]) in (FAILED, BAD_FILE)
    assert not OBEYED.search(capsys.readouterr().err)
    assert str(gf.InvalidInputError("x\x1b[2J\ny")) == "x\\x1b[2J\ny"


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_name_is_printed_on_a_terminal_that_lacks_its_letters(tmp_path, encoding):
    path = grasp_file(tmp_path / f"{GREEK}.json", GREEK)
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    for command in (
        ("quality", path),
        ("forces", path, "--wrench", "0,0,-1,0,0,0", "--out", str(tmp_path / f"{GREEK}.npz")),
        ("quality", str(tmp_path / f"not {GREEK}.json")),
    ):
        done = subprocess.run(
            [sys.executable, "-m", "graspforce", *command],
            env=environment, capture_output=True, stdin=subprocess.DEVNULL, check=False,
        )  # fmt: skip
        known = path in command
        assert done.returncode == (DONE if known else BAD_FILE), done.stderr
        assert b"Traceback" not in done.stderr
        name = GREEK.encode("ascii", "backslashreplace").decode()
        assert name in (done.stdout if known else done.stderr).decode()


def test_output_goes_into_folders_that_exist(tmp_path, capsys):
    path = grasp_file(tmp_path / "grasp.json", "cup")
    deep = tmp_path / "not" / "there"
    problem = Path(__file__).parents[3] / "examples" / "egg.yaml"
    for command in (
        ("quality", path, "--plot", str(deep / "q.png")),
        ("forces", path, "--wrench", "0,0,-1,0,0,0", "--plot", str(deep / "f.png")),
        ("forces", path, "--wrench", "0,0,-1,0,0,0", "--out", str(deep / "f.npz")),
        ("plan", str(problem), "--out", str(deep / "p.json")),
        ("plan", str(problem), "--plot", str(deep / "p.png")),
        ("reproduce", "racket", "--out", str(deep)),
        ("reproduce", "racket", "--json", str(deep / "r.json")),
        ("grade", str(tmp_path / "none.parquet"), "--out", str(deep / "graded")),
    ):
        assert main(command) == MISUSED, command
        assert "does not exist; make it first" in " ".join(
            re.sub("[│╭╮╰╯─]", " ", capsys.readouterr().err).split()
        )
        assert not (tmp_path / "not").exists()
    with pytest.raises(SystemExit) as ended:
        _bare(["reproduce", "racket", "--out", str(deep)])
    assert ended.value.code == MISUSED
    assert "does not exist; make it first" in capsys.readouterr().err
    assert not (tmp_path / "not").exists()


def test_printable_keeps_every_letter_and_nothing_that_acts():
    assert printable("Φλιτζάνι, 把手, ß é 1.5") == "Φλιτζάνι, 把手, ß é 1.5"
    rng = np.random.default_rng(0)
    for _ in range(300):
        text = "".join(map(chr, rng.integers(0, 0x3000, 20)))
        assert printable(text).isprintable()
        assert not OBEYED.search(printable(text, keep="\n\t").replace("\n", "").replace("\t", ""))
    assert printable("\ud800 \U000e0001") == "\\ud800 \\U000e0001"
