"""`truepose budget`: the error of each source and of all together."""

from __future__ import annotations

from typing import Any

import click

from truepose.cli._options import (
    Request,
    accuracy_option,
    format_option,
    machine_argument,
    output_option,
    set_option,
    strict_option,
    takes,
    witness_option,
)
from truepose.cli._verbose import verbose_option


@click.command("budget")
@takes(
    machine_argument,
    set_option,
    format_option,
    output_option,
    strict_option,
    accuracy_option,
    witness_option,
    verbose_option,
)
def command(**options: Any) -> int:
    """Predict the error from each source, and compare them.

    Every pose of the workspace is evaluated exactly: the nominal command driven through the
    machine as each source makes it, and as all together make it. With --require-accuracy the
    exit code is 1 when it is not certain that the machine, commanded as it is, keeps the accuracy
    asked.
    """
    from truepose.cli import _steps
    from truepose.reporting import tables
    from truepose.reporting.result import Result
    from truepose.reporting.study import Study
    from truepose.verdict.answer import BEFORE, met

    request = Request(**options)
    machine = _steps.read_machine(request)
    study = Study(machine, _steps.evaluate(request, machine))
    answers = _steps.answers_of(request, machine, BEFORE)
    _steps.deliver(
        request,
        Result("budget", machine, study.budget),
        [
            tables.ranking(study),
            tables.highest_absolute(study),
            tables.highest_percent(study),
            tables.answers(machine, answers),
            tables.poses_left_out(study),
        ],
        answers,
    )
    return _steps.exit_code(request, met(answers, BEFORE))
