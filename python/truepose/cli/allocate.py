"""`truepose allocate`: which tolerances, materials and stiffnesses, at least cost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import (
    OutputFile,
    Request,
    _note_format,
    machine_argument,
    set_option,
    takes,
)
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    from truepose.machine import Machine

ENDING = ".toml"


@click.command("allocate")
@takes(
    machine_argument,
    click.option(
        "--before/--after",
        "before",
        default=True,
        help="Keep the target with the machine commanded as it is, or with the commands "
        "corrected.  [default: --before]",
    ),
    click.option(
        "--worst",
        is_flag=True,
        help="Choose for every machine inside the bands, also where the file asks its accuracy "
        "of a share of them.",
    ),
    click.option(
        "--reserve",
        metavar="SHARE",
        default="1 %",
        show_default=True,
        help="Share of the target that the design leaves, for poses between those looked at.",
    ),
    click.option(
        "--gap",
        metavar="SHARE",
        default="1 %",
        show_default=True,
        help="By which share of its cost the design may be dearer than the cheapest.",
    ),
    click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE.toml",
        type=OutputFile(ENDING),
        help="Write the machine file with the design in it; all else stays as it is.",
    ),
    set_option,
    click.option(
        "--format",
        "format",
        type=click.Choice(["table", "json"]),
        default="table",
        show_default=True,
        callback=_note_format,
        is_eager=True,
        help="What is printed: tables for people, or json for programs (full precision, in the "
        "units of the machine file).",
    ),
    verbose_option,
)
def command(
    *, before: bool, worst: bool, reserve: str, gap: str, output: Path | None, **options: Any
) -> int:
    """Choose tolerances and options at least cost.

    Takes, of what [cost] offers, the grades and options that keep the accuracy asked over the whole
    workspace, in the condition of the file and in every [case.NAME], and says what none that is
    cheaper can cost less than. Ctrl-C gives the best design found by then (exit code 130).
    """
    import truepose
    from truepose.cli import _steps
    from truepose.cli._progress import progress
    from truepose.files.writing import require_writable
    from truepose.reporting import allocation as words
    from truepose.reporting.result import Result
    from truepose.verdict.answer import AFTER, BEFORE

    request = Request(**options)
    if output is not None:
        require_writable(output, [ENDING], [request.machine_file])
    machine = _steps.load_machine(request.machine_file, request.settings)
    shares = _share(machine, "--reserve", reserve), _share(machine, "--gap", gap)
    with progress("allocation", "programmes", first="a design of the finest grades") as report:
        allocation = truepose.allocate(
            machine,
            state=BEFORE if before else AFTER,
            worst=worst,
            reserve=shares[0],
            gap=shares[1],
            progress=report,
        )
    if allocation.interrupted:
        click.echo(words.interrupted(allocation), err=True)
    beside = [] if output is None else [(output, allocation.text(output))]
    if request.format == "table":
        for sentence in words.sentences(allocation):
            click.echo(sentence)
        click.echo()
    _steps.deliver(
        request,
        Result("allocate", machine, allocation.dataset),
        words.tables(allocation),
        beside=beside,
    )
    if request.format != "table":
        # Beside data for programs a sentence goes where people look.
        for sentence in words.sentences(allocation):
            click.echo(sentence, err=True)
    return INTERRUPTED if allocation.interrupted else 0


def _share(machine: Machine, option: str, text: str) -> float:
    """A share, "1 %" or 0.01."""
    from truepose.errors import Problem, ReadingError, RequestError
    from truepose.files.units import UnitSystem

    try:
        return UnitSystem(machine.file_units).read(text.strip(), "ratio")
    except ReadingError as failure:
        raise RequestError(
            Problem(
                "bad-allocation",
                f"{option} cannot be read",
                found=failure.found or text,
                expected='a share, such as "1 %" or 0.01',
            )
        ) from None
