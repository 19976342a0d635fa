"""`truepose strain`: internal forces of an over-constrained machine."""

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


@click.command("strain")
@takes(machine_argument, set_option, format_option, output_option, strict_option, verbose_option)
def command(**options: Any) -> int:
    """Find the internal forces of an over-constrained machine.

    With more closures than freedoms not every error moves the platform: what does not fit is
    taken up by the joints' clearances, or strains the parts. Shows the internal forces from each
    source alone and from all together under load, with the clearances as dead zones.
    """
    from truepose.cli import _steps
    from truepose.reporting import tables
    from truepose.reporting.result import Result
    from truepose.reporting.study import Study

    request = Request(**options)
    machine = _steps.read_machine(request)
    result = _steps.strain(request, machine)
    study = Study(machine, result, strain=result)  # of its first result only the poses are read
    _steps.deliver(
        request,
        Result("strain", machine, result),
        [*tables.strain(study), tables.poses_left_out(study)],
    )
    return 0
