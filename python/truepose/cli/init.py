"""`truepose init`: a machine file to begin with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from truepose.cli import _complete
from truepose.cli._options import OutputFile, format_option, takes

if TYPE_CHECKING:
    from truepose.machine.families import MachineFamily
    from truepose.machine.library import LibraryMachine
    from truepose.reporting.table import Table


class _InitCommand(click.Command):
    """The options of a family stand in its own class: they are read where they are asked for."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Learn first of which kind the file is to be."""
        own = {name for option in self.params for name in (*option.opts, *option.secondary_opts)}
        own -= {"kind"}
        asked = [word.partition("=")[0] for word in args if word.startswith("-")]
        if any(word not in own for word in asked):
            ctx.meta[_FAMILY] = _family_in(args)
        return super().parse_args(ctx, args)

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """And those of the family, if it is one."""
        return [*super().get_params(ctx), *_options(ctx.meta.get(_FAMILY))]

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The family's drawing."""
        super().format_epilog(ctx, formatter)
        family = ctx.meta.get(_FAMILY)
        if family is not None:
            with formatter.section(f"{family.kind}: {family.doc.rstrip('.')}"):
                formatter.write("".join(f"  {line}\n" for line in family.drawing.splitlines()))


_FAMILY = "truepose.family"
_OPTION = "family_"
"""What the options of a family begin with among the values of the command."""


def _family_in(args: Sequence[str]) -> type[MachineFamily] | None:
    """The family that a command line names, if any."""
    from truepose.machine.library import kinds

    if not set(kinds()).intersection(args):
        return None
    from truepose.machine.families import REGISTRY

    return next((family for family in REGISTRY if family.kind in args), None)


def _options(family: type[MachineFamily] | None) -> list[click.Parameter]:
    if family is None:
        return []
    return [
        click.Option(
            [f"--{key.replace('_', '-')}", f"{_OPTION}{key}"],
            metavar="VALUE",
            help=f"{'' if field.is_required() else '(Optional.) '}{field.description}",
        )
        for key, field in family.model_fields.items()
    ]


@click.command(
    "init",
    cls=_InitCommand,
    epilog="KIND --help shows the parameters of a kind that is a family, and its drawing.",
)
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
@click.pass_context
def command(
    context: click.Context,
    /,
    kind: str | None,
    listed: bool,
    output: Path | None,
    format: str,  # noqa: A002
    **parameters: str | None,
) -> int:
    """Write a commented machine file of a kind to begin with.

    It is complete: every command reads it as it stands, and each key says what it is. A file that
    is already there is not touched. Its first line is for editors: `truepose schema` says how they
    complete its keys.

    With the parameters of its family (`--radius 138`, in mm and degrees, or with a unit) it is
    that machine, [family] in place of joint centres: all else is the library's, the workspace as
    large as the machine, a travel as long as the workspace needs.
    """
    if listed == (kind is not None):
        raise click.UsageError("Give a KIND, or --list to see which there are.")
    from truepose.machine import library

    if kind is None:
        _show(library.machines(), format)
        return 0
    from truepose.cli._steps import note_written
    from truepose.files.writing import replacing, require_new, require_writable
    from truepose.machine.template import commented
    from truepose.sources import REGISTRY

    machine = library.machine_of(kind)
    given = {
        key.removeprefix(_OPTION): value for key, value in parameters.items() if value is not None
    }
    path = output or Path(f"{kind}.toml")
    require_writable(path, [".toml"])
    require_new(path)
    text = machine.text if not given else _of_family(context.meta[_FAMILY], given)
    with replacing(path) as temporary:
        temporary.write_text(commented(text, REGISTRY), encoding="utf-8")
    note_written(path)
    return 0


def _of_family(family: type[MachineFamily], given: dict[str, str]) -> str:
    import truepose
    from truepose.machine.families.template import template

    return template(family, given, truepose.load)


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
