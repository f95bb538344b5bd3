"""The command line as a user meets it: in a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest


def run(*arguments, cwd, code=0):
    command = [sys.executable, "-m", "graspforce", *arguments]
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False
    )
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("racket")
    done = run("reproduce", "racket", "--json", "deep/racket.json", "--out", "pictures", cwd=folder)
    return folder, done.stdout


def test_the_racket_is_printed_beside_the_published_numbers(reproduced):
    _, text = reproduced
    for published in ("129.15 s", "165.97 s", "434.58 s", "479.67 s", "1.3868", "0.9521", "1.1336", "29.34"):
        assert published in text
    for computed in ("-3.002221", "-1.685471", "-11.795293", "-6.477177", "1.3866", "0.9520"):
        assert computed in text
    assert "neither is claimed" in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 100


def test_json_holds_the_reference_iterates_and_table(reproduced, racket):
    folder, _ = reproduced
    found = json.loads((folder / "deep" / "racket.json").read_text())
    for plan in found["plans"]:
        expected = racket[plan["problem"].replace(" fingers", "_finger")][plan["criterion"]]
        rho = [row["rho"] for row in plan["history"]]
        assert rho == pytest.approx([row["rho"] for row in expected], rel=1e-9)
    for row in found["table_1"]["rows"]:
        computed = racket["table1"]["rows"][row["row"]]["computed"]
        least_max = row["least_max"]["computed"]
        assert [least_max["max"], least_max["sum"]] == pytest.approx(computed[2:], rel=1e-9)


def test_one_picture_is_drawn_for_each_plan(reproduced):
    folder, _ = reproduced
    pictures = sorted(path.name for path in (folder / "pictures").iterdir())
    assert pictures == [f"racket-{n}-fingers-{c}.png" for n in ("four", "three") for c in ("max", "sum")]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in (folder / "pictures").iterdir())


def test_the_tile_is_printed_as_printed_and_as_inferred(tmp_path):
    text = run("reproduce", "tile", "--json", "tile.json", "--out", ".", cwd=tmp_path).stdout
    for published in ("112.38 min", "53.67 min", "0.199200", "as printed", "inferred", "not force closure"):
        assert published in text
    assert "no forces balance the wrench at any time" in text
    for computed in ("3.310346", "-2.148574", "-0.971987", "0.6610 to 0.9432", "0.7085 to 1.2478"):
        assert computed in text
    assert max(map(len, text.splitlines())) <= 100
    iterations = {(p["friction"], p["criterion"]): len(p["history"]) - 1
                  for p in json.loads((tmp_path / "tile.json").read_text())["plans"]}  # fmt: skip
    assert iterations[0.68, "max"] == 10
    assert iterations[0.68, "sum"] == 19
    pictures = sorted(path.name for path in tmp_path.glob("*.png"))
    plans = [f"tile-{c}-friction-{mu}.png" for c in ("max", "sum") for mu in ("0.2", "0.68")]
    assert pictures == sorted([*plans, "tile-forces-figure-6.png", "tile-forces-figure-7.png"])


def test_the_script_and_the_module_are_one_command(tmp_path):
    script = Path(sys.executable).with_name("graspforce")
    done = subprocess.run([script, "--version"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == run("--version", cwd=tmp_path).stdout


def test_without_a_command_help_is_shown(tmp_path):
    assert "reproduce" in run(cwd=tmp_path, code=2).stdout


def test_an_unknown_example_is_refused_with_the_known_ones(tmp_path):
    assert "racket" in run("reproduce", "squash", cwd=tmp_path, code=2).stderr


def test_a_path_that_cannot_be_written_is_an_error_not_a_traceback(tmp_path):
    (tmp_path / "file").write_text("")
    assert "file" in run("reproduce", "racket", "--json", "file/x.json", cwd=tmp_path, code=1).stderr
