"""`truepose compensate`: the corrected command, and what remains."""

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


@click.command("compensate")
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
    """Correct the command for what is known, and show what remains.

    The corrected joint coordinates of every pose are driven through the machine with all lengths
    at the lower ends, in the middle and at the upper ends of their tolerance bands. With
    --require-accuracy the exit code is 1 when it is not certain that the machine keeps the
    accuracy asked with corrected commands.
    """
    from truepose.cli import _steps
    from truepose.reporting import tables
    from truepose.reporting.result import Result
    from truepose.reporting.study import warnings_of
    from truepose.runs.controller_geometry import require_known_controller
    from truepose.verdict.answer import AFTER, met

    request = Request(**options)
    machine = _steps.read_machine(request)
    require_known_controller(machine)
    study = _steps.compared(request, machine)
    assert study.compensation is not None
    _steps.show_warnings(warnings_of(study.compensation))
    answers = study.accuracy
    _steps.deliver(
        request,
        Result("compensate", study.machine, study.compensation),
        [
            tables.compensation(study),
            tables.answers(study.machine, answers),
            tables.poses_left_out(study),
        ],
        answers,
        witness_of=AFTER,
    )
    return _steps.exit_code(request, met(answers, AFTER))
