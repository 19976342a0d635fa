"""`truepose report`: everything on one page."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import click

from truepose.cli._options import (
    InputFile,
    OutputFile,
    Request,
    accuracy_option,
    language_option,
    machine_argument,
    set_option,
    strict_option,
    takes,
)
from truepose.cli._verbose import verbose_option


@click.command("report")
@takes(
    machine_argument,
    set_option,
    click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE",
        type=OutputFile(".html", ".pdf"),
        help="Where the page goes; its ending chooses the form: .html, or .pdf where a browser is "
        "installed that prints it. By default beside you, named after the machine file (of "
        "standard input, report.html).",
    ),
    click.option(
        "--paper",
        type=click.Choice(["A4", "Letter"], case_sensitive=False),
        help="The paper of a .pdf. Default: A4.",
    ),
    click.option(
        "--measurements",
        metavar="FILE.csv",
        type=InputFile(".csv"),
        help="Measurements of the machine: the page then begins with a calibration, with the "
        "defaults of `truepose calibrate`.",
    ),
    click.option(
        "--part",
        metavar="PART.ngc",
        type=InputFile(".ngc"),
        help="A program: the page also has what the machine makes of its part, with the defaults "
        "of `truepose part`.",
    ),
    click.option(
        "--features",
        metavar="FILE.toml",
        type=InputFile(".toml"),
        help="Features of the part. Default: what comments of the program say.",
    ),
    click.option(
        "--figure-data",
        "figure_data",
        metavar="FOLDER",
        type=OutputFile(),
        help="Write what every figure draws, and every table, as CSV into FOLDER, which is made "
        "where it is not there: figure-3-workspace_maps.csv, by the numbers on the page.",
    ),
    language_option,
    strict_option,
    accuracy_option,
    verbose_option,
)
def command(**options: Any) -> int:
    """Do all of it, and write one HTML page.

    Evaluates, compares and compensates, samples, bounds and shares out the error at two poses,
    prints the tables, and writes the page, which opens from disk without a network, or prints it.
    With --require-accuracy the exit code is 1 when it is not certain that the accuracy asked is
    kept after compensation.
    """
    from truepose.reporting.drawing_packages import speaking_for

    with speaking_for(options.pop("language")):
        return _report(options)


def _report(options: dict[str, Any]) -> int:
    from truepose.cli import _steps
    from truepose.cli._show import show_answers, show_lines, show_tables
    from truepose.cli._verbose import say_result
    from truepose.files.one_run import is_stdin
    from truepose.files.writing import require_own_folder, require_writable, written_together
    from truepose.reporting import figure_data
    from truepose.reporting.drawing_packages import module_that_draws
    from truepose.reporting.report import ENDINGS, is_pdf, made, write_page
    from truepose.verdict.answer import AFTER

    if options["output"] is None:
        file = options["machine_file"]
        options["output"] = Path("report.html" if is_stdin(file) else file.stem + ".html")
    measurements: Path | None = options.pop("measurements")
    program: Path | None = options.pop("part")
    features: Path | None = options.pop("features")
    if features is not None and program is None:
        raise click.UsageError("--features goes with --part.")
    paper: str | None = options.pop("paper")
    if paper is not None and options["output"].suffix.lower() != ".pdf":
        raise click.UsageError("--paper goes with --output FILE.pdf.")
    data_folder: Path | None = options.pop("figure_data")
    request = Request(**options)
    assert request.output is not None
    module_that_draws("truepose.reporting.page")
    beside = [path for path in (measurements, program, features) if path is not None]
    if beside:
        require_writable(request.output, ENDINGS, [request.machine_file, *beside])
    machine = _steps.read_machine(request, ENDINGS)
    browser = _browser() if is_pdf(request.output) else None
    if data_folder is not None:
        require_own_folder(data_folder, figure_data.is_data_file, "--figure-data")
    text, watching = _steps.machine_text(request), _steps.Watching(request)
    report = made(machine, measurements, program, features, text, watching)
    say_result(report.study.budget)
    shown_page, contents = report.rendered(live=browser is None)
    data = {}
    if data_folder is not None:
        data = figure_data.data_files(contents.drawn.values(), contents.tables)
    with written_together():
        with _writing(request.output, browser):
            write_page(shown_page, request.output, paper or "A4", browser)
        if data_folder is not None:
            figure_data.write_data(data_folder, data)
    if data_folder is not None:
        figure_data.remove_others(data_folder, data)
    show_answers(machine, report.answers)
    show_lines((name, "", text) for name, text in report.lines)
    show_tables(report.tables)
    _steps.note_written(request.output, *([] if data_folder is None else [data_folder]))
    return _steps.exit_code(request, report.met[AFTER])


def _browser() -> str:
    """The browser that prints. Raises `RequestError` (no-browser) before any work is done."""
    from truepose.reporting import pdf

    browser = pdf.installed_browser()
    if pdf.unprotected():
        click.echo(f"as root {browser} runs without its sandbox (--no-sandbox)", err=True)
    return browser


def _writing(output: Path, browser: str | None) -> AbstractContextManager[None]:
    """The step in which a page is written, or printed by a browser."""
    from truepose.cli._progress import waiting
    from truepose.cli._verbose import step

    if browser is None:
        return step(f"{output} written")
    return waiting(f"{output} printed by {browser}")
