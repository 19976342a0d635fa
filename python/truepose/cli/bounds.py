"""`truepose bounds`: what the error is proven not to exceed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from truepose.cli import _complete
from truepose.cli._cluster import cluster_options
from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import (
    FileName,
    Request,
    accuracy_option,
    format_option,
    machine_argument,
    output_option,
    set_option,
    strict_option,
    takes,
)
from truepose.cli._verbose import verbose_option


@click.command("bounds")
@takes(
    machine_argument,
    click.option(
        "--region",
        metavar="ENDS",
        shell_complete=_complete.freedoms,
        help="Every pose in this part of the workspace instead of the file's poses: "
        '"x=200:400,y=100:300", in the units of the machine file.',
    ),
    click.option(
        "--gap",
        type=float,
        metavar="SHARE",
        help="Over a region: by which share the bound may exceed an error that is "
        "reached.  [default: 0.05]",
    ),
    click.option(
        "--truncate",
        type=float,
        metavar="K",
        help="Take a distribution without ends, such as a normal one, to end at K standard "
        "deviations.  [default: its stated k sigma]",
    ),
    click.option(
        "--resume",
        metavar="FILE.nc",
        type=FileName(".nc"),
        help="Over a region: go on from the result that an interrupted search, or one that ran "
        "out of boxes, wrote with --output.",
    ),
    set_option,
    format_option,
    output_option,
    strict_option,
    accuracy_option,
    *cluster_options,
    verbose_option,
)
def command(
    region: str | None,
    gap: float | None,
    truncate: float | None,
    resume: Path | None,
    workers: int | None,
    scheduler: str | None,
    tls: Path | None,
    **options: Any,
) -> int:
    """Prove what the error cannot exceed.

    Encloses the error of every machine inside the bands, by interval arithmetic with rounding
    included, and proves that each has exactly one pose near the commanded one. Where there is no
    proof it says so. Ctrl-C gives what is proven by then: the worst poses, or bounds over the whole
    region that are not as close yet; --resume goes on. With --require-accuracy the exit code is 1
    when it is not proven that the accuracy asked is kept.
    """
    from truepose.cli import _steps, _uncertainty
    from truepose.cluster.options import requested_cluster
    from truepose.reporting import uncertainty_tables
    from truepose.reporting.result import Result
    from truepose.verdict.answer import BEFORE, met

    request = Request(**options)
    cluster = {"workers": workers, "scheduler": scheduler, "tls": tls}
    requested_cluster(workers, scheduler, tls)
    if region is not None and any(each is not None for each in cluster.values()):
        raise click.UsageError("A region is one search: workers are for the file's poses.")
    machine = _steps.read_machine(request)
    proven = _uncertainty.bound(
        request, machine, region, gap=gap, truncate=truncate, resume=resume, **cluster
    )
    result, tables = Result("bounds", machine, proven), uncertainty_tables.bounds(machine, proven)
    if proven.attrs.get("interrupted"):
        _steps.deliver(request, result, tables)
        return INTERRUPTED
    if region is None and truncate is None:
        answers = _steps.answers_of(request, machine, BEFORE)
        _steps.deliver(request, result, tables, answers)
        return _steps.exit_code(request, met(answers, BEFORE))
    # Another set of machines or of poses than the verdict is on: what is proven of that.
    _steps.deliver(request, result, tables)
    if region is not None and request.format == "table":
        click.echo(uncertainty_tables.sentence(machine, proven))
        for said in uncertainty_tables.against_target(machine, proven):
            click.echo(said)
    return _steps.exit_code(request, _uncertainty.keeps_accuracy(machine, proven))
