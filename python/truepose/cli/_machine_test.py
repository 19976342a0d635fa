"""What `truepose part --test` does: an acceptance test of the machine, predicted."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli._options import InputFile, OutputFile
from truepose.machine_tests import REGISTRY, test_named

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.machine_tests._base import MachineTest

test_options = (
    click.option(
        "--test",
        type=click.Choice(list(REGISTRY)),
        help="Predict an acceptance test of the machine instead, without PART.ngc. circular: what "
        "a ball bar shows, both ways round (ISO 230-4).",
    ),
    click.option(
        "--plane",
        type=click.Choice(["xy", "yz", "zx"]),
        help="Of a test: the plane of the circle, by default xy.",
    ),
    click.option("--radius", metavar="LENGTH", help='Of a test: radius, such as "100 mm".'),
    click.option(
        "--centre",
        metavar="x=..,y=..,z=..",
        help="Of a test: centre of the circle in machine coordinates. Angles default to home.",
    ),
    click.option("--start-angle", metavar="ANGLE", help="Of a test: where the readings begin."),
    click.option(
        "--overshoot",
        metavar="ANGLE",
        help="Of a test: angle before and after the readings, by default 180 deg.",
    ),
    click.option(
        "--step", metavar="ANGLE", help="Of a test: angle between readings, by default 1 deg."
    ),
    click.option(
        "--measured",
        metavar="FILE.csv",
        type=InputFile(".csv"),
        help="Of a test: readings (angle, radius, run, direction) to compare with.",
    ),
    click.option(
        "--reading-uncertainty",
        metavar="LENGTH",
        help='Of a test: standard uncertainty of a measured reading, by default "0.5 um".',
    ),
    click.option(
        "--readings",
        metavar="FILE.csv",
        type=OutputFile(".csv"),
        help="Of a test: write the measured readings for `truepose calibrate`.",
    ),
)
"""In the order of the help; what each test takes it says itself."""

NAMES = {"start_angle": "start", "reading_uncertainty": "uncertainty"}
"""Option -> what a test calls it, where the command has another by that name."""

OPTIONS = ("plane", "radius", "centre", "start_angle", "overshoot", "step", "measured",
           "reading_uncertainty", "readings")  # fmt: skip

SHARED = ("machine_file", "test", "samples", "probability", "seed", "settings", "format", "output",
          "verbose")  # fmt: skip
"""Options that a test and a part both take."""

ENDINGS = (".json", ".csv", ".nc", ".html")


def check_options(*, test: bool) -> None:
    """Refuse options of a part with a test, and of a test with a part."""
    context = click.get_current_context()
    for option in context.command.params:
        name = option.name or ""
        said = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if said and name not in SHARED and (name in OPTIONS) != test:
            flag = option.opts[0] if option.opts[0].startswith("-") else str(option.metavar)
            word = f"--test takes no {flag}." if test else f"{flag} is of a --test."
            raise click.UsageError(word)


def run(machine_file: Path, output: Path | None, given: dict[str, Any]) -> int:
    """Make the test and show it -> exit code: 1 where what is measured is not within."""
    from truepose.cli._progress import progress
    from truepose.cli._steps import load_machine
    from truepose.files.writing import require_writable

    test = test_named(given["test"])
    inputs = [path for path in (machine_file, given["measured"]) if path is not None]
    if output is not None:
        require_writable(output, ENDINGS, inputs)
    if given["readings"] is not None:
        require_writable(given["readings"], [".csv"], inputs)
    machine = load_machine(machine_file, given["settings"])
    options = _options(machine, test, given)
    page = None
    if output is not None and output.suffix.lower() == ".html":
        from truepose.reporting.drawing_packages import module_that_draws

        page = module_that_draws(test.page)
    samples = {} if given["samples"] is None else {"samples": given["samples"]}
    with progress("test", "samples") as report:
        result = test.run(
            machine,
            **options,
            **samples,
            seed=given["seed"],
            probability=given["probability"],
            progress=report,
        )
    return _deliver(machine, test, result, page, output, given)


def _deliver(
    machine: Machine,
    test: MachineTest,
    result: Any,
    page: Any,
    output: Path | None,
    given: dict[str, Any],
) -> int:
    import sys
    from importlib import import_module

    from truepose.cli._show import show_lines, show_tables
    from truepose.cli._steps import note_written
    from truepose.cli._verbose import say_result
    from truepose.reporting import formats
    from truepose.reporting.result import Result

    shown = import_module(test.reporting)
    whole = Result("part", machine, result)
    say_result(result)
    if page is not None:
        page.write(machine, result, output)
    elif output is not None:
        formats.write(whole, output)
    if given["format"] == "table":
        show_lines(shown.summary(machine, result))
        show_tables(shown.tables(machine, result))
    else:
        sys.stdout.writelines(formats.text(whole, f".{given['format']}"))
    note_written(output, given["readings"])
    return int(result.attrs.get("within", 1) == 0)


def _options(machine: Machine, test: MachineTest, given: dict[str, Any]) -> dict[str, Any]:
    """What was given, quantities in SI. Raises `RequestError` (test-option) with all problems."""
    from truepose.errors import Problem, RequestError
    from truepose.files.units import UnitSystem
    from truepose.machine_tests.circle_path import option_problem

    units, problems = UnitSystem(machine.file_units), list[Problem]()
    options: dict[str, Any] = {}
    for name in OPTIONS:
        value, own = given[name], NAMES.get(name, name)
        option = test.options.get(own)
        flag = f"--{name.replace('_', '-')}"
        if option is None:
            if value is not None:
                problems.append(option_problem(flag, f"{flag} {value}", f"nothing: {test.name}"))
            continue
        if value is None:
            if option.required:
                problems.append(option_problem(own, f"no {flag}", f"{flag} {option.doc}"))
            continue
        if option.dimension == "place":
            options[own] = _place(units, flag, str(value), problems)
        elif option.dimension in ("word", "file"):
            options[own] = value
        else:
            number = _quantity(units, flag, str(value), option.dimension, problems)
            options[own] = number
    if problems:
        raise RequestError(*problems)
    return options


def _place(units: Any, flag: str, text: str, problems: list[Any]) -> dict[str, float]:
    """Coordinates by name of "x=0 mm, y=0 mm"."""
    from truepose.machine_tests.circle_path import option_problem

    place: dict[str, float] = {}
    for part in filter(None, (text_part.strip() for text_part in text.split(","))):
        name, equals, value = part.partition("=")
        axis = name.strip().lower()
        if not equals or axis in place:
            expected = "a coordinate, such as x=10 mm, each once"
            problems.append(option_problem(flag, part, expected))
            continue
        dimension = "angle" if axis in "abc" else "length"
        place[axis] = _quantity(units, flag, value.strip(), dimension, problems)
    return place


def _quantity(units: Any, flag: str, text: str, dimension: str, problems: list[Any]) -> float:
    from truepose.errors import ReadingError
    from truepose.files.dimensions import DIMENSIONS
    from truepose.machine_tests.circle_path import option_problem

    try:
        try:
            return float(units.read(float(text), dimension))
        except ValueError:
            return float(units.read(text, dimension))
    except ReadingError as failure:
        expected = failure.expected or DIMENSIONS[dimension].phrase
        problems.append(option_problem(flag, failure.found or text, expected))
        return math.nan
