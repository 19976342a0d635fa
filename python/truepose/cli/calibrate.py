"""`truepose calibrate`: the machine from measurements of it, or why not."""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli import _complete
from truepose.cli._options import (
    InputFile,
    OutputFile,
    Request,
    format_option,
    machine_argument,
    output_option,
    seed_option,
    set_option,
    takes,
)
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    from truepose.calibration.calibrate import Calibration
    from truepose.machine import Machine
    from truepose.machine.tables.controller import Holds
    from truepose.reporting.result import Result


class _Day(click.ParamType):  # type: ignore[type-arg]
    """A day, YYYY-MM-DD."""

    name = "day"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The text as it is; click's usage error for what is no day."""
        try:
            return dt.date.fromisoformat(str(value)).isoformat()
        except ValueError:
            self.fail(f"{value!r} is not a day, such as 2025-03-31.", param, ctx)


@click.command("calibrate")
@takes(
    machine_argument,
    click.argument("data", metavar="MEASUREMENTS.csv", type=InputFile(".csv")),
    click.option(
        "--identify",
        metavar="PATTERN[=BAND]",
        multiple=True,
        shell_complete=_complete.unknowns,
        help="What is to be found: a parameter, a group of tolerances, a pattern such as "
        "'strut.*.length', strut.1.expansion; with a half band of its own as in "
        "'strut.*.length=0.5 mm'. May be repeated. Default: all that has a tolerance.",
    ),
    click.option(
        "--no-prior",
        is_flag=True,
        help="The measurements alone decide; tolerances do not count as knowledge.",
    ),
    click.option(
        "--no-robust",
        is_flag=True,
        help="Readings beyond three standard uncertainties keep their full weight.",
    ),
    click.option(
        "--folds",
        type=click.IntRange(2),
        default=5,
        show_default=True,
        help="Into how many parts the rows are divided, each predicted by the others, where the "
        "file keeps none from the fit.",
    ),
    seed_option,
    click.option(
        "--margin",
        type=click.FloatRange(0.0, 1.0, min_open=True),
        default=0.8,
        show_default=True,
        help="What is left of the tool's uncertainty must be less than this share.",
    ),
    click.option(
        "--machine-output",
        metavar="CALIBRATED.toml",
        type=OutputFile(".toml"),
        help="Write the calibrated machine file; needs --date.",
    ),
    click.option("--date", type=_Day(), metavar="YYYY-MM-DD", help="The day of the measurements."),
    click.option(
        "--controller-holds",
        type=click.Choice(["drawing", "calibrated"]),
        help="What the calibrated file is for: a controller that was not touched, whose nominal "
        "values stay, with what was found as known deviations from them, the default; or one into "
        "which the geometry found is loaded, which is nominal then.",
    ),
    click.option(
        "--as-shifts",
        is_flag=True,
        help="The former word for --controller-holds drawing. It warns.",
    ),
    click.option(
        "--force",
        is_flag=True,
        help="Write the file though the answer is no, with the warning inside; exit code 0.",
    ),
    click.option(
        "--report",
        metavar="PAGE.html",
        type=OutputFile(".html"),
        help="Write a page with the calibration's figures and tables too.",
    ),
    set_option,
    format_option,
    output_option,
    verbose_option,
)
def command(**options: Any) -> int:
    """Find the machine's parameters from measurements of it.

    May the result be used? Exit code 0: yes. Exit code 1: no, with the reasons and the cheapest
    measurement that would help; no machine file is written then. Tolerances are what is known
    beforehand. Every parameter found comes with its uncertainty, the share of it that the
    measurements determine, and what it leaves uncertain at the tool over the whole workspace.
    """
    asked = _Options(options)
    asked.check()
    from dataclasses import replace

    from truepose.calibration.calibrate import calibrate
    from truepose.cli import _steps
    from truepose.cli._progress import waiting
    from truepose.errors import TrueposeError
    from truepose.files.writing import require_writable
    from truepose.reporting.drawing_packages import module_that_draws
    from truepose.reporting.result import Result
    from truepose.runs.controller_geometry import require_known_controller

    request = asked.request
    if asked.page is not None:
        module_that_draws("truepose.reporting.page")
    inputs = [request.machine_file, asked.data]
    for path, endings in ((asked.machine_output, [".toml"]), (asked.page, [".html"])):
        if path is not None:
            require_writable(path, endings, inputs)
    if request.output is not None:
        require_writable(request.output, [".nc", ".json", ".csv"], inputs)
    machine = _steps.read_machine(request)
    if asked.machine_output is not None and asked.controller_holds != "calibrated":
        require_known_controller(machine)
    if asked.as_shifts:
        click.echo(
            "Warning: --as-shifts goes: --controller-holds drawing is what it says, and the "
            "default.",
            err=True,
        )
    with waiting("calibration"):
        calibration = calibrate(
            machine,
            asked.data,
            identify=options["identify"],
            use_prior=not options["no_prior"],
            robust=not options["no_robust"],
            folds=options["folds"],
            seed=options["seed"],
            margin=options["margin"],
        )
        dataset = calibration.dataset
    result = Result("calibrate", machine, dataset)
    failure = None
    try:
        _write_files(asked, calibration, result)
    except TrueposeError as error:  # the answer is printed all the same
        failure = error
    shown = []
    if request.format == "table":
        from truepose.reporting.calibration import tables

        click.echo(_folded(dataset.attrs["answer"]) + "\n")
        shown = tables(dataset, result.machine.shown)
    _steps.deliver(replace(request, output=None), result, shown)
    if failure is not None:
        raise failure
    return 0 if calibration.accepted or options["force"] else 1


class _Options:
    """The options of the command, sorted."""

    def __init__(self, options: dict[str, Any]) -> None:
        self.data: Path = options["data"]
        self.machine_output: Path | None = options["machine_output"]
        self.page: Path | None = options["report"]
        self.date: str | None = options["date"]
        self.as_shifts: bool = options["as_shifts"]
        self.controller_holds: Holds | None = options["controller_holds"]
        self.force: bool = options["force"]
        names = ("machine_file", "settings", "format", "output")
        self.request = Request(**{name: options[name] for name in names})

    def check(self) -> None:
        """Refuse options that exclude each other, or that are of no use without the other."""
        if self.as_shifts and self.controller_holds == "calibrated":
            raise click.UsageError(
                "--as-shifts means --controller-holds drawing, and excludes calibrated."
            )
        if self.machine_output is not None:
            if self.date is None:
                raise click.UsageError(
                    "--machine-output needs --date YYYY-MM-DD: the day of the measurements stands "
                    "in the file, and no clock is asked."
                )
            return
        for given, name in (
            (self.date is not None, "--date"),
            (self.as_shifts, "--as-shifts"),
            (self.controller_holds is not None, "--controller-holds"),
            (self.force, "--force"),
        ):
            if given:
                raise click.UsageError(f"{name} is for a machine file: give --machine-output too.")


def _folded(text: str) -> str:
    """A long sentence in lines that can be read."""
    import textwrap

    return textwrap.fill(text, 100)


def _write_files(asked: _Options, calibration: Calibration, result: Result) -> None:
    """All files that are asked for, before anything is printed: a reader may stop reading."""
    from truepose.cli._steps import note_written
    from truepose.files.writing import written_together
    from truepose.reporting import formats

    with written_together():
        if asked.request.output is not None:
            formats.write(result, asked.request.output)
        if asked.page is not None:
            _write_page(asked.request, result.machine, result.dataset, asked.page)
        machine = None if asked.machine_output is None else _write_machine(asked, calibration)
    note_written(
        asked.request.output, asked.page, None if machine is None else asked.machine_output
    )


def _write_machine(asked: _Options, calibration: Calibration) -> Machine | None:
    """The calibrated file, unless the answer is no and nobody forces it."""
    from truepose.calibration.dataset import verdict_of
    from truepose.calibration.result.save import save

    assert asked.machine_output is not None
    assert asked.date is not None
    if not (calibration.accepted or asked.force):
        click.echo(
            f"{asked.machine_output} is not written, since the answer is no; --force writes it "
            "with the warning inside.",
            err=True,
        )
        return None
    written = save(
        calibration,
        asked.machine_output,
        original=asked.request.machine_file,
        date=asked.date,
        controller_holds=asked.controller_holds or "drawing",
        force=asked.force,
    )
    said = () if written.calibration is None else written.calibration.warning
    for line in said:
        if line != verdict_of(calibration):  # that is printed as the answer
            click.echo(f"Warning, inside the file too: {line}.", err=True)
    if not calibration.accepted:
        click.echo("The answer is NO: the file was forced, and says so inside.", err=True)
    return written


def _write_page(request: Request, machine: Machine, dataset: Any, page: Path) -> None:
    """The report of the machine as filed, with the calibration on top."""
    from dataclasses import replace

    from truepose.cli import _steps
    from truepose.reporting.drawing_packages import module_that_draws

    study = replace(_steps.compared(request, machine), calibration=dataset)
    text = _steps.machine_text(request)
    module_that_draws("truepose.reporting.page").write(study, page, text)
