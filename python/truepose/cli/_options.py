"""Options that several commands share, and the settings they make."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from truepose.cli import _complete
from truepose.cli._guard import JSON_ASKED
from truepose.language import ENGLISH

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

Command = TypeVar("Command", bound=Callable[..., Any])


@dataclass(frozen=True)
class Request:
    """What was asked of a command, as parsed from its options."""

    machine_file: Path
    settings: tuple[str, ...] = ()
    format: str = "table"
    output: Path | None = None
    strict: bool = False
    require_accuracy: bool = False
    witness: Path | None = None


class FileName(click.Path):
    """A file by its name. `endings`: what names most often end with, which a shell then offers."""

    def __init__(self, *endings: str) -> None:
        super().__init__(path_type=Path)
        self.endings = endings

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Folders, and files that end as these do."""
        return _complete.files(incomplete, self.endings)


class InputFile(FileName):
    """A file that the command reads; "-" is standard input, for one file of a command."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path; of standard input what it is called. Raises `RequestError` (stdin-twice)."""
        if value == "-":
            from truepose.files.one_run import will_read_stdin

            return will_read_stdin()
        return Path(os.fsdecode(super().convert(value, param, ctx)))


class OutputFile(FileName):
    """A file, or a folder, that the command writes: the same as no other, and no input."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path, once it is noted what it is asked for with."""
        from truepose.files.one_run import will_write

        if value == "":
            self.fail("an empty name", param, ctx)
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        will_write(path, value if param is None else param.opts[0])
        return path


def _note_format(context: click.Context, _: click.Parameter, value: str) -> str:
    context.meta[JSON_ASKED] = value == "json"
    return value


machine_argument = click.argument("machine_file", metavar="MACHINE.toml", type=InputFile(".toml"))
set_option = click.option(
    "--set",
    "settings",
    metavar="KEY=VALUE",
    multiple=True,
    shell_complete=_complete.settings,
    help="Try a change without editing the file, for example --set condition.temperature=28. "
    "May be repeated.",
)
format_option = click.option(
    "--format",
    "format",
    type=click.Choice(["table", "json", "csv"]),
    default="table",
    show_default=True,
    callback=_note_format,
    is_eager=True,
    help="What is printed: a table for people (mm and µm, or in and µin, as the file has it), "
    "or json or csv for programs (full precision, in the units of the machine file).",
)


def output_option_of(endings: str) -> Callable[[Command], Command]:
    """The option `--output FILE` of a command that writes the `endings` named."""
    return click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE",
        type=OutputFile(*re.findall(r"\.\w++", endings)),
        help=f"Also write the result to FILE; its ending chooses the form: {endings}.",
    )


output_option = output_option_of(".nc (NetCDF, SI), .json or .csv")
strict_option = click.option(
    "--strict",
    is_flag=True,
    help="Take poses that cannot be used for an error (exit code 2) instead of leaving them out.",
)
accuracy_option = click.option(
    "--require-accuracy",
    is_flag=True,
    help="Exit with code 1 when the accuracy asked in the machine file is not met.",
)
language_option = click.option(
    "--language",
    metavar="CODE",
    default=ENGLISH,
    shell_complete=_complete.languages,
    help="Language of the page and of what is printed. Default: en; others are files of "
    "`languages/`, such as de and pt.",
)


witness_option = click.option(
    "--witness",
    "witness",
    metavar="FILE.toml",
    type=OutputFile(".toml"),
    help="Where the accuracy asked is NOT met: write the machine that exceeds it, as a machine "
    "file at its pose.",
)


class WholeNumber(click.ParamType):  # type: ignore[type-arg]
    """A whole number, also as people write large ones: 1e6, 1_000_000."""

    name = "integer"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number; click's usage error for anything else."""
        try:
            return int(value)
        except ValueError:
            try:
                number = float(value)
            except ValueError:
                number = 0.5
        if not number.is_integer():
            self.fail(f"{value!r} is not a whole number.", param, ctx)
        return int(number)


seed_option = click.option(
    "--seed",
    type=WholeNumber(),
    default=0,
    show_default=True,
    help="The same seed draws the same samples, whatever the number of threads.",
)


def takes(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Apply several click options to a command, listed in the order of its help."""

    def decorate(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def read_share(option: str, text: str, *, code: str, expected: str) -> float:
    """A share, such as 98 % or 0.98. Raises `RequestError` with the `code` where it is none."""
    from truepose.errors import Problem, ReadingError, RequestError
    from truepose.files.units import UnitSystem

    try:
        return UnitSystem({}).read(text.strip(), "ratio")
    except ReadingError as failure:
        raise RequestError(
            Problem(
                code,
                f"{option}: {failure.message}",
                found=failure.found or text,
                expected=expected,
            )
        ) from None
