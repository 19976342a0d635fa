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
)

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.report.accuracy import Answer
    from truepose.report.reach import Reach
    from truepose.report.tables import Table


@click.command("check")
@takes(
    machine_argument,
    set_option,
    format_option,
    output_option_of(".json or .csv"),
    strict_option,
)
def command(**options: Any) -> int:
    """Say what a machine file holds, and if it is accurate enough.

    Exit code 1 when the machine, commanded as it is, may exceed the accuracy asked; what
    compensation would leave is shown beside it.
    """
    from truepose.cli import _work
    from truepose.output import replacing
    from truepose.report import accuracy, inputs
    from truepose.report.reach import reach

    request = Request(**options)
    machine = _work.read_machine(request, [".json", ".csv"])
    found = reach(machine)
    out = ~found.usable
    _work.refuse_left_out(request, machine, out.nonzero()[0], found.poses[out], found.status[out])
    answers: tuple[Answer, ...] = ()
    # Without a source the file may still be asked about its workspace, unless it asks for more.
    asked = machine.accuracy.target is not None or machine.accuracy.angle_target is not None
    if asked or any(inputs.acting(machine)):
        answers = accuracy.answers(_work.study_of(request, machine))
    if request.format == "table":
        from truepose.cli._show import show_tables

        show_tables(_tables(machine, found, answers))
    else:
        click.echo(_text(request.format, machine, found, answers))
    if request.output is not None:
        form = request.output.suffix.lower().removeprefix(".")
        with replacing(request.output) as temporary:
            temporary.write_text(_text(form, machine, found, answers) + "\n", encoding="utf-8")
        _work.note_written(request.output)
    return int(accuracy.met(answers, accuracy.BEFORE) is False)


def _tables(machine: Machine, found: Reach, answers: tuple[Answer, ...]) -> list[Table]:
    from truepose.report import calibrated_files, inputs, reach, tables

    made = calibrated_files.calibration(machine)
    shown = [
        inputs.machine(machine),
        *([] if made is None else [made]),
        inputs.condition(machine),
        inputs.sources(machine),
        inputs.deviations(machine),
        reach.table(machine, found),
    ]
    return [*shown, tables.answers(answers)] if answers else shown


def _text(form: str, machine: Machine, found: Reach, answers: tuple[Answer, ...]) -> str:
    """The answers as JSON, or as CSV one row an answer. File units, named."""
    import csv
    import io
    import json

    from truepose.report import inputs, reach
    from truepose.report.result import in_file_units, pose_si

    rows = [answer.as_data(machine) for answer in answers]
    if form == "csv":
        buffer = io.StringIO()
        where = [
            f"pose_{name} [{in_file_units(machine, 0.0, pose_si(name))[1]}]"
            for name in machine.commanded
        ]
        columns = ["quantity", "state", "highest", "asked", "units", "met", "pose", "not_assembled"]
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow([*columns, *where])
        for row in rows:
            writer.writerow([*(row[column] for column in columns), *row["at"].values()])
        return buffer.getvalue().rstrip("\n")
    return json.dumps(
        {
            "command": "check",
            "machine": inputs.machine_data(machine),
            "calibration": None
            if machine.calibration is None
            else machine.calibration.model_dump(),
            "sources": inputs.source_data(machine),
            "workspace": reach.as_data(machine, found),
            "answers": rows,
        },
        indent=1,
        ensure_ascii=False,
        allow_nan=False,
    )
