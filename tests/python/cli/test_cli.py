"""The command line as a user meets it."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import graspforce as gf
from graspforce.cli.exit_codes import BAD_FILE, DONE, FAILED, INFEASIBLE, MISUSED, PAST_LIMITS
from graspforce.cli.main import _bare, main
from graspforce.cli.trajectory import solve_trajectory
from graspforce.files import WrenchFile

EXAMPLES = Path(__file__).parents[3] / "examples"
CUP, DISC, LIFT = (str(EXAMPLES / name) for name in ("cup.yaml", "disc.yaml", "lift.csv"))
WEIGHT = ("--wrench", "0,0,-5,0,0,0")
PNG = b"\x89PNG"


def run(*arguments, cwd, code=0):
    """Run the command in a process of its own."""
    command = [sys.executable, "-m", "graspforce", *arguments]
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False
    )
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture
def call(capsys):
    """Run the command in this process, which is faster, and return what it printed."""

    def called(*arguments, code=DONE):
        assert main(arguments) == code
        return capsys.readouterr()

    return called


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("racket")
    return folder / "out", run("reproduce", "racket", "--out", "out", cwd=folder).stdout


def test_the_racket_is_printed_beside_the_published_numbers(reproduced):
    _, text = reproduced
    assert "wrote" not in text
    for published in ("129.15 s", "165.97 s", "434.58 s", "479.67 s", "1.3868", "0.9521", "1.1336", "29.34"):
        assert published in text
    for computed in ("-3.002221", "-1.685471", "-11.795293", "-6.477177", "1.3866", "0.9520"):
        assert computed in text
    assert "does not explain the difference" in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 100


def test_the_numbers_are_written_to_the_file_that_is_named(tmp_path):
    run("reproduce", "racket", "--json", "numbers.json", cwd=tmp_path)
    assert json.loads((tmp_path / "numbers.json").read_text())["plans"]


@pytest.mark.parametrize("module", ["graspforce.cli.app", "graspforce.cli.main"])
def test_the_numbers_may_lie_in_the_folder_that_out_makes(tmp_path, monkeypatch, module):
    monkeypatch.chdir(tmp_path)
    arguments = ["reproduce", "racket", "--out", "out", "--json", "out/racket.json"]
    if module == "graspforce.cli.main":
        assert _bare(arguments) == DONE
    else:
        assert main(arguments) == DONE
    assert json.loads((tmp_path / "out" / "racket.json").read_text())["plans"]


def test_json_holds_the_reference_iterates_and_table(reproduced, racket):
    folder, _ = reproduced
    found = json.loads((folder / "racket.json").read_text())
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
    pictures = sorted(folder.glob("*.png"))
    assert [path.name for path in pictures] == [
        f"racket-{n}-fingers-{c}.png" for n in ("four", "three") for c in ("max", "sum")
    ]
    assert all(path.read_bytes().startswith(PNG) for path in pictures)


def test_the_tile_is_printed_as_printed_and_as_inferred(tmp_path):
    text = run("reproduce", "tile", "--out", ".", cwd=tmp_path).stdout
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


def test_without_a_command_help_is_shown(call):
    assert "reproduce" in call(code=MISUSED).out


@pytest.mark.parametrize("command", ["quality", "forces", "plan", "view", "reproduce", "info"])
def test_help_has_an_example(call, command):
    assert f"Example: graspforce {command}" in call(command, "--help").out


def test_help_explains_the_exit_codes(call):
    assert "3 an input file is unusable" in " ".join(call("--help").out.split())


def test_shells_can_be_taught_to_complete(tmp_path, monkeypatch):
    # The shell that is named counts, not the one that runs the tests.
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    assert "graspforce" in run("--show-completion", "bash", cwd=tmp_path).stdout


def test_an_unknown_example_is_refused_with_the_known_ones(call):
    assert "racket" in call("reproduce", "squash", code=MISUSED).err


def test_a_path_that_cannot_be_written_is_an_error_not_a_traceback(tmp_path):
    (tmp_path / "file").write_text("")
    assert "file" in run("reproduce", "racket", "--out", "file", cwd=tmp_path, code=FAILED).stderr


def test_quality_prints_both_criteria(call):
    text = call("quality", CUP).out
    grasp = gf.Grasp(
        [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)],
        [(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0)],
        friction=0.6, max_normal_force=20, length_scale=0.04,
    )  # fmt: skip
    for criterion in ("max", "sum"):
        assert f"{grasp.quality(criterion).epsilon:.9g}" in text


def test_nothing_is_printed_beside_the_result(call):
    assert call("quality", CUP).err == ""
    assert "-0.000000" not in call("quality", CUP).out


def test_quality_about_a_weight_is_another(call):
    found = json.loads(call("quality", CUP, "--external-wrench", "0,0,-5,0,0,0", "--json").out)
    assert found["external_wrench"] == found["rho_max"]["external_wrench"] == [0, 0, -5, 0, 0, 0]
    assert "on top of [0, 0, -5, 0, 0, 0]" in call("quality", CUP, "--external-wrench", "0,0,-5,0,0,0").out
    plain = json.loads(call("quality", CUP, "--json").out)
    assert found["rho_max"]["epsilon"] < plain["rho_max"]["epsilon"]
    assert plain["grasp"]["num_contacts"] == 3


def test_forces_against_one_wrench_balance_it(call):
    found = json.loads(call("forces", CUP, *WEIGHT, "--json").out)
    np.testing.assert_allclose(np.sum(found["world_forces"], axis=0), [0, 0, 5], atol=1e-9)
    assert f"sigma_max {found['sigma_max']:.6g}" in call("forces", CUP, *WEIGHT).out


def test_forces_over_time_are_those_of_each_moment(call, tmp_path):
    found = json.loads(
        call("forces", CUP, "--wrenches", LIFT, "--json", "--out", str(tmp_path / "f.npz")).out
    )
    one = json.loads(call("forces", CUP, "--wrench", ",".join(map(str, found["wrenches"][7])), "--json").out)
    assert found["sigma_max"][7] == pytest.approx(one["sigma_max"], rel=1e-9)
    arrays = np.load(tmp_path / "f.npz")
    assert arrays["forces"].shape == (41, 3, 3)
    assert arrays["times"][-1] == 2.0
    assert "largest sigma_max" in call("forces", CUP, "--wrenches", LIFT).out


def test_a_wrench_that_cannot_be_balanced_has_its_exit_code(call, tmp_path):
    pinch = tmp_path / "pinch.yaml"
    pinch.write_text("contacts: [{position: [0, 0], normal: [1, 0]}]\n")
    assert "separating" in call("forces", str(pinch), "--wrench", "1,0,0", code=INFEASIBLE).err
    wrenches = tmp_path / "w.csv"
    wrenches.write_text("-1,0,0\n1,0,0\n")
    printed = call("forces", str(pinch), "--wrenches", str(wrenches), "--json", code=INFEASIBLE).out
    assert json.loads(printed)["sigma_max"] == [1.0, None]


def test_forces_past_the_limits_have_their_exit_code(call, tmp_path):
    heavy = ("--wrench", "0,0,-90,0,0,0")
    printed = call("forces", CUP, *heavy, code=PAST_LIMITS).out
    assert "ABOVE THE LIMITS" in printed
    assert "slip margin 0" in printed
    call("forces", CUP, *heavy, "--nearest")
    rows = tmp_path / "w.csv"
    rows.write_text("0,0,-5,0,0,0\n0,0,-90,0,0,0\n")
    call("forces", CUP, "--wrenches", str(rows), code=PAST_LIMITS)


def test_a_slip_margin_that_is_not_zero_is_not_explained(call, tmp_path):
    margin = tmp_path / "cup.yaml"
    margin.write_text(Path(CUP).read_text() + "friction_margin: 1.5\n")
    assert "slip margin 0" not in call("forces", str(margin), *WEIGHT).out


@pytest.mark.parametrize("command", ["quality", "forces", "plan", "view"])
@pytest.mark.parametrize("at", [(), ("--at", "0,0,0")])
def test_a_mesh_that_is_missing_or_cannot_be_read_is_named(call, tmp_path, command, at):
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    at = at if command != "plan" else ()
    wrench = WEIGHT if command == "forces" else ()
    for name, message in (("missing.stl", "missing.stl: "), ("part.step", "'step' cannot be read")):
        assert message in call(command, str(tmp_path / name), *at, *wrench, code=BAD_FILE).err


def test_commands_take_the_same_options_of_a_mesh_and_the_same_defaults(call, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.icosphere(subdivisions=2, radius=0.05).export(tmp_path / "ball.glb")
    ball, found = str(tmp_path / "ball.glb"), {}
    shared = ("--friction", "0.7", "--max-normal-force", "4", "--edges", "6", "--torsion", "0.01")
    for extra in ((), ("--length-scale", "0.02")):
        search = ("--contacts", "2", "--starts", "2", "--best", "1", "--no-refine")
        plan = json.loads(call("plan", ball, *search, *shared, *extra, "--json").out)["plans"][0]["grasp"]
        at = [word for point in plan["positions"] for word in ("--at", ",".join(map(str, point)))]
        found = json.loads(call("quality", ball, *at, *shared, *extra, "--json").out)["grasp"]
        for name in ("friction", "max_normal_force", "num_edges", "torsion", "length_scale", "origin"):
            assert found[name] == plan[name], name
        assert found["length_scale"] == pytest.approx(0.02 if extra else 0.05)


@pytest.mark.parametrize("arguments", [(), (*WEIGHT, "--wrenches", LIFT)])
def test_forces_want_one_source_of_wrenches(call, arguments):
    assert "either --wrench or --wrenches" in call("forces", CUP, *arguments, code=MISUSED).err


def test_a_wrench_of_the_wrong_length_says_what_is_expected(call):
    assert "fx,fy,fz,tx,ty,tz" in call("forces", CUP, "--wrench", "1,2", code=MISUSED).err


@pytest.mark.parametrize(
    ("arguments", "flag", "message"),
    [
        (("plan", "egg.off", "--contacts", "0"), "--contacts", "must be at least 2, given 0"),
        (("plan", "egg.off", "--contacts", "99"), "--contacts", "must be at most 12, given 99"),
        (("plan", "egg.off", "--friction", "-1"), "--friction", "must be at least 0, given -1"),
        (("plan", "egg.off", "--starts", "0"), "--starts", "must be at least 1"),
        (("plan", "egg.off", "--edges", "2"), "--edges", "must be at least 3"),
        (("quality", "egg.off", "--at", "1,x,2"), "--at", "y: 'x' is not a finite number"),
        (("quality", "egg.off", "--at", "1_0,0,0"), "--at", "'1_0' is not a finite number"),
        (("quality", "egg.off", "--at", "9,0,0"), "--at", "away from the mesh"),
        (("quality", "egg.off", "--at", "1,0,0", "--length-scale", "0"), "--length-scale", "greater than 0"),
        (("forces", CUP, "--wrench", "0,0,nan,0,0,0"), "--wrench", "fz: 'nan' is not a finite number"),
        (("forces", CUP, "--wrench", "1_0,0,0,0,0,0"), "--wrench", "fx: '1_0' is not a finite number"),
        (("quality", CUP, "--external-wrench", "1,2"), "--external-wrench", "is not 6 numbers"),
        (("quality", CUP, "--plot", "a.xyz"), "--plot", "known are"),
    ],
)
def test_a_wrong_value_of_an_option_is_blamed_on_the_option(
    call, tmp_path, monkeypatch, arguments, flag, message
):
    pytest.importorskip("trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'")
    monkeypatch.chdir(tmp_path)
    corners = "1 0 0\n-1 0 0\n0 1 0\n0 -1 0\n0 0 1\n0 0 -1\n"
    faces = "3 0 2 4\n3 2 1 4\n3 1 3 4\n3 3 0 4\n3 2 0 5\n3 1 2 5\n3 3 1 5\n3 0 3 5\n"
    (tmp_path / "egg.off").write_text(f"OFF\n6 8 0\n{corners}{faces}")
    said = " ".join(call(*arguments, code=MISUSED).err.replace("│", " ").split())
    assert f"Invalid value for {flag}" in said.replace("'", "")
    assert message in said


def test_plan_prints_every_iterate(call):
    found = json.loads(call("plan", DISC, "--criterion", "sum", "--json").out)
    assert found["history"][-1]["rho"] <= found["history"][0]["rho"]
    assert f"{found['quality']['epsilon']:.9g}" in call("plan", DISC, "--criterion", "sum").out


def test_a_criterion_has_two_values(call):
    assert "max" in call("plan", DISC, "--criterion", "mean", code=MISUSED).err


@pytest.mark.parametrize(
    "arguments",
    [
        ("quality", CUP),
        ("forces", CUP, *WEIGHT),
        ("forces", CUP, "--wrenches", LIFT),
        ("plan", DISC),
    ],
    ids=lambda arguments: "-".join(arguments[::2]).replace(CUP, ""),
)
def test_every_command_draws(call, tmp_path, arguments):
    picture = tmp_path / "picture.png"
    assert str(picture) in call(*arguments, "--plot", str(picture)).err
    assert picture.read_bytes().startswith(PNG)


def test_an_unknown_picture_format_is_named(call, tmp_path):
    assert "known are" in call("quality", CUP, "--plot", str(tmp_path / "a.xyz"), code=MISUSED).err


def test_a_bad_file_has_its_exit_code_and_names_line_and_field(call, tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text("contacts:\n  - position: [0, 0]\n    normal: [1, 0]\n    friction: -2\n")
    assert "bad.yaml:4: contacts[0].friction: " in call("quality", str(bad), code=BAD_FILE).err


def test_info_names_versions_and_schemas(call):
    assert json.loads(call("info", "--json").out)["versions"]["graspforce"] == gf.__version__
    assert (
        "position" in json.loads(call("info", "--schema", "grasp").out)["$defs"]["ContactModel"]["properties"]
    )
    assert "numpy" in call("info").out


def test_nearest_forces_report_what_stays_unbalanced(call, tmp_path):
    wrenches = tmp_path / "w.csv"
    wrenches.write_text("0,0,-5,0,0,0\n0,0,-500,0,0,0\n")
    asked = ("forces", CUP, "--wrenches", str(wrenches), "--nearest")
    printed = call(*asked).out
    assert "nearest forces" in printed
    assert "largest distance from balance" in printed
    found = json.loads(call(*asked, "--json", "--out", str(tmp_path / "f.npz")).out)
    np.testing.assert_array_equal(np.load(tmp_path / "f.npz")["residual"], found["residual"])
    small, large = np.linalg.norm(found["residual"], axis=1)
    assert small < 1e-6
    assert large > 1
    assert call("forces", CUP, "--wrench", "0,0,-5,0,0,0", "--nearest").out.endswith("balanced\n")


def test_a_row_that_succeeds_alone_is_answered_and_one_proven_hopeless_is_not():
    grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    hopeless = gf.Grasp([(0, 0)], [(1, 0)])
    wrenches = np.array([[0.1, 0, 0], [0, 0.2, 0], [0.3, 0.1, 0]])
    whole = gf.ForceDistributor(grasp)
    expected = whole.solve_many(wrenches)

    class Unlucky:
        """A distributor whose batch does not meet the tolerance in the middle."""

        def __init__(self, alone):
            self.grasp, self.solve = grasp, alone.solve

        def solve_many(self, rows):
            found = whole.solve_many(rows)
            nothing = np.where(np.arange(3) == 1, np.nan, 1.0)
            return SimpleNamespace(
                forces=found.forces * nothing[:, None, None], sigma_max=found.sigma_max * nothing,
                sigma_sum=found.sigma_sum * nothing, status=np.array([0, 3, 0]),
                residual=found.residual, distance=found.distance, balanced=found.balanced,
            )  # fmt: skip

    answered = solve_trajectory(Unlucky(whole), WrenchFile(wrenches), lambda _: None)
    np.testing.assert_allclose(answered.forces, expected.forces, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(answered.sigma_max, expected.sigma_max, rtol=1e-9)
    np.testing.assert_allclose(answered.sigma_sum, expected.sigma_sum, rtol=1e-9)
    unanswered = solve_trajectory(
        Unlucky(gf.ForceDistributor(hopeless)), WrenchFile(wrenches), lambda _: None
    )
    assert unanswered.infeasible.tolist() == [False, True, False]
