"""`truepose study`: many variants of one machine file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli import _complete
from truepose.cli._cluster import cluster_options
from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import (
    OutputFile,
    Request,
    WholeNumber,
    format_option,
    machine_argument,
    read_share,
    seed_option,
    set_option,
    takes,
)
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    import xarray as xr

    from truepose.studies.study import PreparedStudy, StudyCost


@click.command("study")
@takes(
    machine_argument,
    click.option(
        "--vary",
        "vary",
        metavar="KEY=VALUES",
        multiple=True,
        required=True,
        shell_complete=_complete.settings,
        help="Vary what --set can set: from:to:count with a unit, as in "
        '"strut.*.stiffness=30:120:4 N/um", or values, as in strut.*.material=steel,invar. A '
        "pattern is one variable; each:PATTERN varies what it names one by one. May be repeated.",
    ),
    click.option(
        "--design",
        metavar="NAME",
        default="factorial",
        show_default=True,
        help="Which variants: factorial (every combination), latin-hypercube or sobol (--count N "
        "of them, and from:to is enough).",
    ),
    click.option(
        "--count",
        type=WholeNumber(),
        metavar="N",
        help="How many variants, of a design that draws them.",
    ),
    seed_option,
    click.option(
        "--quantities",
        metavar="NAMES",
        help="What is computed of each variant: error, verdict, shares, coverage (slower), "
        "kinematics.  [default: error,verdict,shares]",
    ),
    click.option(
        "--reach",
        metavar="SHARE",
        default="100 %",
        show_default=True,
        help="Which share of the poses of the base file a variant must have; with less it is "
        "infeasible, and has no numbers.",
    ),
    click.option(
        "--conditioning",
        metavar="NUMBER",
        type=float,
        help="A variant whose conditioning (0 singular, 1 best) is less at a pose is infeasible.",
    ),
    click.option(
        "--travel-left",
        metavar="SHARE",
        help="A variant is infeasible if a drive has less of its travel left to either end at a "
        'pose, such as "5 %".',
    ),
    click.option(
        "--minimise",
        metavar="NAME",
        help="Let an optimiser draw the --count N variants that make a number small: error, known, "
        "coverage-before, coverage-after. Variables go from:to.",
    ),
    set_option,
    format_option,
    click.option(
        "--output",
        "-o",
        "output",
        metavar="STORE.zarr",
        type=OutputFile(".zarr"),
        help="Write the results into a store (Zarr 3), block by block. The same command goes on "
        "with one that is not finished.",
    ),
    *cluster_options,
    click.option(
        "--report",
        "report_file",
        metavar="FILE.html",
        type=OutputFile(".html"),
        help="Write a page with figures too: response curves, variants side by side, Pareto front.",
    ),
    click.option(
        "--dry-run",
        is_flag=True,
        help="Say how many variants there are, how long they take (measured on a few) and how "
        "large the store is, and write nothing.",
    ),
    verbose_option,
)
def command(
    vary: tuple[str, ...],
    design: str,
    count: int | None,
    seed: int,
    quantities: str | None,
    reach: str,
    conditioning: float | None,
    travel_left: str | None,
    minimise: str | None,
    workers: int | None,
    scheduler: str | None,
    tls: Path | None,
    dry_run: bool,
    report_file: Path | None,
    **options: Any,
) -> int:
    """Evaluate many variants of a machine file.

    Every variant is the file with some settings, at the poses of the file itself: one that has
    fewer of them is infeasible. Each number is that of the other commands on the file so set. What
    is done stands in the store; after Ctrl-C (exit code 130), or however the program ended, the
    same command goes on.
    """
    from truepose.cli._cluster import telling
    from truepose.cli._progress import progress, waiting
    from truepose.cli._steps import note_written
    from truepose.cli._verbose import say_machine, say_result
    from truepose.cluster.options import requested_cluster
    from truepose.files.wording import counted
    from truepose.studies import study as studies
    from truepose.studies.evaluators import evaluator_of
    from truepose.studies.quantities import QUICK_NAMES

    cluster = requested_cluster(workers, scheduler, tls)
    request = Request(**options)
    output = request.output
    if (output is None) is not dry_run:
        raise click.UsageError(
            "give either --output STORE.zarr, or --dry-run to know what it takes"
        )
    if output is not None:
        studies.require_store(output)
    page = None if report_file is None else _page(report_file, request.machine_file, dry_run)
    names = QUICK_NAMES if quantities is None else [one.strip() for one in quantities.split(",")]
    with waiting("machine file, and values tried on it"):
        prepared = studies.prepare(
            request.machine_file,
            vary,
            design=design,
            count=count,
            seed=seed,
            settings=request.settings,
            quantities=names,
            reach=read_share(
                "--reach",
                reach,
                code="bad-reach",
                expected='a share of the poses, such as "98 %" or 0.98',
            ),
            conditioning=conditioning,
            travel_left=None
            if travel_left is None
            else read_share(
                "--travel-left",
                travel_left,
                code="bad-constraint",
                expected='a share of the travel, such as "5 %" or 0.05',
            ),
            minimise=minimise,
        )
        say_machine(prepared.machine)
    if output is None:
        with waiting("a few variants"):
            cost = studies.estimated(prepared)
        _show_cost(prepared, cost, request.format)
        return 0

    def going_on(done: int, total: int) -> None:
        click.echo(
            f"{output}: {done:,} of {counted(total, 'variant')} are done, going on", err=True
        )

    with telling(), evaluator_of(cluster) as evaluator, progress("study", "variants") as report:
        result = studies.run(
            prepared, output, evaluator=evaluator, progress=report, going_on=going_on
        )
    say_result(result)
    done, total = int(result["done"].sum()), result.sizes["variant"]
    if result.attrs["interrupted"]:
        click.echo(
            f"Interrupted: {done:,} of {counted(total, 'variant')} stand in {output}; "
            "the same command goes on.",
            err=True,
        )
        return INTERRUPTED
    _show(prepared, result, request.format)
    note_written(output)
    if page is not None and report_file is not None:
        page.write(prepared.machine, result, report_file)
        note_written(report_file)
    return 0


def _page(path: Path, machine_file: Path, dry_run: bool) -> Any:
    """The module that writes the page, before any work."""
    from truepose.files.writing import require_writable
    from truepose.reporting.drawing_packages import module_that_draws

    if dry_run:
        raise click.UsageError("--dry-run writes nothing: leave out --report")
    require_writable(path, (".html",), [machine_file])
    return module_that_draws("truepose.reporting.variants_page")


def _show(prepared: PreparedStudy, result: xr.Dataset, form: str) -> None:
    import sys

    from truepose.cli._show import show_tables
    from truepose.reporting import variants

    if form == "table":
        show_tables(variants.tables(prepared.machine, result))
    elif form == "csv":
        sys.stdout.writelines(variants.csv_text(prepared.machine, result))
    else:
        from truepose.reporting.formats import json_text
        from truepose.reporting.result import Result

        sys.stdout.writelines(json_text.text(Result("study", prepared.machine, result)))


def _show_cost(prepared: PreparedStudy, cost: StudyCost, form: str) -> None:
    """How many, how long and how large, as text, JSON or CSV."""
    from truepose.cli._progress import clock
    from truepose.files.wording import counted

    told = {
        "variants": cost.variants,
        "variables": len(prepared.varied),
        "poses": len(prepared.machine.poses()),
        "seconds": round(cost.seconds, 3),
        "bytes": cost.size,
        "files": cost.files,
        "measured": cost.measured,
    }
    if form == "json":
        click.echo(json.dumps({"command": "study", "dry_run": told}, indent=1))
    elif form == "csv":
        click.echo(",".join(told))
        click.echo(",".join(map(str, told.values())))
    else:
        variables = counted(len(prepared.varied), "variable")
        poses = counted(len(prepared.machine.poses()), "pose")
        click.echo(f"{counted(cost.variants, 'variant')} of {variables}, each at {poses}")
        click.echo(
            f"about {clock(cost.seconds)} on this computer, by "
            f"{counted(cost.measured, 'variant')} that were evaluated"
        )
        click.echo(f"a store of about {cost.size / 1e6:.1f} MB in {counted(cost.files, 'file')}")
