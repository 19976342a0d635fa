"""`truepose schema`: the machine file's JSON schema, with which editors complete its keys."""

from __future__ import annotations

from pathlib import Path

import click

from truepose.cli._options import OutputFile, takes


@click.command("schema")
@takes(
    click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE.json",
        type=OutputFile(".json"),
        help="Write it to FILE.json instead; `truepose init` names truepose-schema.json beside "
        "the machine file.",
    ),
)
def command(output: Path | None) -> int:
    """Print the machine file's JSON schema, for editors.

    An editor with taplo (Even Better TOML) completes the keys of a machine file whose first line
    is `#:schema truepose-schema.json`, says what each is, and marks those that are wrong, once
    `truepose schema -o truepose-schema.json` has written that file beside it.
    """
    from truepose.machine.reference import schema_text
    from truepose.sources import REGISTRY

    text = schema_text(REGISTRY)
    if output is None:
        click.echo(text, nl=False)
        return 0
    from truepose.cli._steps import note_written
    from truepose.files.writing import replacing, require_writable

    require_writable(output, [".json"])
    with replacing(output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    note_written(output)
    return 0
