"""A command whose options are blamed by name for wrong values, in words that do not depend on a validator."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand

from graspforce._internal.printable import printable
from graspforce.errors import InvalidFileError, InvalidGraspError, InvalidInputError
from graspforce.files.reasons import reason

if TYPE_CHECKING:
    from collections.abc import Sequence


class Command(TyperCommand):
    """A command of the command line."""

    def parse_args(self, ctx: Any, args: Sequence[str]) -> list[str]:
        """Convert the arguments; a wrong one is said with its value and what would do."""
        try:
            return super().parse_args(ctx, list(args))
        except typer.BadParameter as error:
            # Typer quotes its validator.
            if callable(errors := getattr(error.__cause__, "errors", None)):
                error.message = printable(reason(errors()[0]))
            raise

    def invoke(self, ctx: Any) -> Any:
        """Run the command; of a wrong value of an option the option is named, not an argument in Python."""
        try:
            return super().invoke(ctx)
        except InvalidFileError:
            raise
        except (InvalidInputError, InvalidGraspError) as error:
            found = re.match(r"(\w+)((?:, [^:]*)?): (.*)", str(error), re.DOTALL)
            flag = "" if found is None else self._flag(ctx, found[1])
            if found is None or not flag:
                raise
            message = f"{found[2].removeprefix(', ')}: {found[3]}" if found[2] else found[3]
            raise typer.BadParameter(printable(message), ctx=ctx, param_hint=flag) from None

    def _flag(self, ctx: Any, name: str) -> str:
        """Return the flag of an option that is not left at its default."""
        options = (p for p in self.params if p.name == name and p.param_type_name == "option")
        return next((p.opts[0] for p in options if ctx.params.get(name) != p.get_default(ctx)), "")
