"""`truepose import`: a machine file from what its controller has."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from truepose.cli import _complete
from truepose.cli._options import InputFile, OutputFile, takes
from truepose.cli._verbose import verbose_option

if TYPE_CHECKING:
    from truepose.controllers import Import


@click.command("import")
@takes(
    click.argument("controller_file", metavar="[FILE]", type=InputFile(), required=False),
    click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE.toml",
        type=OutputFile(".toml"),
        help="Where the machine file goes; without it, it is printed.",
    ),
    click.option(
        "--measurements",
        "measurements",
        metavar="FILE.csv",
        type=OutputFile(".csv"),
        help="Where the measurements go that the controller kept, for `truepose calibrate`.",
    ),
    click.option(
        "--from",
        "kind",
        metavar="CONTROLLER",
        shell_complete=_complete.readers,
        help="Whose file it is, where its content does not tell; --list names them.",
    ),
    click.option(
        "--set",
        "settings",
        metavar="KEY=VALUE",
        multiple=True,
        help="What the file does not say; --list names what there is. Bare numbers are mm and "
        "degrees. May be repeated.",
    ),
    click.option("--list", "listed", is_flag=True, help="Describe every kind of file, and stop."),
    verbose_option,
)
def command(
    controller_file: Path | None,
    output: Path | None,
    measurements: Path | None,
    kind: str | None,
    settings: tuple[str, ...],
    listed: bool,
) -> int:
    """Write a machine file from the FILE that its controller has.

    Such as Klipper's printer.cfg, with the measurements of its last calibration. What the file does
    not say is assumed, in lines that say so. Files that are already there are not touched.
    """
    if listed:
        _show_readers()
        return 0
    if controller_file is None:
        raise click.UsageError("Give the FILE of a controller, or --list.")
    from truepose.cli._steps import note_written
    from truepose.cli._verbose import say_machine, step
    from truepose.controllers import import_machine
    from truepose.errors import Fault, RequestError
    from truepose.files.writing import replacing, require_new, require_writable, written_together

    for path, ending in ((output, ".toml"), (measurements, ".csv")):
        if path is not None:
            require_writable(path, [ending])
            require_new(path)
    with step("controller's file"):
        found = import_machine(controller_file, kind, settings)
        say_machine(found.machine)
    if measurements is not None and found.measurements_text is None:
        fault = Fault(
            "import-no-measurements",
            "there are no measurements to write",
            found="a file that keeps none",
            expected="a file of a controller that was calibrated, or no --measurements",
        )
        raise RequestError(fault.at(str(controller_file)))
    texts = ((output, found.text), (measurements, found.measurements_text))
    with written_together():
        for path, text in texts:
            if path is not None and text is not None:
                with replacing(path) as temporary:
                    temporary.write_text(text, encoding="utf-8", newline="\n")
    note_written(output, measurements)
    if output is None:
        click.echo(found.text, nl=False)
    for line in _statement(found, measurements):
        click.echo(line, err=output is None)
    return 0


def _statement(found: Import, measurements: Path | None) -> list[str]:
    """What the user must know: where it is from, what is assumed, what was lost."""
    lines = [f"{found.kind}: {found.machine.name}, by {len(found.holds)} values of the file"]
    lines += [f"assumed: {each.sentence} ({each.key})" for each in found.assumptions]
    lines += [f"lost: {sentence}" for sentence in found.lost]
    if any("tolerance" in each.key for each in found.assumptions):
        lines.append(
            "next: put in what you know of what is assumed: until then `truepose check` answers "
            "for the assumptions, not for this machine"
        )
    if found.measurements is not None and measurements is None:
        lines.append("the file keeps measurements: --measurements FILE.csv writes them")
    return lines


def _show_readers() -> None:
    from truepose.cli._show import show_described
    from truepose.controllers import READERS
    from truepose.controllers import reader as reader_of

    readers = map(reader_of, READERS)
    header = ("controller", "what is read", "--set")
    show_described("Files of controllers", header, ((r.name, r.doc, r.settings) for r in readers))
