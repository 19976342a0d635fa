"""`truepose init`: a machine file to begin with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from truepose.cli import _complete
from truepose.cli._options import OutputFile, format_option, takes

if TYPE_CHECKING:
    from truepose.machine.library import LibraryMachine
    from truepose.reporting.table import Table


@click.command("init")
@takes(
    click.argument("kind", required=False, shell_complete=_complete.kinds),
    click.option("--list", "listed", is_flag=True, help="Describe every kind, and write nothing."),
    click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE.toml",
        type=OutputFile(".toml"),
        help="Where the file goes; by default beside you, named KIND.toml.",
    ),
    format_option,
)
def command(kind: str | None, listed: bool, output: Path | None, format: str) -> int:  # noqa: A002
    """Write a commented machine file of a kind to begin with.

    It is complete: every command reads it as it stands. A file that is already there is not
    touched. Its first line is for editors: `truepose schema` says how they complete its keys.
    """
    if listed == (kind is not None):
        raise click.UsageError("Give a KIND, or --list to see which there are.")
    from truepose.machine import library

    if kind is None:
        _show(library.machines(), format)
        return 0
    from truepose.cli._steps import note_written
    from truepose.files.writing import replacing, require_new, require_writable

    machine = library.machine_of(kind)
    path = output or Path(f"{kind}.toml")
    require_writable(path, [".toml"])
    require_new(path)
    with replacing(path) as temporary:
        temporary.write_text(machine.template, encoding="utf-8")
    note_written(path)
    return 0


def _show(machines: Sequence[LibraryMachine], form: str) -> None:
    if form == "table":
        from truepose.cli._show import show_tables

        show_tables([_table(machines)])
    else:
        click.echo(_text(machines, form))


def _table(machines: Sequence[LibraryMachine]) -> Table:
    from truepose.reporting.table import Table

    header = ("kind", "freedoms", "drives", "what it is")
    return Table(
        "kinds",
        "Machines to begin with",
        header,
        tuple((m.kind, _freedoms(m), _drives(m, " × "), m.description) for m in machines),
        words=len(header),
        note="In brackets: parasitic freedoms. `truepose init KIND` writes the file.",
    )


def _freedoms(machine: LibraryMachine) -> str:
    """The commanded ones, then the others in brackets: `x y z (a b c)`."""
    others = f" ({' '.join(machine.parasitic)})" if machine.parasitic else ""
    return " ".join(machine.commanded) + others


def _drives(machine: LibraryMachine, times: str = " ") -> str:
    return ", ".join(f"{number}{times}{kind}" for kind, number in machine.drives.items())


def _text(machines: Sequence[LibraryMachine], form: str) -> str:
    """The same for programs, as JSON or as CSV one row a kind."""
    import csv
    import io
    import json

    if form == "json":
        rows = [
            {
                "kind": machine.kind,
                "name": machine.name,
                "dof": machine.dof,
                "commanded": machine.commanded,
                "drives": machine.drives,
                "description": machine.description,
            }
            for machine in machines
        ]
        data = {"command": "init", "machines": rows}
        return json.dumps(data, indent=1, ensure_ascii=False)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(["kind", "name", "dof", "commanded", "drives", "description"])
    for machine in machines:
        freedoms = [" ".join(machine.dof), " ".join(machine.commanded)]
        described = [_drives(machine), machine.description]
        writer.writerow([machine.kind, machine.name, *freedoms, *described])
    return buffer.getvalue().rstrip("\n")
