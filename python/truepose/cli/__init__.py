"""The command line: `truepose COMMAND MACHINE.toml`.

One command is one file. `COMMANDS` names them and is read lazily: `truepose --help` imports
click and the thin command files, never numpy, the kernel or the report.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import FrameType

import click

from truepose.cli._complete import COMPLETION
from truepose.cli._ending import INTERRUPTED, ending, refused_output
from truepose.cli._guard import GuardedGroup

COMMANDS: dict[str, str] = {
    "init": "truepose.cli.init",
    "import": "truepose.cli.import_",
    "check": "truepose.cli.check",
    "plan": "truepose.cli.plan",
    "calibrate": "truepose.cli.calibrate",
    "allocate": "truepose.cli.allocate",
    "compare": "truepose.cli.compare",
    "budget": "truepose.cli.budget",
    "compensate": "truepose.cli.compensate",
    "montecarlo": "truepose.cli.montecarlo",
    "bounds": "truepose.cli.bounds",
    "shares": "truepose.cli.shares",
    "over-time": "truepose.cli.over_time",
    "strain": "truepose.cli.strain",
    "study": "truepose.cli.study",
    "report": "truepose.cli.report",
    "live": "truepose.cli.live",
    "studio": "truepose.cli.studio",
    "part": "truepose.cli.part",
    "gcode": "truepose.cli.gcode",
    "export": "truepose.cli.export",
    "explain": "truepose.cli.explain",
    "schema": "truepose.cli.schema",
    "completion": "truepose.cli.completion",
}
"""Command name -> module that holds it, in the order of `truepose --help`."""

FEW_COLLECTIONS = 100_000
"""New containers after which Python looks for cycles among them: imports make many, and none."""


def _print_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if asked and not context.resilient_parsing:
        from truepose import __version__

        click.echo(f"truepose {__version__}")
        context.exit()


@click.command(
    cls=GuardedGroup,
    modules=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Print the version and exit.",
)
def cli() -> None:
    """Where the tool of a parallel kinematic machine really is, why, and what to command.

    Every command reads one machine file (TOML) and computes everything from it; as `-` it is
    standard input.

    Exit code 0: done. 1: the command is a question and the answer is no. 2: bad input. 70: a
    defect of this program.
    """


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line on `arguments` (default: those of the process) -> exit code."""
    try:
        try:
            if COMPLETION in os.environ:
                from truepose.cli._shells import answer_shells

                answer_shells()
            result = cli.main(args=arguments, prog_name="truepose", standalone_mode=False)
        except click.ClickException as problem:
            problem.show()
            return 2  # click gives some of its own problems the code 1, which here means "no"
        except click.Abort:
            return INTERRUPTED
        sys.stdout.flush()
    except BaseException as failure:
        # A panic of the kernel is no Exception, but no wish to leave either.
        if not isinstance(failure, Exception) and type(failure).__name__ != "PanicException":
            raise
        return ending(failure)
    return result if isinstance(result, int) else 0


def main() -> None:
    """Entry point of the `truepose` program."""
    if sys.stderr is None:  # closed by who calls us
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115
    if sys.stdout is None:
        sys.exit(refused_output("a standard output that is closed"))
    gc.set_threshold(FEW_COLLECTIONS)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that has no µ shows a question mark, not a traceback.
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) is signal.SIG_DFL:  # nohup ignores it, and so do we then
            signal.signal(number, _leave)
    sys.exit(run())


def _leave(number: int, _: FrameType | None) -> None:
    """End as the signal would, but with no temporary file left."""
    sys.exit(128 + number)
