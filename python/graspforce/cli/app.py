"""The command line put together: every command is registered here, and every error gets its exit code."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from graspforce import __version__
from graspforce._internal.printable import printable
from graspforce.errors import GraspForceError, InfeasibleWrenchError, InvalidFileError

from . import forces, grade, info, plan, plan_hand, quality, reproduce, shake, view
from .command import Command
from .exit_codes import BAD_FILE, FAILED, INFEASIBLE, MEANINGS

_EXIT_CODES = "Exit codes: " + "; ".join(f"{code} {meaning}" for code, meaning in MEANINGS.items()) + "."

app = typer.Typer(
    name="graspforce",
    help="Quality, contact planning and force distribution for multifingered grasps.",
    epilog=_EXIT_CODES,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)
# A further command is one module with a function that Typer can read, and one line here.
app.command("quality", cls=Command)(quality.quality)
app.command("forces", cls=Command)(forces.forces)
app.command("plan", cls=Command)(plan.plan)
app.command("plan-hand", cls=Command)(plan_hand.plan_hand_command)
app.command("shake", cls=Command)(shake.shake_command)
app.command("grade", cls=Command)(grade.grade)
app.command("view", cls=Command)(view.view)
app.command("reproduce", cls=Command)(reproduce.reproduce)
app.command("info", cls=Command)(info.info)


def run(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    command = typer.main.get_command(app)
    try:
        command.main(arguments, prog_name="graspforce", standalone_mode=True)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except InvalidFileError as error:
        return _failed(error, BAD_FILE)
    except InfeasibleWrenchError as error:
        return _failed(error, INFEASIBLE)
    except (GraspForceError, OSError) as error:
        return _failed(error, FAILED)
    return 0


def _failed(error: Exception, code: int) -> int:
    print(printable(f"graspforce: {error}", keep="\n"), file=sys.stderr)
    return code


def _version(asked: bool) -> None:
    if asked:
        print(f"graspforce {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _main(
    context: typer.Context,
    version: Annotated[  # noqa: ARG001 - its callback has done the work
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit(2)
