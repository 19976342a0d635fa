"""`truepose shares`: which parameter and which source the spread comes from."""

from __future__ import annotations

from typing import Any

import click

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


@click.command("shares")
@takes(
    machine_argument,
    click.option(
        "--samples",
        type=WholeNumber(),
        metavar="N",
        help="Base samples at each pose; each needs an evaluation for every parameter and source.",
    ),
    seed_option,
    set_option,
    format_option,
    output_option,
    strict_option,
    verbose_option,
)
def command(samples: int | None, seed: int, **options: Any) -> int:
    """Say which parameters and sources the spread comes from.

    First-order and total Sobol indices of every parameter and source that is not known exactly,
    with their confidence, the linear shares beside them, and Shapley shares where parameters are
    correlated. The first row is the dimension to tighten first. The worst poses come first; Ctrl-C
    gives those done by then (exit code 130).
    """
    from truepose.cli import _steps, _uncertainty
    from truepose.reporting import variance_shares
    from truepose.reporting.result import Result

    request = Request(**options)
    machine = _steps.read_machine(request)
    result = _uncertainty.share(request, machine, samples=samples, seed=seed)
    _steps.deliver(
        request, Result("shares", machine, result), variance_shares.shares(machine, result)
    )
    return INTERRUPTED if result.attrs.get("interrupted") else 0
