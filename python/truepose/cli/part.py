"""`truepose part`: will the workpiece be good?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from truepose.cli._cluster import cluster_options
from truepose.cli._machine_test import check_options, test_options
from truepose.cli._machine_test import run as run_test
from truepose.cli._options import (
    InputFile,
    OutputFile,
    WholeNumber,
    format_option,
    machine_argument,
    output_option_of,
    seed_option,
    set_option,
    takes,
)
from truepose.cli._program import program_options
from truepose.cli._verbose import verbose_option


@click.command("part")
@takes(
    machine_argument,
    click.argument("program", metavar="PART.ngc", type=InputFile(".ngc"), required=False),
    click.option(
        "--features",
        metavar="FILE.toml",
        type=InputFile(".toml"),
        help="Walls, bores and faces with their tolerances. Default: what comments of the program "
        "say, (feature: ...).",
    ),
    click.option(
        "--propose-features",
        is_flag=True,
        help="Look for circles, pairs of walls and faces in the program, and write them as a "
        "features file to edit, to --output FILE.toml, else to stdout. Nothing else is done.",
    ),
    click.option(
        "--rule",
        type=click.Choice(["worst-case", "iso-14253"]),
        default="worst-case",
        show_default=True,
        help="worst-case: all machines inside the bands keep the limits; iso-14253: the coverage "
        "interval does (ISO 14253-1).",
    ),
    click.option(
        "--after",
        is_flag=True,
        help="The exit code is for the part after compensation, not as commanded.",
    ),
    click.option(
        "--samples",
        type=WholeNumber(),
        metavar="N",
        help="Machines that are drawn; each makes the whole part. By default 4000, of a test 2000.",
    ),
    click.option(
        "--probability",
        type=float,
        metavar="P",
        default=0.95,
        show_default=True,
        help="Coverage probability of the intervals.",
    ),
    click.option(
        "--exact",
        is_flag=True,
        help="Solve every sample exactly, also where first order is enough.",
    ),
    seed_option,
    click.option(
        "--points",
        metavar="FILE.csv",
        type=OutputFile(".csv"),
        help="Also write the known error at every point of the path.",
    ),
    click.option(
        "--witness",
        metavar="FILE.toml",
        type=OutputFile(".toml"),
        help="Where a feature is NOT met as commanded: write the machine that breaks it, and "
        "beside it FILE.csv where something varies along the way.",
    ),
    click.option(
        "--along",
        metavar="FILE.csv",
        type=InputFile(".csv"),
        help="Of a witness: what varies along the way. The part of that one machine is told.",
    ),
    *program_options,
    *test_options,
    *cluster_options,
    set_option,
    format_option,
    output_option_of(".json, .csv, .nc (NetCDF, SI) or .html"),
    verbose_option,
)
def command(
    machine_file: Path,
    program: Path | None,
    *,
    propose_features: bool,
    output: Path | None,
    **given: Any,
) -> int:
    """Say whether a part will be within its tolerances.

    A machine that is drawn makes the whole part: what all points share moves it and leaves its
    sizes as they are. Every toleranced quantity gets its known error, what remains after
    compensation, the 95 % interval, the worst case from below and from above, and a verdict.
    Exit code 1 where a feature is NOT met. What the process adds is not in it. With --test there is
    no program: an acceptance test of the machine is predicted, and compared with what was measured.
    """
    check_options(test=given["test"] is not None)
    if given["test"] is not None:
        return run_test(machine_file, output, given)
    if program is None:
        raise click.UsageError("Missing argument 'PART.ngc', or --test.")
    from truepose.cli import _part
    from truepose.workpiece.evaluate import SAMPLES

    if given["samples"] is None:
        given["samples"] = SAMPLES

    if propose_features:
        return _part.propose(machine_file, program, output, given)
    return _part.evaluate(machine_file, program, output, given)
