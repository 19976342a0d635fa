"""`truepose budget`: the error of each source and of all together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli._cluster import cluster_options, telling
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

if TYPE_CHECKING:
    from truepose.cluster.options import ClusterOptions


@click.command("budget")
@takes(
    machine_argument,
    set_option,
    format_option,
    output_option,
    strict_option,
    accuracy_option,
    witness_option,
    click.option(
        "--summary",
        is_flag=True,
        help="Only what is highest over all poses, where, and how the sources compare, of any "
        "number of poses; no verdict.",
    ),
    *cluster_options,
    verbose_option,
)
def command(
    summary: bool,
    workers: int | None,
    scheduler: str | None,
    tls: Path | None,
    **options: Any,
) -> int:
    """Predict the error from each source, and compare them.

    Every pose of the workspace is evaluated exactly: the nominal command driven through the
    machine as each source makes it, and as all together make it. With --require-accuracy the
    exit code is 1 when it is not certain that the machine, commanded as it is, keeps the accuracy
    asked.

    With --summary no row of a pose is kept, so that a grid may have 1e10 poses, and other
    processes may share the work.
    """
    from truepose.cli import _steps
    from truepose.cluster.options import requested_cluster
    from truepose.reporting import tables
    from truepose.reporting.result import Result
    from truepose.reporting.study import Study
    from truepose.verdict.answer import BEFORE, met

    request = Request(**options)
    cluster = requested_cluster(workers, scheduler, tls)
    if summary:
        return _summarise(request, cluster)
    if cluster is not None:
        raise click.UsageError("Workers evaluate a summary: give --summary too.")
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


def _summarise(request: Request, cluster: ClusterOptions | None) -> int:
    """The summary, of which no pose is kept; nothing is judged by it."""
    from truepose.cli import _steps
    from truepose.cli._progress import progress
    from truepose.cluster.evaluator import evaluator_of
    from truepose.error_budget.summary import summary as summary_of
    from truepose.reporting import summary_tables, tables
    from truepose.reporting.result import Result
    from truepose.reporting.study import Study, warnings_of

    if request.require_accuracy or request.witness is not None:
        raise click.UsageError(
            "A summary judges no machine: --require-accuracy and --witness go without --summary."
        )
    machine = _steps.read_machine(request)
    with telling(), evaluator_of(cluster) as evaluator, progress("error budget") as report:
        summary = summary_of(machine, None, None, report, evaluator)
    _steps.show_warnings(warnings_of(summary))
    if request.strict:
        summary_tables.refuse_left_out(machine, summary)
    study = Study(machine, summary)
    _steps.deliver(
        request,
        Result("budget", machine, summary),
        [
            tables.ranking(study),
            summary_tables.highest_at(study),
            tables.highest_absolute(study),
            tables.highest_percent(study),
            summary_tables.left_out_counts(study),
        ],
    )
    return 0
