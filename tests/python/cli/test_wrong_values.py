"""A wrong value of any option of any command is said with option, value and what would do."""

import re
from pathlib import Path

import pytest

from graspforce.cli.exit_codes import MISUSED
from graspforce.cli.main import main

typer = pytest.importorskip("typer", reason="typer is not installed: pip install 'graspforce[cli]'")

CUP = str(Path(__file__).parents[3] / "examples" / "cup.yaml")
VALIDATOR = re.compile(r"Value error|Input should|unable to parse|pydantic|type=|Traceback|\{grasp\}")


def options():
    """Yield command, arguments and flag of each option that takes a number or one of some words."""
    from graspforce.cli.app import app  # noqa: PLC0415 - it needs the cli extra

    for name, command in typer.main.get_command(app).commands.items():
        arguments = [CUP for p in command.params if p.param_type_name == "argument"]
        if name == "reproduce":
            arguments = ["racket"]
        for option in command.params:
            if option.param_type_name == "option" and not option.is_flag:
                help_text = option.get_help_record(typer.Context(command))
                yield name, arguments, option.opts[0], help_text[0]


def said(capsys, arguments):
    code = main([str(argument) for argument in arguments])
    error = capsys.readouterr().err
    return code, " ".join(re.sub(r"[│╭╮╰╯─]", " ", error).split())


def test_what_is_no_number_and_no_choice_is_refused_by_its_option(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    tried = 0
    for name, arguments, flag, shown in options():
        if not re.search(r"INTEGER|FLOAT|\[.*\|.*\]", shown, re.IGNORECASE):
            continue
        code, error = said(capsys, [name, *arguments, flag, "furlong"])
        assert code == MISUSED, (name, flag, error)
        assert flag in error, (name, flag, error)
        assert "'furlong'" in error, (name, flag, error)
        assert not VALIDATOR.search(error), (name, flag, error)
        tried += 1
    assert tried > 20


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("quality", CUP, "--rtol", "5"), "--rtol: 5 must lie between 0 and 1"),
        (("view", CUP, "--port", "99999"), "--port.*(99999.*65535|65535.*99999)"),
        (("grade", CUP, "--out", "{tmp}/g", "--rows-per-part", "0"), "--rows-per-part: 0 must be at least 1"),
        (
            ("forces", CUP, "--wrench", "0,0,0,0,0,1", "--out", "{tmp}"),
            "--out.*is a folder; name a file in it",
        ),
        (("quality", CUP, "--plot", "{tmp}"), "--plot.*is a folder; name a file in it"),
        (("plan-hand", CUP, CUP, "--external-wrench", "1,2"), "--external-wrench: '1,2' is not 6 numbers"),
        (("quality",), "'GRASP'"),
    ],
)
def test_a_value_out_of_range_is_blamed_on_its_option(capsys, monkeypatch, tmp_path, arguments, expected):
    monkeypatch.setenv("COLUMNS", "200")
    code, error = said(capsys, [argument.format(tmp=tmp_path) for argument in arguments])
    assert code == MISUSED, error
    assert re.search(expected, error), error
    assert not VALIDATOR.search(error)
