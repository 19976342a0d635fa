"""`truepose plan`: which poses to measure, and what each buys."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli import _complete
from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import (
    OutputFile,
    Request,
    WholeNumber,
    format_option,
    machine_argument,
    output_option,
    seed_option,
    set_option,
    takes,
)
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    from truepose.calibration.instruments import Instrument
    from truepose.errors import Problem
    from truepose.machine import Machine

_PER = {"s": 1.0, "min": 60.0}
_INSTRUMENT = (
    "position=10um, coordinate:z=10um, distance=2um: a kind and the standard uncertainty of its "
    "readings, its frame unknown; or FILE.csv[:NAME], what the head of a file of measurements "
    "declares."
)


@click.command("plan")
@takes(
    machine_argument,
    click.option(
        "--instrument",
        "instruments",
        metavar="WHAT",
        required=True,
        multiple=True,
        help=f"{_INSTRUMENT} May be repeated: all read at every pose.",
    ),
    click.option(
        "--poses",
        "count",
        metavar="N",
        type=WholeNumber(),
        required=True,
        help="How many poses to measure.",
    ),
    click.option(
        "--criterion",
        type=click.Choice(["tool", "determinant"]),
        default="tool",
        show_default=True,
        help="What is to be best: tool, the mean uncertainty at the tool over the workspace; or "
        "determinant, the volume of the ellipsoid of the unknowns.",
    ),
    click.option(
        "--compare",
        "others",
        metavar="WHAT",
        multiple=True,
        help="Say how many readings of this instrument do what those of the first do.",
    ),
    click.option(
        "--identify",
        metavar="PATTERN",
        multiple=True,
        shell_complete=_complete.unknowns,
        help="Find these parameters only, such as strut.*.length; with a half band of their own: "
        '"strut.*.length=0.5 mm". Without it all that have a tolerance.',
    ),
    click.option(
        "--as-filed",
        is_flag=True,
        help="Measure in the condition of the machine file, warm and loaded as it says, instead of "
        "at reference temperature with nothing on the tool.",
    ),
    click.option(
        "--program",
        metavar="FILE",
        type=OutputFile(),
        help="Also write a program (G-code) that dwells at every pose; it does not probe.",
    ),
    click.option(
        "--template",
        metavar="FILE.csv",
        type=OutputFile(".csv"),
        help="Also write a file of measurements with all but the readings filled in.",
    ),
    click.option(
        "--dwell", metavar="TIME", default="2 s", show_default=True, help="Rest at every pose."
    ),
    click.option(
        "--feed",
        metavar="SPEED",
        default="1000 mm/min",
        show_default=True,
        help="Speed between poses.",
    ),
    seed_option,
    set_option,
    format_option,
    output_option,
    verbose_option,
)
def command(
    instruments: tuple[str, ...],
    count: int,
    criterion: str,
    others: tuple[str, ...],
    identify: tuple[str, ...],
    as_filed: bool,
    program: Path | None,
    template: Path | None,
    dwell: str,
    feed: str,
    seed: int,
    **options: Any,
) -> int:
    """Choose the poses to measure for a calibration.

    Takes those poses of the workspace, in reach and away from singularities, that leave the
    calibrated machine's tool known best, and says what each further pose buys. Tolerances count as
    what is known before. Ctrl-C gives the best plan found by then (exit code 130).
    """
    from truepose.calibration.planning.comparison import compare_instruments
    from truepose.calibration.planning.plan import plan
    from truepose.calibration.planning.program import program as program_text
    from truepose.calibration.planning.program import template as template_text
    from truepose.cli import _steps
    from truepose.cli._progress import progress
    from truepose.files.writing import require_writable
    from truepose.reporting import planning
    from truepose.reporting.result import Result

    request = Request(**options)
    machine = _steps.read_machine(request)
    for path, endings in ((program, None), (template, [".csv"])):
        if path is not None:
            require_writable(path, endings or [path.suffix.lower()], [request.machine_file])
    seconds, speed = _seconds(machine, dwell), _speed(machine, feed)
    chosen = _instruments(machine, instruments)
    compared = [_instruments(machine, (other,)) for other in others]
    with progress("plan", "starts", first="a greedy search") as report:
        planned = plan(
            machine,
            chosen,
            count,
            criterion="tool" if criterion == "tool" else "determinant",
            condition=machine.condition if as_filed else None,
            identify=identify,
            seed=seed,
            progress=report,
        )
    if planned.interrupted:
        click.echo(planning.interrupted(planned), err=True)
        compared = []
    beside = []
    if program is not None:
        moves = program_text(
            machine, planned.poses, instruments=planned.instruments, dwell=seconds, feed=speed
        )
        beside.append((program, moves))
    if template is not None:
        beside.append((template, template_text(machine, planned.poses, planned.instruments)))
    sentences: list[str] = []
    for other in compared:
        with progress("comparison", "instruments") as report:
            comparison = compare_instruments(
                machine,
                [chosen[0], other[0]],
                count,
                condition=machine.condition if as_filed else None,
                identify=identify,
                seed=seed,
                progress=report,
            )
        sentences += planning.compared(comparison)
    result = Result("plan", machine, planned.dataset)
    _steps.deliver(request, result, planning.tables(planned), beside=beside)
    if request.format == "table":
        sentences = [*planning.sentences(planned), *sentences]
    for sentence in sentences:
        # Beside data for programs a sentence goes where people look.
        click.echo(sentence, err=request.format != "table")
    return INTERRUPTED if planned.interrupted else 0


def _instruments(machine: Machine, texts: tuple[str, ...]) -> tuple[Instrument, ...]:
    from truepose.calibration.planning.instruments import distinct, instruments_named
    from truepose.errors import RequestError

    instruments: list[Instrument] = []
    problems: list[Problem] = []
    for text in texts:
        try:
            instruments += instruments_named(machine, text)
        except RequestError as failure:
            problems += failure.problems
    if problems:
        raise RequestError(*problems)
    return distinct(machine, tuple(instruments))


def _seconds(machine: Machine, text: str) -> float:
    return _quantity(machine, "--dwell", text, "time", "a time above zero, such as 2 s")


def _speed(machine: Machine, text: str) -> float:
    """M/s of a length a minute or a second; a bare number is in the file's lengths a minute."""
    expected = 'a speed above zero, such as "1000 mm/min"'
    length, slash, per = text.partition("/")
    if slash and per.strip() not in _PER:
        raise _refusal("--feed", text, expected)
    amount = _quantity(machine, "--feed", length, "length", expected)
    return amount / _PER[per.strip() if slash else "min"]


def _quantity(machine: Machine, option: str, text: str, dimension: str, expected: str) -> float:
    from truepose.errors import ReadingError
    from truepose.files.units import UnitSystem

    try:
        value = UnitSystem(machine.file_units).read(text.strip(), dimension)
    except ReadingError as failure:
        raise _refusal(option, failure.found or text, expected) from None
    if value <= 0.0:
        raise _refusal(option, text, expected)
    return value


def _refusal(option: str, found: str, expected: str) -> Exception:
    from truepose.errors import Problem, RequestError

    return RequestError(
        Problem("plan-option", f"{option} cannot be read", found=found, expected=expected)
    )
