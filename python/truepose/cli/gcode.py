"""`truepose gcode`: a program corrected for the machine, with its proof."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from truepose.cli._options import (
    InputFile,
    OutputFile,
    _note_format,
    machine_argument,
    set_option,
    takes,
)
from truepose.cli._program import Quantities, program_options
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from truepose.controllers.gcode import Errors, Proof
    from truepose.files.shown_units import Shown
    from truepose.machine import Machine
    from truepose.reporting.table import Table


@click.command("gcode")
@takes(
    machine_argument,
    click.argument("program", metavar="PROGRAM", type=InputFile(".ngc")),
    click.option(
        "--output",
        "-o",
        metavar="FILE",
        type=OutputFile(),
        help="The corrected program; not the program itself.",
    ),
    click.option(
        "--dry-run",
        is_flag=True,
        help="Only the proof: no program is written.",
    ),
    click.option(
        "--tolerance",
        metavar="LENGTH",
        help="How far the tool may be off the programmed path. An angle counts times the "
        "characteristic length. Default: a share of the error before, at most 5 um; the output "
        "says what it is.",
    ),
    click.option(
        "--interpolation",
        type=click.Choice(["either", "pose"]),
        default="either",
        show_default=True,
        help="What the controller does between two blocks: pose, it solves its kinematics all "
        "along, as LinuxCNC does; either, it may also drive its joints straight to the end.",
    ),
    *program_options,
    click.option(
        "--digits",
        type=click.IntRange(0, 8),
        default=6,
        show_default=True,
        help="Decimals of mm and degrees; inches get one more.",
    ),
    click.option(
        "--path-mode",
        metavar="G64 P..",
        help="How pieces of a divided block are joined that ends in an exact stop (G61, G61.1): "
        "written in front of them, and the program's own mode in front of the last. In the "
        "program's units. Without it the tool stops after every piece.",
    ),
    click.option(
        "--acceleration",
        metavar="ACCELERATION",
        help="Of the tool, for the time that exact stops take. Default: 1000 mm/s^2.",
    ),
    click.option(
        "--force",
        is_flag=True,
        help="Write the program even if its error is no smaller than before.",
    ),
    set_option,
    click.option(
        "--format",
        "form",
        type=click.Choice(["table", "json"]),
        default="table",
        show_default=True,
        callback=_note_format,
        is_eager=True,
        help="What is printed: a table for people (mm and µm, or in and µin, as the file has it), "
        "or json for programs (full precision, m and rad).",
    ),
    verbose_option,
)
def command(
    machine_file: Path,
    program: Path,
    output: Path | None,
    settings: tuple[str, ...],
    form: str,
    tolerance: str | None,
    dry_run: bool,
    units: str | None,
    start: str | None,
    offsets: tuple[tuple[str, str], ...],
    parameter_file: Path | None,
    block_delete: str | None,
    acceleration: str | None,
    **options: Any,
) -> int:
    """Correct a PROGRAM of G-code for the machine.

    Every block is given the pose that takes the actual machine where the program asks for, and
    long moves and arcs are divided so that it also stays on the path between. A program that
    selects no work offset is taken in machine coordinates. The condition is
    the file's; --set changes it. What was written is read back, driven through the actual
    machine, and compared with the program before and after. Exit code 1 where the error after is
    no smaller than before; nothing is written then, but with --force.

    Bare numbers are in the units of the machine file.
    """
    from truepose.cli._problems import show_problems
    from truepose.cli._progress import progress
    from truepose.cli._steps import load_machine, note_written
    from truepose.cli._verbose import say, say_file
    from truepose.controllers.gcode import NoBetter, correct_program
    from truepose.controllers.gcode.exact_stops import ACCELERATION
    from truepose.files.writing import require_writable

    if (output is None) is not dry_run:
        raise click.UsageError("give either --output FILE, or --dry-run for the proof alone")
    if dry_run and options["force"]:
        raise click.UsageError("--force writes a program, and --dry-run writes none")
    if output is not None:
        require_writable(output, [output.suffix.lower()], [machine_file])
    machine = load_machine(machine_file, settings)
    read = Quantities(machine)
    said = "" if tolerance is None else read.said(tolerance)
    try:
        with progress("corrected program", "lines") as report:
            proof = correct_program(
                machine,
                program,
                output,
                tolerance=None if tolerance is None else read.length("--tolerance", tolerance),
                acceleration=(
                    ACCELERATION
                    if acceleration is None
                    else read.acceleration("--acceleration", acceleration)
                ),
                progress=report,
                **vars(read.program(units, start, offsets, parameter_file, block_delete)),
                **options,
            )
            say_file(program)
            say(f"{proof.moves:,} moves, {proof.blocks:,} blocks, {proof.points:,} points compared")
    except NoBetter as no:
        _show(machine, no.proof, form, said, written=False)
        show_problems(no, as_json=False)
        return 1
    _show(machine, proof, form, said, written=output is not None)
    if output is not None:
        note_written(output)
    return 0


def _show(machine: Machine, proof: Proof, form: str, said: str, *, written: bool) -> None:
    """Print what was found, whether or not a program was written; `said`: the tolerance asked."""
    from truepose.cli._show import show_tables

    for warning in proof.warnings:
        click.echo(f"warning[{warning['code']}]: {warning['sentence']}", err=True)
    if form == "json":
        json.dump(_as_json(proof, written=written), sys.stdout, indent=1, ensure_ascii=False)
        sys.stdout.write("\n")
    else:
        show_tables(_tables(machine, proof, said))


def _tables(machine: Machine, proof: Proof, said: str) -> Iterable[Table]:
    """The proof for people; poses as the program has them."""
    import numpy as np

    from truepose.controllers.gcode._axes import LINEAR, Axes
    from truepose.reporting.table import Table

    axes = Axes(machine)
    rows = []
    for kind in ("position", "orientation"):
        unit = machine.shown.error(kind)
        for when, errors in (("before", proof.before), ("after", proof.after)):
            worst, rms = getattr(errors, kind), getattr(errors, f"{kind}_rms")
            if worst is not None:
                rows.append(
                    (
                        kind,
                        when,
                        _scaled(worst.value, unit),
                        "" if rms is None else _scaled(rms, unit),
                        unit.label,
                        str(worst.line),
                        axes.in_words(np.array(worst.pose)),
                    )
                )
    header = ("error of", "program", "maximum", "rms", "in", "at line", "at the pose")
    length = machine.shown.length
    scale = {axis: 1e-3 * length.per_si if axis in LINEAR else 1.0 for axis in proof.start}
    start = " ".join(f"{axis}{value * scale[axis]:.6g}" for axis, value in proof.start.items())
    between = {
        "pose": "a controller that solves its kinematics all along a block",
        "either": "controllers that drive the pose or the joints between two blocks",
    }[proof.interpolation]
    note = (
        f"{proof.moves:,} moves, written as {proof.blocks:,} blocks; compared at {proof.points:,} "
        f"points with what was read back.\n"
        f"Tolerance {_tolerance(machine, proof, said)}, for {between}. rms over the path of "
        f"the feeds; poses in {length.label} and deg, machine coordinates.\n"
        f"Taken to start at {start}"
        + (
            f"; the machine stands there uncorrected, so the path of the first block, in line "
            f"{proof.approach}, counts from its end on."
            if proof.approach is not None
            else "."
        )
        + (
            f"\nPieces joined by {proof.path_mode}: by what it lets a tool leave its path, in the "
            "program's units, the tool may be off more."
            if proof.path_mode is not None
            else ""
        )
    )
    title = f"Error of the tool, before and after; program {proof.coordinates}"
    yield Table("proof", title, header, tuple(rows), 2, note)


def _tolerance(machine: Machine, proof: Proof, said: str) -> str:
    """The tolerance and, where nobody asked for it, why it is that."""
    unit, allowed = machine.shown.small_length, proof.tolerance_from
    text = f"{_scaled(proof.tolerance, unit)} {unit.label}"
    before = "" if allowed.before is None else f"{_scaled(allowed.before, unit)} {unit.label}"
    return {
        "asked": said,
        "error": f"{text}, {100.0 * proof.tolerance / (allowed.before or 1.0):.2g} % of the error "
        f"before ({before})",
        "most": f"{text}, the most that is taken by itself",
        "digits": f"{text}, ten times the rounding of --digits",
    }[allowed.reason]


def _scaled(value: float, unit: Shown) -> str:
    scaled = value * unit.per_si
    return f"{scaled:.4f}" if scaled < 1.0 else f"{scaled:.2f}"


def _as_json(proof: Proof, *, written: bool) -> Mapping[str, object]:
    """The proof for programs, m and rad; the start in the program's own mm and degrees."""

    def of(errors: Errors) -> dict[str, object]:
        answer: dict[str, object] = {}
        for kind in ("position", "orientation"):
            worst = getattr(errors, kind)
            answer[kind] = worst and {
                "maximum": worst.value,
                "rms": getattr(errors, f"{kind}_rms"),
                "line": worst.line,
                "pose": dict(zip(proof.commanded, worst.pose, strict=True)),
            }
        return answer

    stops = proof.exact_stops
    return {
        "command": "gcode",
        "machine": proof.machine,
        "program": proof.source,
        "corrected_program": proof.target,
        "units": {
            "position": "m",
            "orientation": "rad",
            "start": "mm, deg",
            "feed_time": "s",
            "acceleration": "m/s^2",
        },
        "tolerance": proof.tolerance,
        "tolerance_from": proof.tolerance_from.reason,
        "interpolation": proof.interpolation,
        "coordinates": proof.coordinates,
        "start": proof.start,
        "approach_line": proof.approach,
        "moves": proof.moves,
        "blocks": proof.blocks,
        "points": proof.points,
        "before": of(proof.before),
        "after": of(proof.after),
        "improves": proof.improves,
        "path_mode": proof.path_mode,
        "exact_stops": {
            "before": {"stops": stops.before, "feed_time": stops.seconds_before},
            "after": {"stops": stops.after, "feed_time": stops.seconds_after},
            "acceleration": stops.acceleration,
        },
        "warnings": list(proof.warnings),
        "written": written,
    }
