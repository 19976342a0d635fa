"""`truepose over-time`: the error over a temperature log."""

from __future__ import annotations

from typing import Any

import click

from truepose.cli._options import (
    Request,
    format_option,
    machine_argument,
    output_option,
    set_option,
    strict_option,
    takes,
)
from truepose.cli._verbose import verbose_option


@click.command("over-time")
@takes(machine_argument, set_option, format_option, output_option, strict_option, verbose_option)
def command(**options: Any) -> int:
    """Follow the error through a temperature log.

    The machine file names the log (`[condition] temperature_log`). Shows the tool's error at the
    home pose at some moments; `--format csv` and `--output` have a row for every moment.
    """
    from truepose.cli import _steps
    from truepose.reporting import tables
    from truepose.reporting.result import Result

    request = Request(**options)
    machine = _steps.read_machine(request)
    result = _steps.over_time(request, machine)
    _steps.deliver(
        request, Result("over-time", machine, result), [tables.over_time(machine, result)]
    )
    return 0
