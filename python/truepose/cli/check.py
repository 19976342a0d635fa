"""`truepose check`: what the machine file holds, and whether the accuracy asked is met."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.reporting.table import Table
    from truepose.reporting.workspace_check import WorkspaceCheck
    from truepose.verdict.answer import Answer


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
    from truepose.plausibility import oddities_where_checked
    from truepose.reporting.workspace_check import check_workspace
    from truepose.verdict.answer import AFTER, BEFORE, met

    machine = _steps.read_machine(request, [".json", ".csv"])
    check = check_workspace(machine)
    odd = oddities_where_checked(machine, check.codes)
    try:
        answers, warnings = _answers(request, machine, check)
    except TrueposeError:
        # It may be why there is no answer.
        show_oddities(odd, err=True)
        raise
    kept = met(answers, BEFORE) is not False
    with written_together():
        written = _steps.write_witness(request, answers, AFTER if kept else BEFORE)
        if request.output is not None:
            form = request.output.suffix.lower().removeprefix(".")
            with replacing(request.output) as temporary:
                text = _text(form, machine, check, odd, answers, warnings)
                temporary.write_text(text + "\n", encoding="utf-8")
    if request.format == "table":
        show_oddities(odd)
        show_answers(machine, answers)
        show_tables(_tables(machine, check, answers))
    else:
        click.echo(_text(request.format, machine, check, odd, answers, warnings))
    _steps.note_written(request.output, request.witness if written else None)
    if not written:
        raise _steps.no_witness(answers, AFTER if kept else BEFORE)
    return int(not kept)


def _answers(
    request: Request, machine: Machine, check: WorkspaceCheck
) -> tuple[tuple[Answer, ...], list[dict[str, str]]]:
    """The answers, and what the budget warns of.

    Raises `RequestError` (unusable-pose, no-pose-left), and `TrueposeError` of an error source.
    """
    from truepose.cli import _steps
    from truepose.errors import RequestError
    from truepose.reporting import inputs

    out = ~check.usable
    _steps.refuse_left_out(request, machine, out.nonzero()[0], check.poses[out], check.status[out])
    # Without a source the file may still be asked about its workspace, unless it asks for more.
    asked = machine.accuracy.target is not None or machine.accuracy.angle_target is not None
    if not (asked or any(inputs.acting(machine))):
        return (), []
    answers = _steps.answers_of(request, machine)
    try:
        return answers, _steps.evaluation(request, machine).warnings
    except RequestError as error:
        # There are poses, as there are answers; only no budget of what bands leave of them.
        if [problem.code for problem in error.problems] != ["no-pose-left"]:
            raise
        return answers, []


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


def _tables(machine: Machine, check: WorkspaceCheck, answers: tuple[Answer, ...]) -> list[Table]:
    from truepose.reporting import calibrated_files, inputs, tables, workspace_check
    from truepose.reporting.table import with_not_included
    from truepose.sources import not_included_text

    left_out = not_included_text(machine, machine.condition)
    made = calibrated_files.calibration(machine)
    shown = [
        inputs.machine(machine),
        *([] if made is None else [made]),
        inputs.condition(machine),
        with_not_included(inputs.sources(machine), left_out),
        inputs.deviations(machine),
        workspace_check.table(machine, check),
    ]
    return [*shown, tables.answers(machine, answers)] if answers else shown


def _text(
    form: str,
    machine: Machine,
    check: WorkspaceCheck,
    odd: tuple[Oddity, ...],
    answers: tuple[Answer, ...],
    warnings: list[dict[str, str]],
) -> str:
    """The answers as JSON, or as CSV one row an answer. File units, named."""
    import csv
    import io
    import json

    from truepose.reporting import inputs, workspace_check
    from truepose.reporting.accuracy import as_data
    from truepose.reporting.result import in_file_units, pose_si
    from truepose.sources import NO_MATERIAL, not_included, not_included_text

    rows = [as_data(machine, answer) for answer in answers]
    if form == "csv":
        buffer = io.StringIO()
        where = [
            f"pose_{name} [{in_file_units(machine, 0.0, pose_si(name))[1]}]"
            for name in machine.commanded
        ]
        columns = ["quantity", "state", "highest", "asked", "units", "met", "not_included"]
        columns += ["pose", "not_assembled", "answer", "witness", "linear", "bound", "rests_on"]
        left_out = not_included_text(machine, machine.condition)
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow([*columns, *where])
        for row in rows:
            told = row | {"not_included": left_out}
            writer.writerow([*(told[column] for column in columns), *row["at"].values()])
        return buffer.getvalue().rstrip("\n")
    return json.dumps(
        {
            "command": "check",
            "machine": inputs.machine_data(machine),
            "calibration": None
            if machine.calibration is None
            else machine.calibration.model_dump(),
            "sources": inputs.source_data(machine),
            "not_included": [
                {"part": part, "why": NO_MATERIAL}
                for part in not_included(machine, machine.condition)
            ],
            "oddities": [
                {"code": oddity.code, "sentence": oddity.sentence, "parts": list(oddity.parts)}
                for oddity in odd
            ],
            "workspace": workspace_check.as_data(machine, check),
            "answers": rows,
            "warnings": warnings,
        },
        indent=1,
        ensure_ascii=False,
        allow_nan=False,
    )
