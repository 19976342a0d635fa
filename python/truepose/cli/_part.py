"""What `truepose part` does, behind its options."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli._cluster import telling
from truepose.cli._program import Quantities
from truepose.cli._progress import progress
from truepose.cli._show import show_lines, show_tables
from truepose.cli._steps import load_machine, note_written
from truepose.cli._verbose import say, say_file
from truepose.cluster.evaluator import evaluator_of
from truepose.cluster.options import requested_cluster
from truepose.errors import Problem, RequestError
from truepose.files.writing import replacing, require_writable, written_together
from truepose.reporting import part as shown
from truepose.uncertainty_analysis.arguments import required_probability, required_samples
from truepose.verdict.states import AFTER, BEFORE
from truepose.workpiece.along_file import read_along
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.evaluation import NOT_MET, PartEvaluation
from truepose.workpiece.points_file import PointsFile
from truepose.workpiece.read import read_part
from truepose.workpiece.witness import first_broken, write_part_witness

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.workpiece.along import Sink
    from truepose.workpiece.read import Part

ENDINGS = (".json", ".csv", ".nc", ".html")


def evaluate(machine_file: Path, program: Path, output: Path | None, given: dict[str, Any]) -> int:
    """Evaluate the part and show it -> exit code."""
    features, points, witness = given["features"], given["points"], given["witness"]
    inputs = [path for path in (machine_file, program, features, given["along"]) if path]
    if output is not None:
        require_writable(output, ENDINGS, inputs)
    if points is not None:
        require_writable(points, [".csv"], inputs)
    if witness is not None:
        require_writable(witness, [".toml"], inputs)
        require_writable(witness.with_suffix(".csv"), [".csv"], inputs)
    machine = load_machine(machine_file, given["settings"])
    cluster = requested_cluster(given["workers"], given["scheduler"], given["tls"])
    asked = _read(machine, program, features, given)
    page = _page() if output is not None and output.suffix.lower() == ".html" else None
    with written_together(), ExitStack() as files:
        sinks: list[Sink] = []
        if points is not None:
            file = files.enter_context(
                files.enter_context(replacing(points)).open("w", encoding="utf-8", newline="")
            )
            sinks.append(PointsFile(machine, file))
        if page is not None:
            sinks.append(picture := page.DrawnPath(machine))
        with (
            telling(),
            evaluator_of(cluster) as evaluator,
            progress("part", "samples") as report,
        ):
            evaluation = evaluate_part(
                machine,
                asked,
                machine.condition,
                samples=required_samples(given["samples"], 2),
                seed=given["seed"],
                probability=required_probability(given["probability"]),
                rule=given["rule"],
                exact=True if given["exact"] else None,
                along=None
                if given["along"] is None
                else lambda state: read_along(given["along"], state),
                sinks=sinks,
                evaluator=evaluator,
                progress=report,
            )
        say_file(program)
        say(f"{evaluation.walked.points:,} points of the path")
        if page is not None and output is not None:
            with replacing(output) as temporary:
                temporary.write_text(page.html(evaluation, picture, program.name), encoding="utf-8")
        elif output is not None:
            _write(evaluation, output)
        at = first_broken(evaluation) if witness is not None else None
        written: tuple[Path, ...] = ()
        if witness is not None and at is not None:
            written = write_part_witness(
                evaluation, at, witness, witness.with_suffix(".csv"), machine_file
            )
    _show(evaluation, given["format"])
    note_written(output, points, *written)
    if witness is not None and at is None:
        raise _no_witness(evaluation)
    states = {one.state.name: one for one in evaluation.states}
    judged = states.get(AFTER if given["after"] else BEFORE, evaluation.states[0])
    return int(any(answer.verdict == NOT_MET for answer in judged.answers))


def propose(machine_file: Path, program: Path, output: Path | None, given: dict[str, Any]) -> int:
    """Write the features that are found in the program."""
    from truepose.workpiece.propose import propose_features

    if output is not None:
        require_writable(output, [".toml"], [machine_file, program])
    machine = load_machine(machine_file, given["settings"])
    text = propose_features(machine, program, _options(machine, given))
    if output is None:
        click.echo(text, nl=False)
        return 0
    with replacing(output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    note_written(output)
    return 0


def _read(machine: Machine, program: Path, features: Path | None, given: dict[str, Any]) -> Part:
    return read_part(machine, program, features, _options(machine, given))


def _options(machine: Machine, given: dict[str, Any]) -> Any:
    names = ("units", "start", "offsets", "parameter_file", "block_delete")
    return Quantities(machine).program(*(given[name] for name in names))


def _page() -> Any:
    """The module that draws the page. Raises `RequestError` (extra-missing) without plotly."""
    from truepose.reporting.drawing_packages import module_that_draws

    return module_that_draws("truepose.reporting.part_page")


def _write(evaluation: PartEvaluation, output: Path) -> None:
    form = output.suffix.lower()
    with replacing(output) as temporary:
        if form == ".nc":
            from truepose.reporting.formats import netcdf
            from truepose.reporting.result import Result
            from truepose.workpiece.result import dataset

            netcdf.write(Result("part", evaluation.machine, dataset(evaluation)), temporary)
            return
        text = shown.csv_text(evaluation) if form == ".csv" else shown.json_text(evaluation) + "\n"
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _show(evaluation: PartEvaluation, form: str) -> None:
    if form == "csv":
        sys.stdout.write(shown.csv_text(evaluation))
    elif form == "json":
        click.echo(shown.json_text(evaluation))
    else:
        lines = shown.summary(evaluation)
        show_lines([(line.word, line.colour, line.text) for line in lines])
        show_tables(shown.tables(evaluation))


def _no_witness(evaluation: PartEvaluation) -> RequestError:
    words = [
        f"{of.label}: {answer.verdict}"
        for of, answer in zip(evaluation.characteristics, evaluation.before().answers, strict=True)
    ]
    return RequestError(
        Problem(
            "no-witness",
            "there is no witness to write",
            found=f"{BEFORE}: {', '.join(words)}",
            expected="a feature that is NOT met as commanded: the machine that breaks it is the "
            "witness",
        )
    )
