"""`truepose check`: what the machine file holds, and whether the accuracy asked is met."""

from __future__ import annotations

from typing import Any

import click

from truepose.cli._options import (
    Request,
    format_option,
    machine_argument,
    output_option_of,
    set_option,
    strict_option,
    takes,
    witness_option,
)
from truepose.cli._verbose import verbose_option


@click.command("check")
@takes(
    machine_argument,
    set_option,
    format_option,
    output_option_of(".json or .csv"),
    strict_option,
    witness_option,
    click.option(
        "--watch",
        is_flag=True,
        help="Check again whenever the file, or a data file that it names, changes, until Ctrl-C; "
        "the exit code is that of the last check.",
    ),
    click.option(
        "--expand",
        is_flag=True,
        help="Write the file with the joint centres that follow from its [family], and check "
        "nothing: to --output FILE.toml, else to stdout.",
    ),
    verbose_option,
)
def command(*, watch: bool, expand: bool, **options: Any) -> int:
    """Describe a machine, and say if it is accurate enough.

    Exit code 1 unless it is certain that the machine, commanded as it is, keeps the accuracy
    asked; what compensation would leave is shown beside it. What looks odd about the file stands
    above the answer, and changes neither it nor the exit code.
    """
    request = Request(**options)
    if expand:
        if watch or request.witness is not None or request.strict:
            raise click.UsageError("--expand checks nothing: it goes with --set and --output only.")
        return _expand(request)
    if not watch:
        return _check(request)
    from truepose.cli._watch import watched
    from truepose.files.one_run import is_stdin

    if is_stdin(request.machine_file):
        raise click.UsageError("--watch needs a file: standard input does not change.")
    return watched(lambda: _check(request), request.machine_file, as_json=request.format == "json")


def _check(request: Request) -> int:
    """Describe the machine and answer -> exit code."""
    from truepose.cli import _steps
    from truepose.cli._show import show_answers, show_oddities, show_tables
    from truepose.errors import TrueposeError
    from truepose.files.writing import replacing, written_together
    from truepose.reporting.check import check_watched, text
    from truepose.verdict.answer import AFTER, BEFORE

    machine = _steps.read_machine(request, [".json", ".csv"])
    watching = _steps.Watching(request)
    try:
        result = check_watched(machine, watching)
    except TrueposeError:
        # It may be why there is no answer.
        show_oddities(watching.odd, err=True)
        raise
    kept = result.met is not False
    state = AFTER if kept else BEFORE
    with written_together():
        written = _steps.write_witness(request, result.answers, state)
        if request.output is not None:
            form = request.output.suffix.lower().removeprefix(".")
            with replacing(request.output) as temporary:
                temporary.write_text(text(result, form) + "\n", encoding="utf-8")
    if request.format == "table":
        show_oddities(result.oddities)
        show_answers(machine, result.answers)
        show_tables(result.tables)
    else:
        click.echo(text(result, request.format))
    _steps.note_written(request.output, request.witness if written else None)
    if not written:
        raise _steps.no_witness(result.answers, state)
    return int(not kept)


def _expand(request: Request) -> int:
    """Write the machine file with its joint centres."""
    from truepose.calibration.result.expanded import expanded
    from truepose.cli import _steps
    from truepose.files.writing import replacing

    machine = _steps.read_machine(request, [".toml"])
    text = expanded(machine, request.machine_file)
    if request.output is None:
        click.echo(text, nl=False)
        return 0
    with replacing(request.output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    _steps.note_written(request.output)
    return 0
