"""`truepose allocate`: which tolerances, materials and stiffnesses, at least cost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import click

from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import (
    OutputFile,
    Request,
    _note_format,
    machine_argument,
    read_share,
    set_option,
    takes,
)
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    from truepose.machine import Machine

ENDING = ".toml"
MOST_TARGETS = 1000
"""Of a curve."""


class Asked(TypedDict):
    """What `truepose.allocate` and its curve are asked alike."""

    state: str
    worst: bool
    statistical: float | None
    all_poses: bool
    reserve: float
    gap: float


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
        "--statistical",
        metavar="PERCENT",
        help="Choose so that this share of all machines is within the target at each pose, such "
        "as 95.  [default: the file's accuracy.at, else --worst]",
    ),
    click.option(
        "--all-poses",
        is_flag=True,
        help="With a share of all machines: at all poses at once, which asks more.",
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
        "--alternatives",
        metavar="N",
        type=int,
        default=0,
        show_default=True,
        help="Other designs that are told with their costs: of other options, or without one "
        "of the grades of what is tied.",
    ),
    click.option(
        "--region",
        is_flag=True,
        help="Prove the design at every pose of the box too, not at the worst ones alone; this "
        "may take minutes.",
    ),
    click.option(
        "--curve",
        metavar="FROM:TO:COUNT",
        help="Instead of a design, what it costs for so many position targets, such as "
        '"0.1 mm:0.2 mm:5".',
    ),
    click.option(
        "--report",
        "report_file",
        metavar="FILE.html",
        type=OutputFile(".html"),
        help="Write a page with figures too: what the error is made of as filed and designed, "
        "where it binds; of a curve the costs.",
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
        type=click.Choice(["table", "json", "csv"]),
        default="table",
        show_default=True,
        callback=_note_format,
        is_eager=True,
        help="What is printed: tables for people, json or csv for programs (full precision, in "
        "the units of the machine file).",
    ),
    verbose_option,
)
def command(
    *,
    before: bool,
    worst: bool,
    statistical: str | None,
    all_poses: bool,
    reserve: str,
    gap: str,
    alternatives: int,
    region: bool,
    curve: str | None,
    report_file: Path | None,
    output: Path | None,
    **options: Any,
) -> int:
    """Choose tolerances and options at least cost.

    Takes, of what [cost] offers, the grades and options that keep the accuracy asked over the whole
    workspace, in the condition of the file and in every [case.NAME], and says what none that is
    cheaper can cost less than. Ctrl-C gives the best design found by then (exit code 130). Exit
    code 1 where --region meets a pose at which the design does not keep them.
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
    page = None if report_file is None else _page(report_file, request.machine_file)
    machine = _steps.load_machine(request.machine_file, request.settings)
    asked: Asked = {
        "state": BEFORE if before else AFTER,
        "worst": worst,
        "statistical": None if statistical is None else _percent(statistical),
        "all_poses": all_poses,
        "reserve": _share("--reserve", reserve),
        "gap": _share("--gap", gap),
    }
    if curve is not None:
        if output is not None:
            raise click.UsageError("--curve has several designs: it goes without --output.")
        return _curve(request, machine, curve, asked, report_file)
    with progress("allocation", "programmes", first="a design of the finest grades") as report:
        allocation = truepose.allocate(
            machine, **asked, alternatives=alternatives, region=region, progress=report
        )
    if allocation.interrupted:
        click.echo(words.interrupted(allocation), err=True)
    if page is not None and report_file is not None:
        page.write(allocation, report_file)
        _steps.note_written(report_file)
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
    if allocation.interrupted:
        return INTERRUPTED
    proof = allocation.region_proof
    return int(proof is not None and proof.witness is not None)


def _page(path: Path, machine_file: Path) -> Any:
    """The module that writes the page, before any work."""
    from truepose.files.writing import require_writable
    from truepose.reporting.drawing_packages import module_that_draws

    require_writable(path, (".html",), [machine_file])
    return module_that_draws("truepose.reporting.allocation_page")


def _curve(
    request: Request, machine: Machine, text: str, asked: Asked, report_file: Path | None
) -> int:
    """Costs against targets -> exit code."""
    from truepose.cli import _steps
    from truepose.cli._progress import progress
    from truepose.design.cost_curve import cost_curve
    from truepose.reporting import allocation as words
    from truepose.reporting.result import Result

    targets = _targets(machine, text)
    with progress("cost curve", "targets", first="the widest target") as report:
        curve = cost_curve(machine, targets, **asked, progress=report)
    if curve.interrupted:
        click.echo(f"Interrupted after {len(curve.points)} of {len(targets)} targets.", err=True)
    if report_file is not None:
        _page(report_file, request.machine_file).write_curve(curve, report_file)
        _steps.note_written(report_file)
    _steps.deliver(request, Result("allocate", machine, curve.dataset), [words.curve(curve)])
    return INTERRUPTED if curve.interrupted else 0


def _targets(machine: Machine, text: str) -> list[float]:
    """Position targets, m, of "0.1 mm:0.2 mm:5"; bare numbers are lengths of the file."""
    from truepose.errors import Problem, ReadingError, RequestError
    from truepose.files.units import UnitSystem

    parts = text.split(":")
    try:
        if len(parts) == 3 and parts[2].strip().isdecimal():
            count = int(parts[2])
            units = UnitSystem(machine.file_units)
            start, stop = (units.read(part.strip(), "length") for part in parts[:2])
            if 1 <= count <= MOST_TARGETS and start > 0.0 and stop > 0.0:
                step = (stop - start) / max(count - 1, 1)
                return [start + number * step for number in range(count)]
    except ReadingError:
        pass
    raise RequestError(
        Problem(
            "bad-allocation",
            "--curve cannot be read",
            found=text,
            expected=f'"0.1 mm:0.2 mm:5": two targets above zero, and 1 to {MOST_TARGETS} of them',
        )
    )


def _percent(text: str) -> float:
    """A share of all machines: "95", "95 %" and "0.95" are the same."""
    try:
        number = float(text)
    except ValueError:
        return _share("--statistical", text)
    return number / 100.0 if number > 1.0 else number


def _share(option: str, text: str) -> float:
    return read_share(
        option, text, code="bad-allocation", expected='a share, such as "1 %" or 0.01'
    )
