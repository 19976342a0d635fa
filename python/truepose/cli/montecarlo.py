"""`truepose montecarlo`: the error of random machines, with its coverage interval."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from truepose.cli._cluster import cluster_options
from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import (
    Request,
    WholeNumber,
    format_option,
    machine_argument,
    output_option,
    seed_option,
    set_option,
    strict_option,
    takes,
)
from truepose.cli._verbose import verbose_option


@click.command("montecarlo")
@takes(
    machine_argument,
    click.option(
        "--samples",
        type=WholeNumber(),
        metavar="N",
        help="How many samples at each pose; by default as many as make the standard deviation "
        "stable (JCGM 101, 7.9).",
    ),
    click.option(
        "--digits",
        type=click.IntRange(1, 2),
        default=1,
        show_default=True,
        help="Digits of the standard deviation that are to be stable, where N is not given.",
    ),
    click.option(
        "--probability",
        type=float,
        metavar="P",
        default=0.95,
        show_default=True,
        help="Coverage probability of the intervals.",
    ),
    seed_option,
    click.option(
        "--sampling",
        type=click.Choice(["random", "sobol"]),
        default="random",
        show_default=True,
        help="Random numbers, or scrambled Sobol points, which fill the bands more evenly and want "
        "N to be a power of two.",
    ),
    set_option,
    format_option,
    output_option,
    strict_option,
    *cluster_options,
    verbose_option,
)
def command(
    samples: int | None,
    digits: int,
    probability: float,
    seed: int,
    sampling: str,
    workers: int | None,
    scheduler: str | None,
    tls: Path | None,
    **options: Any,
) -> int:
    """Sample the error of machines within their tolerances.

    Draws what is not known of the machine from its distributions and solves each machine
    exactly: mean, standard deviation and coverage interval of the error at every pose of the
    workspace. Ctrl-C stops the drawing and gives the result so far (exit code 130).
    """
    from truepose.cli import _steps, _uncertainty
    from truepose.cluster.options import requested_cluster
    from truepose.reporting import uncertainty_tables
    from truepose.reporting.result import Result

    request = Request(**options)
    requested_cluster(workers, scheduler, tls)
    machine = _steps.read_machine(request)
    result = _uncertainty.sample(
        request,
        machine,
        samples=samples,
        digits=digits,
        probability=probability,
        seed=seed,
        sampling=sampling,
        workers=workers,
        scheduler=scheduler,
        tls=tls,
    )
    _steps.deliver(
        request, Result("montecarlo", machine, result), uncertainty_tables.sampled(machine, result)
    )
    return INTERRUPTED if result.attrs["interrupted"] else 0
