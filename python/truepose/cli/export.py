"""`truepose export`: what a controller is to be given for a machine."""

from __future__ import annotations

from pathlib import Path

import click

from truepose.cli import _complete
from truepose.cli._options import InputFile, OutputFile, set_option, takes
from truepose.cli._verbose import verbose_option


@click.command("export")
@takes(
    click.argument("controller", required=False, shell_complete=_complete.controllers),
    click.argument(
        "machine_file",
        metavar="[MACHINE.toml]",
        type=InputFile(".toml"),
        required=False,
    ),
    set_option,
    click.option(
        "--option",
        "options",
        metavar="KEY=VALUE",
        multiple=True,
        help="What the controller's adapter may be asked besides; --list names them. "
        "May be repeated.",
    ),
    click.option(
        "--output",
        "-o",
        "folder",
        metavar="FOLDER",
        type=OutputFile(),
        help="Write the files into FOLDER, which is made where it is not there. Without it they "
        "are printed.",
    ),
    click.option(
        "--against",
        "against",
        metavar="FILE",
        type=InputFile(".cfg", ".g", ".h", ".hal", ".ini"),
        help="Print what is to change in your own configuration FILE instead, as a difference that "
        "`patch` applies: comments and order stay.",
    ),
    click.option("--list", "listed", is_flag=True, help="Describe every controller, and stop."),
    verbose_option,
)
def command(
    controller: str | None,
    machine_file: Path | None,
    settings: tuple[str, ...],
    options: tuple[str, ...],
    folder: Path | None,
    against: Path | None,
    listed: bool,
) -> int:
    """Print what a CONTROLLER is to be given for the machine.

    C or a module with the machine's kinematics and live compensation, the numbers of a
    controller's own model with what they leave over, or a map of corrections. The condition is
    the file's; --set changes it.
    """
    if listed:
        _show_controllers()
        return 0
    if controller is None or machine_file is None:
        raise click.UsageError("Give a CONTROLLER and a MACHINE.toml, or --list.")
    if against is not None and folder is not None:
        raise click.UsageError(
            "--against prints a difference and writes no file: leave --output away, or write it "
            "with > FILE.patch."
        )
    from truepose.cli._progress import progress
    from truepose.cli._steps import load_machine, note_written
    from truepose.controllers import controller as adapter_of
    from truepose.controllers import export
    from truepose.files.writing import replacing, require_folder, written_together

    adapter_of(controller)
    if folder is not None:
        require_folder(folder)
    machine = load_machine(machine_file, settings)
    with progress(f"export {controller}"):
        result = export(machine, controller, options)
    if against is not None:
        from truepose.controllers import difference

        changes = difference(controller, result, against)
        click.echo(changes, nl=False)
        if not changes:
            click.echo(f"nothing to change: {against} has these numbers", err=True)
    elif folder is None:
        for name, text in result.files.items():
            if len(result.files) > 1:
                click.echo(f"==> {name} <==")
            click.echo(text, nl=not text.endswith("\n"))
    else:
        require_folder(folder, result.files)
        with written_together():
            for name, text in result.files.items():
                with replacing(folder / name) as temporary:
                    temporary.write_text(text, encoding="utf-8")
        note_written(*(folder / name for name in result.files))
    for line in result.statement:
        click.echo(line, err=folder is None)
    return 0


def _show_controllers() -> None:
    from truepose.cli._show import show_described
    from truepose.controllers import REGISTRY
    from truepose.controllers import controller as adapter_of

    adapters = map(adapter_of, REGISTRY)
    header = ("controller", "what it is given", "options")
    show_described("Controllers", header, ((a.name, a.doc, a.options) for a in adapters))
